"""Filling rules against a search by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from design.outcome import Outcome
from schedules.fill import FILL_RULES, MissingGains, filled

shapes = st.lists(st.integers(1, 4), min_size=1, max_size=3).map(tuple)
SHARED = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def nearest_by_hand(schedule, index):
    """Point by point, in row-major order, a nearer one replaces the one before."""
    best, found = np.inf, None
    for other in np.ndindex(schedule.shape):
        if schedule.outcomes.codes[other] == Outcome.OK:
            distance = 0.0
            for axis, i, j in zip(schedule.axes, index, other, strict=True):
                span = (axis.values[-1] - axis.values[0]) or 1.0
                distance += ((axis.values[i] - axis.values[0]) / span - (axis.values[j] - axis.values[0]) / span) ** 2
            if distance < best * (1.0 - 1e-12):
                best, found = distance, other
    return found


def neighbour_by_hand(schedule, index):
    """Nearest along the last axis, the lower of two as near; None when the line has no ok point."""
    values = schedule.axes[-1].values
    line = [j for j in range(len(values)) if schedule.outcomes.codes[(*index[:-1], j)] == Outcome.OK]
    found = min(line, key=lambda j: (abs(values[j] - values[index[-1]]), j), default=None)
    return None if found is None else (*index[:-1], found)


def failing(make_schedule, shape, data):
    points = list(np.ndindex(shape))
    failed = data.draw(st.lists(st.sampled_from(points), unique=True, min_size=1, max_size=len(points)))
    return make_schedule(shape, failed=failed, seed=data.draw(st.integers(0, 3)))


@pytest.mark.parametrize(("rule", "by_hand"), [("nearest_ok", nearest_by_hand), ("hold_neighbour", neighbour_by_hand)])
@given(shape=shapes, data=st.data())
@SHARED
def test_all_gains_are_those_of_the_point_found_by_hand(make_schedule, rule, by_hand, shape, data):
    schedule = failing(make_schedule, shape, data)
    expected = {index: index if ok else by_hand(schedule, index) for index, ok in np.ndenumerate(schedule.outcomes.ok)}
    if None in expected.values():
        with pytest.raises(MissingGains, match=f"{rule} finds no gains of main"):
            filled(schedule, rule)
        return
    found = filled(schedule, rule)
    assert found.rule == rule
    assert found.designed is schedule
    np.testing.assert_array_equal(found.filled, ~schedule.outcomes.ok)
    for index, other in expected.items():
        assert np.unravel_index(found.source[index], shape) == other
        for gain, original in zip(found.complete.gains, schedule.gains, strict=True):
            assert gain.values[index] == original.values[other]
    assert np.all(found.complete.outcomes.ok)


def test_of_two_as_near_the_lower_and_of_several_the_first(make_schedule):
    schedule = make_schedule((3, 3), failed=[(1, 1)])
    even = tuple(replace(axis, values=(0.0, 1.0, 2.0)) for axis in schedule.axes)
    schedule = replace(schedule, axes=even)
    assert filled(schedule, "hold_neighbour").source[1, 1] == 3  # (1, 0), not (1, 2)
    assert filled(schedule, "nearest_ok").source[1, 1] == 1  # (0, 1), before (1, 0), (1, 2) and (2, 1)


def test_distance_does_not_depend_on_the_units(make_schedule):
    schedule = make_schedule((4, 5), failed=[(0, 0), (1, 2), (3, 3), (2, 2)])
    first, *rest = schedule.axes
    other = replace(schedule, axes=(replace(first, values=tuple(1024.0 * x for x in first.values)), *rest))
    np.testing.assert_array_equal(filled(schedule, "nearest_ok").source, filled(other, "nearest_ok").source)


@pytest.mark.parametrize("rule", [None, *FILL_RULES])
@pytest.mark.parametrize("shape", [(), (1,), (3, 4)])
def test_nothing_to_fill(make_schedule, rule, shape):
    schedule = make_schedule(shape)
    found = filled(schedule, rule)
    assert found.complete is schedule
    assert found.rule is None
    assert not np.any(found.filled)


def test_refuses_without_a_rule(make_schedule):
    schedule = make_schedule((2, 3), failed=[(1, 2), (1, 0)])
    with pytest.raises(
        MissingGains, match=r"no gains at 2 of 6 points.*\(infeasible; gain margin.*nearest_ok, hold_ne"
    ):
        filled(schedule)
    with pytest.raises(ValueError, match="no fill rule 'zero'; there are: nearest_ok, hold_neighbour"):
        filled(schedule, "zero")


@pytest.mark.parametrize("rule", FILL_RULES)
@pytest.mark.parametrize("shape", [(), (2, 2)])
def test_no_point_to_take_gains_from(make_schedule, rule, shape):
    schedule = make_schedule(shape, failed=list(np.ndindex(shape)))
    with pytest.raises(MissingGains, match=r"is ok$"):
        filled(schedule, rule)
