import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from model.atmosphere import (
    GAS_CONSTANT,
    MAX_ALTITUDE,
    MIN_ALTITUDE,
    STANDARD_GRAVITY,
    standard_atmosphere,
)

ALTITUDES = st.floats(MIN_ALTITUDE, MAX_ALTITUDE)


@pytest.mark.parametrize("altitude", [-1500.0, 3000.0, 10990.0, 15000.0, 25000.0])
def test_pressure_balances_the_weight_of_the_air(altitude):
    step = 1.0
    above, here, below = (standard_atmosphere(altitude + d) for d in (step, 0.0, -step))
    gradient = (above.pressure - below.pressure) / (2 * step)
    assert gradient == pytest.approx(-here.density * STANDARD_GRAVITY, rel=1e-7)


@pytest.mark.parametrize("boundary", [0.0, 11000.0, 20000.0])
def test_layers_join_without_a_step(boundary):
    below, above = standard_atmosphere(np.nextafter(boundary, -np.inf)), standard_atmosphere(boundary)
    assert float(below.pressure) == pytest.approx(float(above.pressure), rel=1e-14)
    assert float(below.temperature) == pytest.approx(float(above.temperature), rel=1e-14)


@given(ALTITUDES, st.floats(-80.0, 80.0))
@settings(max_examples=60, deadline=None)
def test_offset_keeps_pressure_and_the_gas_law(altitude, offset):
    standard, warm = standard_atmosphere(altitude), standard_atmosphere(altitude, offset)
    assert warm.pressure == standard.pressure
    assert float(warm.temperature - standard.temperature) == pytest.approx(offset, abs=1e-12)
    assert float(warm.density * warm.temperature) == pytest.approx(
        float(standard.density * standard.temperature), rel=1e-14
    )
    assert float(warm.pressure) == pytest.approx(float(warm.density * GAS_CONSTANT * warm.temperature))


def test_warm_air_is_thinner_faster_for_sound_and_more_viscous():
    standard, warm = standard_atmosphere(0.0), standard_atmosphere(0.0, 20.0)
    assert warm.density < standard.density
    assert warm.speed_of_sound / standard.speed_of_sound == pytest.approx(np.sqrt(308.15 / 288.15), rel=1e-14)
    assert warm.dynamic_viscosity > standard.dynamic_viscosity


@pytest.mark.parametrize("altitude", [MIN_ALTITUDE - 1.0, MAX_ALTITUDE + 1.0, np.nan, np.inf, -np.inf])
def test_altitude_outside_the_model_is_refused(altitude):
    with pytest.raises(ValueError, match="altitude must lie within"):
        standard_atmosphere(np.array([0.0, altitude]))


@pytest.mark.parametrize("offset", [-300.0, np.nan, np.inf, -288.15])
def test_offset_that_leaves_no_temperature_is_refused(offset):
    with pytest.raises(ValueError, match="temperature_offset"):
        standard_atmosphere(0.0, offset)


def test_limits_themselves_are_inside():
    assert standard_atmosphere(np.array([MIN_ALTITUDE, MAX_ALTITUDE])).density.shape == (2,)


def test_arguments_broadcast():
    air = standard_atmosphere(np.linspace(0.0, 20000.0, 3)[:, None], np.array([-10.0, 0.0, 10.0, 20.0]))
    assert air.altitude.shape == air.density.shape == air.pressure.shape == (3, 4)
