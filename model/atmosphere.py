"""The International Standard Atmosphere (ISO 2533:1975, ICAO Doc 7488), with a temperature offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, Floats, GridArrays

#: Geopotential altitudes between which the atmosphere is given [m].
MIN_ALTITUDE = -2000.0
MAX_ALTITUDE = 32000.0

STANDARD_GRAVITY = 9.80665  # [m/s^2]
GAS_CONSTANT = 287.05287  # of dry air [J/(kg K)]
HEAT_CAPACITY_RATIO = 1.4
SEA_LEVEL_TEMPERATURE = 288.15  # [K]
SEA_LEVEL_PRESSURE = 101325.0  # [Pa]
SUTHERLAND_COEFFICIENT = 1.458e-6  # [kg/(m s K^0.5)]
SUTHERLAND_TEMPERATURE = 110.4  # [K]

# Layers, from below: base altitude [m] and temperature gradient [K/m].
_BASE_ALTITUDE = np.array([0.0, 11000.0, 20000.0])
_GRADIENT = np.array([-0.0065, 0.0, 0.001])


@dataclass(frozen=True, eq=False)
class Air(GridArrays):
    """State of the air, over the grid.

    Attributes
    ----------
    altitude : geopotential altitude (*G,) [m]
    temperature : (*G,) [K], offset included
    pressure : (*G,) [Pa]
    density : (*G,) [kg/m^3]
    speed_of_sound : (*G,) [m/s]
    dynamic_viscosity : (*G,) [Pa s]
    """

    altitude: FloatArray
    temperature: FloatArray
    pressure: FloatArray
    density: FloatArray
    speed_of_sound: FloatArray
    dynamic_viscosity: FloatArray


def standard_atmosphere(altitude: Floats, temperature_offset: Floats = 0.0) -> Air:
    """Air at geopotential altitudes of the standard atmosphere; arguments broadcast.

    The offset is added to the standard temperature and changes density, speed of sound and viscosity.
    The pressure stays the standard one: altitude is read as pressure altitude, as in flight practice.

    Parameters
    ----------
    altitude : geopotential altitude (*G,) [m], from `MIN_ALTITUDE` to `MAX_ALTITUDE`
    temperature_offset : (*G,) [K]

    Raises
    ------
    ValueError : altitude outside the model or not finite, or a temperature that is not positive
    """
    altitude, offset = np.broadcast_arrays(
        np.asarray(altitude, dtype=float), np.asarray(temperature_offset, dtype=float)
    )
    if not np.all((altitude >= MIN_ALTITUDE) & (altitude <= MAX_ALTITUDE)):
        raise ValueError(f"altitude must lie within {MIN_ALTITUDE:g} and {MAX_ALTITUDE:g} m (geopotential)")
    standard_temperature, pressure = _standard_column(altitude)
    temperature = standard_temperature + offset
    if not np.all((temperature > 0) & np.isfinite(temperature)):
        raise ValueError("temperature_offset [K] must leave a positive, finite absolute temperature")
    return Air(
        altitude=np.array(altitude),
        temperature=np.asarray(temperature),
        pressure=np.asarray(pressure),
        density=np.asarray(pressure / (GAS_CONSTANT * temperature)),
        speed_of_sound=np.sqrt(np.asarray(HEAT_CAPACITY_RATIO * GAS_CONSTANT * temperature)),
        dynamic_viscosity=np.asarray(
            SUTHERLAND_COEFFICIENT * temperature**1.5 / (temperature + SUTHERLAND_TEMPERATURE)
        ),
    )


def _standard_column(altitude: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Standard temperature [K] and pressure [Pa], each (*G,)."""
    layer = np.searchsorted(_BASE_ALTITUDE[1:], altitude, side="right")
    base_temperature = _BASE_TEMPERATURE[layer]
    climb = altitude - _BASE_ALTITUDE[layer]
    temperature = base_temperature + _GRADIENT[layer] * climb
    return temperature, _BASE_PRESSURE[layer] * np.exp(
        _log_pressure_ratio(climb, base_temperature, temperature, _GRADIENT[layer])
    )


def _log_pressure_ratio(
    climb: FloatArray, base_temperature: FloatArray, temperature: FloatArray, gradient: FloatArray
) -> FloatArray:
    """Hydrostatic ``ln(p / p_base)``: a power of the temperature ratio, or linear where T is constant."""
    isothermal = gradient == 0.0
    safe_gradient = np.where(isothermal, 1.0, gradient)
    per_kelvin = STANDARD_GRAVITY / GAS_CONSTANT
    polytropic = -per_kelvin / safe_gradient * np.log(temperature / base_temperature)
    return np.where(isothermal, -per_kelvin * climb / base_temperature, polytropic)


def _layer_bases() -> tuple[FloatArray, FloatArray]:
    """Temperature [K] and pressure [Pa] at the base of each layer, climbing from sea level."""
    thickness = np.diff(_BASE_ALTITUDE)
    temperature = SEA_LEVEL_TEMPERATURE + np.concatenate([[0.0], np.cumsum(_GRADIENT[:-1] * thickness)])
    steps = _log_pressure_ratio(thickness, temperature[:-1], temperature[1:], _GRADIENT[:-1])
    return temperature, SEA_LEVEL_PRESSURE * np.exp(np.concatenate([[0.0], np.cumsum(steps)]))


_BASE_TEMPERATURE, _BASE_PRESSURE = _layer_bases()
