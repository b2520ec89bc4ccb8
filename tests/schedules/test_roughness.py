"""Roughness: what a table would get wrong at a line that were left out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.gains import Gain
from model.flight import GridAxis
from schedules.interpolate import interpolate
from schedules.roughness import roughness

X, Y = (0.0, 1.0, 4.0, 5.5), (10.0, 11.0, 15.0, 16.0, 30.0)
AXES = (GridAxis("altitude", "m", X), GridAxis("dynamic_pressure", "Pa", Y))
x, y = np.meshgrid(X, Y, indexing="ij")


def test_a_multilinear_table_has_none():
    found = roughness(3.0 - 0.2 * x + 0.05 * y + 0.07 * x * y, AXES)
    assert found.worst < 1e-14
    assert found.rms < 1e-14
    assert [axis.axis for axis in found.axes] == ["altitude", "dynamic_pressure"]


def test_a_quadratic_is_off_by_its_closed_form():
    """Divided differences: interpolated less own is ``h_1 h_2 g'' / 2``, whatever the steps."""
    g = 5.0 + 0.3 * x**2 + 0.02 * y**2
    found = roughness(g, AXES)
    for axis, line, second in zip(found.axes, (X, Y), (0.6, 0.04), strict=True):
        step = np.diff(line)
        off = 0.5 * second * step[:-1] * step[1:]
        k = 0 if axis.axis == "altitude" else 1
        own = np.moveaxis(g, k, -1)
        errors = np.moveaxis(axis.errors, k, -1)
        np.testing.assert_allclose(errors[..., 1:-1], off / own[..., 1:-1], rtol=1e-12)
        assert np.isnan(errors[..., [0, -1]]).all()


@pytest.mark.parametrize("kind", ["negative_feedback", "lqr"])
def test_it_is_the_error_of_the_table_without_the_line(make_schedule, kind):
    """The product's own interpolation, in a schedule from which the line has been taken."""
    schedule = make_schedule((4, 5), kind)
    gains = tuple(Gain(g.name, g.unit, np.abs(g.values) + 0.2 * np.abs(g.values).max()) for g in schedule.gains)
    for k, axis in enumerate(schedule.axes):
        for i in range(1, len(axis.values) - 1):
            axes = list(schedule.axes)
            axes[k] = replace(axis, values=tuple(np.delete(axis.values, i)))
            without = replace(
                schedule,
                axes=tuple(axes),
                gains=tuple(Gain(g.name, g.unit, np.delete(g.values, i, axis=k)) for g in gains),
                outcomes=schedule.outcomes.take(np.ix_(*(range(len(a.values)) for a in axes))),
            )
            at = [a.values for a in schedule.axes]
            at[k] = (axis.values[i],)
            there = interpolate(without, np.meshgrid(*at, indexing="ij"))
            for gain, other in zip(gains, there.gains, strict=True):
                own = np.take(gain.values, [i], axis=k)
                errors = np.take(roughness(gain.values, schedule.axes).axes[k].errors, [i], axis=k)
                np.testing.assert_allclose(errors, other.values / own - 1.0, rtol=1e-11, atol=1e-13)


def test_worst_and_rms_are_those_of_all_errors():
    rng = np.random.default_rng(1)
    found = roughness(rng.uniform(0.5, 2.0, x.shape), AXES)
    everything = [axis.errors[np.isfinite(axis.errors)] for axis in found.axes]
    for axis, errors in zip(found.axes, everything, strict=True):
        assert axis.worst == np.max(np.abs(errors)) == np.abs(axis.errors.flat[axis.point])
        assert axis.rms == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-14)
    assert found.worst == max(axis.worst for axis in found.axes)
    assert found.point == max(found.axes, key=lambda axis: axis.worst).point
    assert found.rms == pytest.approx(np.sqrt(np.mean(np.concatenate(everything) ** 2)), rel=1e-14)


def test_a_missing_gain_spoils_only_the_triples_it_is_in():
    g = 1.0 + x**2 + y
    whole, holed = g.copy(), g.copy()
    holed[2, 2] = np.nan
    for one, other, k in zip(roughness(whole, AXES).axes, roughness(holed, AXES).axes, (0, 1), strict=True):
        index = np.argwhere(np.isfinite(one.errors))
        for i in map(tuple, index):
            beside = i[1 - k] == 2 and abs(i[k] - 2) <= 1
            assert np.isnan(other.errors[i]) if beside else other.errors[i] == one.errors[i]


def test_axes_of_two_breakpoints_have_none():
    short = (replace(AXES[0], values=(0.0, 1.0)), AXES[1])
    assert [axis.axis for axis in roughness(np.ones((2, 5)), short).axes] == ["dynamic_pressure"]
    found = roughness(np.ones((2, 2)), (short[0], short[0]))
    assert (found.worst, found.point, found.rms) == (None, None, None)
    empty = roughness(np.full((4, 5), np.nan), AXES)
    assert (empty.worst, empty.point, empty.rms) == (None, None, None)


def test_a_gain_that_passes_through_zero_is_measured_by_its_neighbours():
    line = (GridAxis("mach", "1", (0.0, 1.0, 2.0)),)
    assert roughness(np.array([-1.0, 0.0, 1.0]), line).worst == 0.0
    assert roughness(np.array([-1.0, 0.02, 1.0]), line).worst == pytest.approx(0.2)
    assert roughness(np.zeros(3), line).worst == 0.0


def test_axes_of_another_grid_are_refused():
    with pytest.raises(ValueError, match=r"shape \(5, 4\).*\[4, 5\]"):
        roughness(np.ones((5, 4)), AXES)


@given(st.floats(1e-6, 1e6), st.booleans())
def test_the_unit_of_a_gain_and_the_direction_of_an_axis_do_not_matter(scale, turned):
    g = np.sqrt(1.0 + x) / y
    one, other = roughness(g, AXES), roughness(scale * g, AXES)
    if turned:
        axes = tuple(replace(axis, values=tuple(-np.array(axis.values)[::-1])) for axis in AXES)
        other = roughness(scale * g[::-1, ::-1], axes)
    assert other.worst == pytest.approx(one.worst, rel=1e-10)
    assert other.rms == pytest.approx(one.rms, rel=1e-10)


def test_works_for_state_feedback(wind_tunnel_envelope):
    """Two altitudes, four dynamic pressures: rough along the second axis only."""
    for controller in wind_tunnel_envelope.controllers:
        for gain in controller.gains:
            found = roughness(gain.values, wind_tunnel_envelope.plant.grid.axes)
            assert [axis.axis for axis in found.axes] == ["dynamic_pressure"]
            assert np.isfinite(found.axes[0].errors[:, 1:-1]).all()
            assert found.rms <= found.worst
