import numpy as np
import pytest

from model.flight import flight_condition, flight_grid

SPEEDS = {"dynamic_pressure": 980.0, "airspeed": 40.0, "mach": 0.2}


@pytest.mark.parametrize("axis", SPEEDS)
def test_the_three_measures_of_speed_agree(axis):
    c = flight_condition(np.array([0.0, 5000.0, 12000.0]), axis, SPEEDS[axis])
    np.testing.assert_allclose(c.dynamic_pressure, 0.5 * c.air.density * c.airspeed**2, rtol=1e-14)
    np.testing.assert_allclose(c.mach, c.airspeed / c.air.speed_of_sound, rtol=1e-14)
    quantity = {"dynamic_pressure": c.dynamic_pressure, "airspeed": c.airspeed, "mach": c.mach}[axis]
    np.testing.assert_array_equal(quantity, np.full(3, SPEEDS[axis]))


@pytest.mark.parametrize("axis", SPEEDS)
def test_one_axis_leads_back_to_the_others(axis):
    c = flight_condition(3000.0, axis, SPEEDS[axis])
    for other in SPEEDS:
        value = {"dynamic_pressure": c.dynamic_pressure, "airspeed": c.airspeed, "mach": c.mach}[other]
        again = flight_condition(3000.0, other, value)
        assert float(again.airspeed) == pytest.approx(float(c.airspeed), rel=1e-14)


def test_temperature_offset_broadcasts_with_the_rest():
    c = flight_condition(1000.0, "airspeed", 50.0, np.array([-20.0, 0.0, 20.0]))
    assert c.airspeed.shape == c.dynamic_pressure.shape == c.mach.shape == (3,)
    assert np.all(np.diff(c.dynamic_pressure) < 0)


def test_a_single_point_is_made_of_arrays():
    c = flight_condition(0.0, "mach", 0.3)
    for value in (c.airspeed, c.dynamic_pressure, c.mach, c.air.density):
        assert isinstance(value, np.ndarray)
        assert value.shape == ()


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_speed_must_be_positive_and_finite(speed):
    with pytest.raises(ValueError, match="airspeed must be positive"):
        flight_condition(0.0, "airspeed", speed)


def test_unknown_axis_is_refused():
    with pytest.raises(ValueError, match="speed_axis"):
        flight_condition(0.0, "knots", 100.0)


def test_grid_is_altitude_by_speed():
    grid = flight_grid(np.array([0.0, 3000.0]), "dynamic_pressure", np.array([245.0, 551.25, 980.0]))
    assert grid.shape == (2, 3) == grid.condition.airspeed.shape
    assert grid.axes[0].values == (0.0, 3000.0)
    assert (grid.axes[0].unit, grid.axes[1].unit) == ("m", "Pa")
    np.testing.assert_array_equal(grid.condition.air.altitude[1], np.full(3, 3000.0))
    np.testing.assert_array_equal(grid.condition.dynamic_pressure[0], [245.0, 551.25, 980.0])


@pytest.mark.parametrize("speeds", [[], [2.0, 1.0], [1.0, 1.0], [1.0, np.nan]])
def test_grid_axes_must_increase(speeds):
    with pytest.raises(ValueError, match=r"increasing|positive"):
        flight_grid(np.array([0.0]), "mach", np.array(speeds))
