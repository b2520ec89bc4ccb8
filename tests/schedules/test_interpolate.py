import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator

from design.gains import Gain
from design.outcome import Outcomes
from model.flight import GridAxis
from schedules.interpolate import interpolate, node_slopes
from schedules.rules import INTEGRATOR_PLACEMENTS, INTERPOLATIONS, OUTS_OF_RANGE, ScheduleRules
from schedules.schedule import GainSchedule, Provenance

CUBIC = ScheduleRules("monotone_cubic")


def nodes(schedule):
    return np.meshgrid(*(np.asarray(axis.values) for axis in schedule.axes), indexing="ij")


def random_points(schedule, count, margin=0.3, seed=1):
    rng = np.random.default_rng(seed)
    edges = [(axis.values[0], axis.values[-1]) for axis in schedule.axes]
    return tuple(rng.uniform(a - margin * (b - a), b + margin * (b - a), count) for a, b in edges)


def clip(schedule, points):
    pairs = zip(schedule.axes, points, strict=True)
    return tuple(np.clip(x, axis.values[0], axis.values[-1]) for axis, x in pairs)


@pytest.mark.parametrize("shape", [(7,), (4, 6), (2, 2), (3, 4, 5)])
def test_agrees_with_scipy_at_random_points(make_schedule, shape):
    schedule = make_schedule(shape)
    points = random_points(schedule, 1000)
    inside = clip(schedule, points)
    found = interpolate(schedule, points)
    for gain, original in zip(found.gains, schedule.gains, strict=True):
        oracle = RegularGridInterpolator([axis.values for axis in schedule.axes], original.values)
        np.testing.assert_allclose(
            gain.values,
            oracle(np.stack(inside, axis=-1)),
            rtol=1e-13,
            atol=1e-15 * np.max(np.abs(original.values)),
        )
        assert (gain.name, gain.unit) == (original.name, original.unit)
    outside = np.any([x != y for x, y in zip(points, inside, strict=True)], axis=0)
    np.testing.assert_array_equal(found.clipped, outside)
    assert 0 < np.count_nonzero(outside) < 1000


@pytest.mark.parametrize("shape", [(7,), (4, 6), (3, 4, 5), (1, 6), (4, 1), (1, 1)])
@pytest.mark.parametrize("failed", [(), ((0, 0), (1, 2))])
def test_nodes_come_back_exactly(make_schedule, shape, failed):
    failed = [p for p in failed if len(p) == len(shape) and all(i < n for i, n in zip(p, shape, strict=True))]
    schedule = make_schedule(shape, failed=failed)
    found = interpolate(schedule, nodes(schedule))
    for gain, original in zip(found.gains, schedule.gains, strict=True):
        np.testing.assert_array_equal(gain.values, original.values)
    assert not np.any(found.clipped)


def test_batch_is_the_single_points(make_schedule):
    schedule = make_schedule((4, 6), failed=[(1, 2)])
    points = random_points(schedule, 30)
    found = interpolate(schedule, points)
    for i, point in enumerate(zip(*points, strict=True)):
        one = interpolate(schedule, point)
        assert one.clipped.shape == ()
        assert one.clipped == found.take(i).clipped
        for a, b in zip(one.gains, found.take(i).gains, strict=True):
            np.testing.assert_array_equal(a.values, b.values)


def test_coordinates_broadcast(make_schedule):
    schedule = make_schedule((4, 6))
    h, q = (np.asarray(axis.values) for axis in schedule.axes)
    found = interpolate(schedule, (h[:, None], q[None, :]))
    np.testing.assert_array_equal(found.gains[0].values, schedule.gains[0].values)


def test_a_failed_point_spoils_only_what_it_carries_weight_for(make_schedule):
    """Every node, edge and inside of the cells: nan exactly where a corner of non-zero weight failed."""
    failed = {(1, 2), (3, 5)}
    schedule = make_schedule((4, 6), failed=failed)
    h, q = (np.asarray(axis.values) for axis in schedule.axes)
    halves = [np.arange(0.0, n - 0.5, 0.5) for n in (4, 6)]
    for i, j in itertools.product(*halves):
        x = np.interp(i, np.arange(4), h), np.interp(j, np.arange(6), q)
        corners = set(itertools.product({int(i), int(np.ceil(i))}, {int(j), int(np.ceil(j))}))
        value = interpolate(schedule, x).gains[0].values
        assert np.isnan(value) == bool(corners & failed), (i, j)


def test_a_number_at_a_failed_point_is_never_used(make_schedule):
    whole, spoilt = make_schedule((4, 6)), make_schedule((4, 6), failed=[(1, 2)])
    mixed = type(whole)(**{**vars(whole), "outcomes": spoilt.outcomes})
    h, q = (axis.values for axis in whole.axes)
    assert np.isnan(interpolate(mixed, (h[1], q[2])).gains[0].values)
    assert not np.isnan(interpolate(whole, (h[1], q[2])).gains[0].values)


@pytest.mark.parametrize(("shape", "single"), [((1, 6), 0), ((4, 1), 1)])
def test_constant_along_an_axis_of_one_breakpoint(make_schedule, shape, single):
    schedule = make_schedule(shape)
    other = schedule.axes[1 - single].values
    x = np.linspace(other[0], other[-1], 50)
    at = schedule.axes[single].values[0]
    for y, clipped in ((at, False), (at - 1.0, True), (at + 1.0, True), (np.inf, True)):
        found = interpolate(schedule, (y, x) if single == 0 else (x, y))
        assert np.all(found.clipped == clipped)
        for gain, original in zip(found.gains, schedule.gains, strict=True):
            line = original.values.ravel()
            np.testing.assert_allclose(gain.values, np.interp(x, other, line), rtol=1e-13, atol=1e-15 * abs(line).max())


def test_infinities_are_clipped_and_nan_is_refused(make_schedule):
    schedule = make_schedule((4, 6))
    found = interpolate(schedule, (-np.inf, np.inf))
    assert found.clipped
    assert found.gains[0].values == schedule.gains[0].values[0, -1]
    with pytest.raises(ValueError, match=r"dynamic_pressure \[Pa\] must be a number"):
        interpolate(schedule, (0.0, np.array([1.0, np.nan])))


@pytest.mark.parametrize("coordinates", [(), (1.0,), (1.0, 2.0, 3.0)])
def test_one_coordinate_an_axis(make_schedule, coordinates):
    with pytest.raises(ValueError, match="2 axes"):
        interpolate(make_schedule((4, 6)), coordinates)


def test_results_are_read_only(make_schedule):
    found = interpolate(make_schedule((4, 6)), (np.zeros(3), np.zeros(3)))
    with pytest.raises(ValueError, match="read-only"):
        found.gains[0].values[0] = 1.0


def by_pchip(axes, values, point):
    """The last axis first, each by scipy's own interpolant."""
    for axis, x in zip(reversed(axes), reversed(point), strict=True):
        values = values[..., 0] if len(axis.values) == 1 else PchipInterpolator(axis.values, values, axis=-1)(x)
    return values


@pytest.mark.parametrize("shape", [(7,), (2,), (3, 6), (4, 2), (1, 5), (3, 4, 5)])
def test_monotone_cubic_agrees_with_scipy(make_schedule, shape):
    schedule = replace(make_schedule(shape), rules=CUBIC)
    points = random_points(schedule, 40)
    inside = clip(schedule, points)
    found = interpolate(schedule, points)
    for gain, original in zip(found.gains, schedule.gains, strict=True):
        expected = [by_pchip(schedule.axes, original.values, point) for point in zip(*inside, strict=True)]
        scale = np.max(np.abs(original.values))
        np.testing.assert_allclose(gain.values, expected, rtol=1e-12, atol=1e-13 * scale)
    np.testing.assert_array_equal(found.clipped, interpolate(make_schedule(shape), points).clipped)


@pytest.mark.parametrize("shape", [(7,), (4, 6), (3, 4, 5), (1, 6), (1, 1)])
def test_monotone_cubic_has_the_nodes_and_is_single_points(make_schedule, shape):
    failed = [tuple(1 for _ in shape)] if min(shape) > 1 else []
    schedule = replace(make_schedule(shape, failed=failed), rules=CUBIC)
    for gain, original in zip(interpolate(schedule, nodes(schedule)).gains, schedule.gains, strict=True):
        np.testing.assert_array_equal(gain.values, original.values)
    points = random_points(schedule, 20)
    found = interpolate(schedule, points)
    for i, point in enumerate(zip(*points, strict=True)):
        for a, b in zip(interpolate(schedule, point).gains, found.take(i).gains, strict=True):
            np.testing.assert_array_equal(a.values, b.values)


def table_schedule(values, rules, breakpoints=None):
    axes = tuple(
        GridAxis(name, "m", tuple(map(float, range(n))) if breakpoints is None else breakpoints[k])
        for k, (name, n) in enumerate(zip(("a", "b"), values.shape, strict=False))
    )
    origin = Provenance("", "", "", "", "")
    gains = (Gain("K", "1", values),)
    return GainSchedule("one", "lqr", axes, gains, Outcomes.all_ok(values.shape), "u = -K x", origin, rules)


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=20, max_size=20),
    st.lists(st.floats(0.0, 3.0), min_size=8, max_size=8),
    st.lists(st.floats(0.0, 4.0), min_size=8, max_size=8),
)
def test_monotone_cubic_stays_within_its_cells_corners(values, a, b):
    table = np.array(values).reshape(4, 5)
    schedule = table_schedule(table, CUBIC)
    found = interpolate(schedule, (np.array(a), np.array(b))).gains[0].values
    for x, y, value in zip(a, b, found, strict=True):
        i, j = min(int(x), 2), min(int(y), 3)
        corners = table[i : i + 2, j : j + 2]
        slack = 1e-12 * np.max(np.abs(table))
        assert corners.min() - slack <= value <= corners.max() + slack


def test_monotone_cubic_is_smooth_and_monotone_along_an_axis():
    table = np.array([0.0, 0.1, 3.0, 3.05, 7.0])
    schedule = table_schedule(table, CUBIC)
    x = np.linspace(0.0, 4.0, 4001)
    values = interpolate(schedule, (x,)).gains[0].values
    assert np.all(np.diff(values) >= 0.0)
    # No kink: the jump of the slope goes with the step. A multilinear table's does not.
    kinks = np.max(np.abs(np.diff(values, 2))) / 1e-3
    straight = interpolate(table_schedule(table, ScheduleRules()), (x,)).gains[0].values
    assert kinks < 0.03 < 1.0 < np.max(np.abs(np.diff(straight, 2))) / 1e-3


def test_a_failed_point_spoils_two_intervals_of_a_monotone_cubic(make_schedule):
    schedule = replace(make_schedule((9,), failed=[(4,)]), rules=CUBIC)
    x = np.asarray(schedule.axes[0].values)
    middles = interpolate(schedule, (0.5 * (x[1:] + x[:-1]),)).gains[0].values
    assert np.isnan(middles).tolist() == [False, False, True, True, True, True, False, False]


def test_hold_marks_and_refuse_has_none(make_schedule):
    schedule = make_schedule((4, 6), failed=[(1, 2)])
    points = random_points(schedule, 200)
    clipped = interpolate(schedule, points)
    for interpolation in INTERPOLATIONS:
        plain = replace(schedule, rules=ScheduleRules(interpolation))
        clipped = interpolate(plain, points)
        outside = clipped.clipped
        assert not np.any(clipped.held | clipped.refused)
        held = interpolate(replace(plain, rules=ScheduleRules(interpolation, "hold")), points)
        np.testing.assert_array_equal(held.held, outside)
        np.testing.assert_array_equal(held.clipped, outside)
        refused = interpolate(replace(plain, rules=ScheduleRules(interpolation, "refuse")), points)
        np.testing.assert_array_equal(refused.refused, outside)
        assert not np.any(refused.clipped | refused.held | held.refused)
        for a, b, c in zip(clipped.gains, held.gains, refused.gains, strict=True):
            np.testing.assert_array_equal(a.values, b.values)
            np.testing.assert_array_equal(np.where(outside, np.nan, a.values), c.values)


@pytest.mark.parametrize("interpolation", list(INTERPOLATIONS))
@pytest.mark.parametrize("axis", [0, 1])
def test_node_slopes_are_one_sided_derivatives(make_schedule, interpolation, axis):
    schedule = replace(make_schedule((4, 6)), rules=ScheduleRules(interpolation))
    found, at = node_slopes(schedule, axis), nodes(schedule)
    for side, sign in enumerate((-1.0, 1.0)):
        steps = [np.array(x) for x in at]
        small = 1e-5 * (steps[axis].max() - steps[axis].min())
        twice = [np.array(x) for x in at]
        steps[axis] += sign * small
        twice[axis] += sign * 2.0 * small
        here, near, far = (interpolate(schedule, points).gains for points in (at, steps, twice))
        for slope, a, b, c in zip(found, here, near, far, strict=True):
            numeric = sign * (4.0 * b.values - 3.0 * a.values - c.values) / (2.0 * small)
            scale = np.max(np.abs(a.values)) / (small * 1e5)
            np.testing.assert_allclose(slope.values[..., side], numeric, rtol=1e-5, atol=1e-6 * scale)
    assert found[0].unit == f"{schedule.gains[0].unit} per {schedule.axes[axis].unit}"


def test_node_slopes_at_the_edges_and_beside_failed_points(make_schedule):
    schedule = make_schedule((4, 6), failed=[(1, 2)])
    for rule, edge in (("clip", 0.0), ("hold", 0.0), ("refuse", np.nan)):
        slope = node_slopes(replace(schedule, rules=ScheduleRules(out_of_range=rule)), 1)[0].values
        np.testing.assert_array_equal(slope[:, 0, 0], edge)
        np.testing.assert_array_equal(slope[:, -1, 1], edge)
        assert np.isnan(slope[1, 1, 1])
        assert np.isnan(slope[1, 3, 0])
        assert np.all(np.isnan(slope[1, 2]))
        assert np.all(np.isfinite(slope[[0, 2, 3], 1:-1]))
    alone = node_slopes(make_schedule((4, 1)), 1)[0].values
    np.testing.assert_array_equal(alone, 0.0)


def test_rules_that_there_are_not_are_refused():
    assert list(OUTS_OF_RANGE) == ["clip", "hold", "refuse"]
    assert list(INTEGRATOR_PLACEMENTS) == ["before_gain", "after_gain"]
    for wrong in ({"interpolation": "spline"}, {"out_of_range": "extrapolate"}, {"integrator_placement": "inside"}):
        with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be one of"):
            ScheduleRules(**wrong)
