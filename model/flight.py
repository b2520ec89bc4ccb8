"""Flight conditions, and the grid of them that a schedule is designed on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.arrays import FloatArray, Floats, GridArrays
from model.atmosphere import Air, standard_atmosphere

#: What the second axis of a grid may be; altitude is always the first.
SpeedAxis = Literal["dynamic_pressure", "airspeed", "mach"]


@dataclass(frozen=True, eq=False)
class FlightCondition(GridArrays):
    """Air and speed, over the grid.

    Attributes
    ----------
    air : the atmosphere there
    airspeed : true airspeed V (*G,) [m/s]
    dynamic_pressure : q = rho V^2 / 2 (*G,) [Pa]
    mach : V / a (*G,) [-]
    """

    air: Air
    airspeed: FloatArray
    dynamic_pressure: FloatArray
    mach: FloatArray


@dataclass(frozen=True)
class GridAxis:
    """One axis of the grid: its name, its unit and its strictly increasing breakpoints."""

    name: str
    unit: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class FlightGrid:
    """Altitude by speed: the axes, and the condition at every point of shape ``(nh, nv)``."""

    axes: tuple[GridAxis, GridAxis]
    condition: FlightCondition

    @property
    def shape(self) -> tuple[int, ...]:
        """Grid shape ``(nh, nv)``."""
        return tuple(len(axis.values) for axis in self.axes)


SPEED_UNITS: dict[SpeedAxis, str] = {"dynamic_pressure": "Pa", "airspeed": "m/s", "mach": "1"}


def flight_condition(
    altitude: Floats, speed_axis: SpeedAxis, speed: Floats, temperature_offset: Floats = 0.0
) -> FlightCondition:
    """Flight condition from geopotential altitude [m] and one measure of speed; arguments broadcast.

    Parameters
    ----------
    altitude : geopotential altitude [m]
    speed_axis : which quantity `speed` is: ``dynamic_pressure`` [Pa], ``airspeed`` [m/s] or ``mach``
    speed : its value, positive
    temperature_offset : added to the standard temperature at every altitude [K]

    Raises
    ------
    ValueError : altitude outside the atmosphere, or a speed that is not positive
    """
    if speed_axis not in SPEED_UNITS:
        raise ValueError(f"speed_axis must be one of {tuple(SPEED_UNITS)}, not {speed_axis!r}")
    altitude, speed, offset = np.broadcast_arrays(
        *(np.asarray(x, float) for x in (altitude, speed, temperature_offset))
    )
    if not np.all((speed > 0) & np.isfinite(speed)):
        raise ValueError(f"{speed_axis} must be positive and finite [{SPEED_UNITS[speed_axis]}]")
    air = standard_atmosphere(altitude, offset)
    if speed_axis == "dynamic_pressure":
        airspeed = np.sqrt(2.0 * speed / air.density)
    elif speed_axis == "airspeed":
        airspeed = np.array(speed)
    else:
        airspeed = speed * air.speed_of_sound
    # A quantity given as an axis stays exactly the number given.
    q = speed if speed_axis == "dynamic_pressure" else 0.5 * air.density * airspeed**2
    mach = speed if speed_axis == "mach" else airspeed / air.speed_of_sound
    return FlightCondition(air, np.asarray(airspeed), np.array(q), np.array(mach))


def flight_grid(
    altitude: FloatArray,
    speed_axis: SpeedAxis,
    speed: FloatArray,
    temperature_offset: float = 0.0,
) -> FlightGrid:
    """Grid of altitude [m] by speed, both strictly increasing, at least one value each.

    Raises
    ------
    ValueError : an axis is empty or not strictly increasing, or `flight_condition` refuses it
    """
    altitude, speed = np.atleast_1d(np.asarray(altitude, float), np.asarray(speed, float))
    for name, values in (("altitude", altitude), (speed_axis, speed)):
        if values.size == 0 or np.any(np.diff(values) <= 0):
            raise ValueError(f"{name} breakpoints must be strictly increasing, at least one of them")
    condition = flight_condition(altitude[:, None], speed_axis, speed[None, :], temperature_offset)
    axes = (
        GridAxis("altitude", "m", tuple(altitude.tolist())),
        GridAxis(speed_axis, SPEED_UNITS[speed_axis], tuple(speed.tolist())),
    )
    return FlightGrid(axes, condition)
