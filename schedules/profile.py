"""A flight profile: altitude and one measure of speed over time, straight lines between its knots, held at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray
from model.flight import SPEED_UNITS, FlightCondition, SpeedAxis, flight_condition


class ProfileRefused(ValueError):
    """A profile that leaves the air, or the model of the section."""


@dataclass(frozen=True, eq=False)
class FlightProfile:
    """Altitude and speed over time.

    Attributes
    ----------
    times : (k,) knots, increasing from 0 [s]
    altitude : (k,) geopotential altitude [m]
    speed_axis : what `speed` is; the axis of a grid or another one
    speed : (k,) ``dynamic_pressure`` [Pa], ``airspeed`` [m/s] or ``mach``, positive
    temperature_offset : of the air over the whole profile [K]

    Raises
    ------
    ProfileRefused : arrays that do not fit, knots that do not increase from 0, numbers that are not finite, a speed
        that is not positive, an altitude outside the atmosphere
    """

    times: FloatArray
    altitude: FloatArray
    speed_axis: SpeedAxis
    speed: FloatArray
    temperature_offset: float = 0.0

    def __post_init__(self) -> None:
        for name in ("times", "altitude", "speed"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        arrays = self.times, self.altitude, self.speed
        if self.times.ndim != 1 or self.times.size == 0 or any(each.shape != self.times.shape for each in arrays):
            raise ProfileRefused("a profile needs as many altitudes and speeds as times, at least one")
        if not all(np.isfinite(each).all() for each in arrays):
            raise ProfileRefused("a profile holds numbers that are not finite")
        if self.times[0] != 0.0 or np.any(np.diff(self.times) <= 0.0):
            raise ProfileRefused("the times of a profile increase, from 0 s on")
        if self.speed_axis not in SPEED_UNITS:
            raise ProfileRefused(f"speed_axis must be one of {tuple(SPEED_UNITS)}, not {self.speed_axis!r}")
        self.condition(self.times)

    def condition(self, time: FloatArray) -> FlightCondition:
        """Air and speed (*T,) at some times (*T,) [s].

        Raises
        ------
        ProfileRefused : outside the atmosphere, or a speed that is not positive
        """
        altitude, speed = (np.interp(time, self.times, each) for each in (self.altitude, self.speed))
        try:
            return flight_condition(altitude, self.speed_axis, speed, self.temperature_offset)
        except ValueError as error:
            raise ProfileRefused(f"the profile cannot be flown: {error}") from error
