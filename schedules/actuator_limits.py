"""Limits of one actuator against what a design asks of it for the reference step: what holds, and what breaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.response.demand import ActuatorDemand
from model.actuators import ActuatorLimits
from model.arrays import BoolArray, FloatArray
from schedules.designed import DesignedController

#: What can be limited, in the order in which it is reported.
LIMITABLE = ("deflection", "rate", "torque", "power")
#: A limit is met up to this part of it.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Limited:
    """The limits that are given.

    Attributes
    ----------
    actuator : ``tab`` or ``aileron``
    names : what is limited, of `LIMITABLE` (k)
    values : the limits (k,) [rad], [rad/s], [N m], [W]
    """

    actuator: str
    names: tuple[str, ...]
    values: FloatArray

    @classmethod
    def of(cls, actuator: str, limits: ActuatorLimits) -> Limited:
        """The limits of an actuator.

        Raises
        ------
        ValueError : none is given, or one is not positive and finite
        """
        names = tuple(name for name in LIMITABLE if getattr(limits, name) is not None)
        values = np.array([getattr(limits, name) for name in names], dtype=float)
        if not names or not np.all((values > 0.0) & np.isfinite(values)):
            raise ValueError(f"an actuator needs limits that are positive and finite, one at least, not {limits}")
        return cls(actuator, names, values)

    def peaks(self, demand: ActuatorDemand) -> FloatArray:
        """(*G, k) peaks of what is limited."""
        return np.stack([getattr(demand, f"peak_{name}") for name in self.names], axis=-1)

    def peaks_of(self, designed: DesignedController) -> FloatArray:
        """(*G, k) peaks that a design asks for; nan where there is no design."""
        found = designed.assessment
        if found is None:
            return np.full((*designed.outcomes.ok.shape, len(self.names)), np.nan)
        return self.peaks(found.demand[found.actuators.index(self.actuator)])

    def used(self, peaks: FloatArray) -> FloatArray:
        """(*G,) largest part of a limit that peaks (*G, k) ask for; inf where one is not known or has no bound."""
        with np.errstate(over="ignore"):
            parts = np.minimum(peaks / self.values, np.finfo(float).max)
        return np.asarray(np.max(np.where(np.isfinite(peaks), parts, np.inf), axis=-1))

    def met(self, peaks: FloatArray) -> BoolArray:
        """(*G,) whether peaks (*G, k) are within all limits."""
        return np.asarray(self.used(peaks) <= 1.0 + ROUNDING)

    def said(self, peaks: FloatArray) -> str:
        """What is not within its limit of peaks (k,), in words, angles in degrees."""
        broken = [i for i, value in enumerate(peaks) if value > self.values[i] * (1.0 + ROUNDING)]
        return ", ".join(
            f"{self.names[i]} {_in_words(self.names[i], peaks[i])} of {_in_words(self.names[i], self.values[i])}"
            for i in broken
        )


def _in_words(name: str, value: float) -> str:
    unit = {"deflection": "deg", "rate": "deg/s", "torque": "N m", "power": "W"}[name]
    return f"{np.rad2deg(value) if unit.startswith('deg') else value:.4g} {unit}"
