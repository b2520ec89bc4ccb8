"""Specifications as data, and the verdict on each: value, limit and whether it is met, point by point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays

Sense = Literal["min", "max"]

#: What can be specified, and the unit it is kept in. Margins of several cuts mean the smallest of them.
QUANTITIES: dict[str, str] = {
    "damping_ratio": "1",
    "settling_time": "s",
    "overshoot": "1",
    "gain_margin": "dB",
    "phase_margin": "rad",
    "disk_margin": "1",
    "sensitivity_peak": "1",
    "tab_deflection": "rad",
    "tab_rate": "rad/s",
    "tab_torque": "N m",
    "tab_power": "W",
    "aileron_deflection": "rad",
    "aileron_rate": "rad/s",
    "aileron_torque": "N m",
    "aileron_power": "W",
}


@dataclass(frozen=True)
class Spec:
    """One specification: a quantity of `QUANTITIES`, its limit in that unit, and which way it binds.

    `source` says who asked: the request's ``specs``, the named ``spec_pack``, or the actuator ``limits``.
    Only the request's specs steer a synthesis; the others are judged and reported.
    """

    quantity: str
    sense: Sense
    limit: float
    source: Literal["request", "spec_pack", "limits"] = "request"

    def met(self, values: FloatArray, tolerance: float = 1e-9) -> BoolArray:
        """Mask of the values that meet the limit; a value that does not exist (nan) does not."""
        slack = tolerance * max(1.0, abs(self.limit))
        with np.errstate(invalid="ignore"):
            if self.sense == "min":
                return np.asarray(values >= self.limit - slack)
            return np.asarray(values <= self.limit + slack)

    def distance(self, values: FloatArray) -> FloatArray:
        """How far inside the limit each value is, in the quantity's unit; negative outside."""
        return values - self.limit if self.sense == "min" else self.limit - values


@dataclass(frozen=True, eq=False)
class Verdict(GridArrays):
    """A spec judged over the grid.

    Attributes
    ----------
    spec : what was judged
    values : (*G,) achieved value; nan where the point carries no design or the value does not exist
    judged : (*G,) mask of the points that carry a design
    passed : (*G,) bool, False where not judged
    """

    spec: Spec
    values: FloatArray
    judged: BoolArray
    passed: BoolArray

    @property
    def worst(self) -> int | None:
        """Flat index of the worst judged point (a missing value is worst of all); None when there is none."""
        if not np.any(self.judged):
            return None
        distance = np.where(np.isnan(self.values), -np.inf, self.spec.distance(self.values))
        return int(np.argmin(np.where(self.judged, distance, np.inf)))


#: Named packs. Values are numbers to meet, not a claim of compliance with a standard.
SPEC_PACKS: dict[str, tuple[Spec, ...]] = {
    "default": (
        Spec("gain_margin", "min", 6.0, "spec_pack"),
        Spec("phase_margin", "min", np.deg2rad(45.0), "spec_pack"),
        Spec("disk_margin", "min", 0.667, "spec_pack"),
        Spec("damping_ratio", "min", 0.4, "spec_pack"),
        Spec("sensitivity_peak", "max", 1.78, "spec_pack"),
    ),
    # MIL-F-9490D table III as remembered; not confirmed against the document.
    "limit_speed": (
        Spec("gain_margin", "min", 4.5, "spec_pack"),
        Spec("phase_margin", "min", np.deg2rad(30.0), "spec_pack"),
    ),
}
