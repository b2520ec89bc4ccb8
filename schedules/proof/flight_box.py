"""A part of the envelope, and what bounds the plant's terms in it.

Over a box of altitude h and speed s each term of the plant is a power of s times factors that depend on the air alone,

=================== =================== ==================== ===========
speed axis          Q / f               D / f                V
=================== =================== ==================== ===========
dynamic_pressure    s                   sqrt(rho/2) s^(1/2)  sqrt(2/rho) s^(1/2)
airspeed            (rho/2) s^2         (rho/2) s            s
mach                (gamma p/2) s^2     (rho a/2) s          a s
=================== =================== ==================== ===========

and each factor, the compressibility factor f among them, lies in an interval. Factors are let go anywhere in their
intervals, whatever h: that only enlarges the set. Control values of a power of s over [s1, s2] are its Bernstein
coefficients, or for the square root those of the chord below it and of the tangent at ``sqrt(s1 s2)`` above it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, Floats
from model.atmosphere import HEAT_CAPACITY_RATIO, standard_atmosphere
from model.flight import FlightCondition, SpeedAxis, flight_condition
from model.system import TabAileron
from schedules.proof.plant_terms import term_values

#: Power of the speed coordinate in each term.
EXPONENTS: dict[SpeedAxis, dict[str, float]] = {
    "dynamic_pressure": {"1": 0.0, "Q": 1.0, "D": 0.5, "V": 0.5},
    "airspeed": {"1": 0.0, "Q": 2.0, "D": 1.0, "V": 1.0},
    "mach": {"1": 0.0, "Q": 2.0, "D": 1.0, "V": 1.0},
}
#: Altitudes between which every quantity of the air is monotone: the layers of the atmosphere [m].
_LAYERS = (0.0, 11000.0, 20000.0)


@dataclass(frozen=True)
class Box:
    """Altitudes [m] and speeds (in the axis's unit) of a part of one cell, each from the lower to the upper."""

    altitude: tuple[float, float]
    speed: tuple[float, float]

    def halves(self, axis: int) -> tuple[Box, Box]:
        """Lower and upper half by altitude (0) or speed (1)."""
        if axis == 0:
            low, high = self.altitude
            middle = 0.5 * (low + high)
            return Box((low, middle), self.speed), Box((middle, high), self.speed)
        low, high = self.speed
        middle = 0.5 * (low + high)
        return Box(self.altitude, (low, middle)), Box(self.altitude, (middle, high))


@dataclass(frozen=True)
class Factor:
    """A factor of the plant's terms over a box: which terms it multiplies, and the interval it lies in.

    Attributes
    ----------
    terms : names of the terms; those that share a factor move together
    low, high : ends of the interval, positive
    """

    terms: tuple[str, ...]
    low: float
    high: float


@dataclass(frozen=True)
class Flight:
    """What turns altitude and speed into the plant's terms.

    Attributes
    ----------
    system : section and aerodynamics
    speed_axis : what the speed coordinate is
    temperature_offset : [K]
    """

    system: TabAileron
    speed_axis: SpeedAxis
    temperature_offset: float

    def condition(self, altitude: Floats, speed: Floats) -> FlightCondition:
        """Flight condition at altitude [m] and speed; they broadcast."""
        return flight_condition(altitude, self.speed_axis, speed, self.temperature_offset)

    def terms(self, altitude: Floats, speed: Floats, names: tuple[str, ...]) -> FloatArray:
        """Exact values (*G, J) of the terms."""
        values = term_values(self.system, self.condition(altitude, speed))
        return np.concatenate([np.ones((*values.shape[:-1], 1)), values], axis=-1)[..., : len(names)]

    def factors(
        self, box: Box, names: tuple[str, ...], reading: tuple[float, float] = (1.0, 1.0)
    ) -> tuple[Factor, ...]:
        """Factors over a box, for speeds read there and truly `reading` times as large.

        Parameters
        ----------
        reading : interval of true speed by the speed read, positive
        """
        air, exponents = self._air(box.altitude), EXPONENTS[self.speed_axis]
        if self.speed_axis == "dynamic_pressure":
            by_air = {"Q": (1.0, 1.0), "D": air["root_half_density"], "V": air["inverse_root_half_density"]}
        elif self.speed_axis == "airspeed":
            by_air = {"Q": air["half_density"], "D": air["half_density"], "V": (1.0, 1.0)}
        else:
            by_air = {"Q": air["half_gamma_pressure"], "D": air["half_density_sound"], "V": air["sound"]}
        exact = reading == (1.0, 1.0)
        if self.speed_axis == "airspeed" and exact:
            found = [Factor(("Q", "D"), *by_air["Q"]), Factor(("V",), *by_air["V"])]
        else:
            found = [
                Factor((name,), *(end * ratio ** exponents[name] for end, ratio in zip(ends, reading, strict=True)))
                for name, ends in by_air.items()
            ]
        if self.system.aerodynamics.compressibility != "none":
            found.append(Factor(("Q", "D"), *self._amplification(box, reading, air)))
        return tuple(f for f in found if set(f.terms) & set(names))

    def _air(self, altitude: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """Intervals of what depends on the altitude alone: all are monotone within a layer."""
        low, high = altitude
        ends = np.array([low, high, *(h for h in _LAYERS if low < h < high)])
        air = standard_atmosphere(ends, self.temperature_offset)
        of = {
            "root_half_density": np.sqrt(0.5 * air.density),
            "inverse_root_half_density": np.sqrt(2.0 / air.density),
            "half_density": 0.5 * air.density,
            "half_gamma_pressure": 0.5 * HEAT_CAPACITY_RATIO * air.pressure,
            "half_density_sound": 0.5 * air.density * air.speed_of_sound,
            "sound": air.speed_of_sound,
        }
        return {name: (float(np.min(values)), float(np.max(values))) for name, values in of.items()}

    def within_model(self, box: Box, reading: tuple[float, float] = (1.0, 1.0)) -> bool:
        """Whether the aerodynamics cover every Mach number of a box."""
        mach = self._mach(box, reading, self._air(box.altitude))
        return bool(np.all(self.system.aerodynamics.covers(mach)))

    def _amplification(
        self, box: Box, reading: tuple[float, float], air: dict[str, tuple[float, float]]
    ) -> tuple[float, float]:
        """Interval of the compressibility factor, which rises with the Mach number.

        Raises
        ------
        ValueError : Mach one is reached
        """
        ends = self.system.aerodynamics.amplification(self._mach(box, reading, air))
        return float(ends[0]), float(ends[1])

    def _mach(self, box: Box, reading: tuple[float, float], air: dict[str, tuple[float, float]]) -> FloatArray:
        """Interval (2,) of the Mach number."""
        slow, fast = (speed * ratio for speed, ratio in zip(box.speed, reading, strict=True))
        if self.speed_axis == "dynamic_pressure":  # q = gamma p M^2 / 2
            low, high = air["half_gamma_pressure"]
            return np.asarray(np.sqrt([slow / high, fast / low]))
        low, high = air["sound"] if self.speed_axis == "airspeed" else (1.0, 1.0)
        return np.array([slow / high, fast / low])


def power_controls(exponent: float, low: float, high: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Bernstein coefficients of something below and of something above ``s**exponent`` over [low, high].

    Both are the power itself but for the square root, whose chord and tangent they are.
    """
    if exponent == 0.5:
        middle = np.sqrt(np.sqrt(low * high))
        chord = (float(np.sqrt(low)), float(np.sqrt(high)))
        tangent = (float(0.5 * (middle + low / middle)), float(0.5 * (middle + high / middle)))
        return chord, tangent
    exact = {0.0: (1.0,), 1.0: (low, high), 2.0: (low * low, low * high, high * high)}[exponent]
    return exact, exact
