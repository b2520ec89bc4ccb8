"""Specifications as data, and the verdict on each: value, limit and whether it is met, point by point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats, GridArrays

Sense = Literal["min", "max"]

#: What can be specified, and the unit it is kept in. Margins of several cuts mean the smallest of them. `gain_margin`
#: is the smaller of the two, raising and lowering; `noise_gain` the largest gain over all frequencies from noise on the
#: measured aileron angle to the commanded tab deflection; actuator quantities are peaks of totals after the
#: reference step.
QUANTITIES: dict[str, str] = {
    "damping_ratio": "1",
    "settling_time": "s",
    "overshoot": "1",
    "bandwidth": "rad/s",
    "gain_margin": "dB",
    "phase_margin": "rad",
    "delay_margin": "s",
    "disk_margin": "1",
    "sensitivity_peak": "1",
    "noise_gain": "1",
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

    The limit is one number, or varies over the grid, (*G,). `source` says who asked: the request's ``specs``, the
    named ``spec_pack``, or the actuator ``limits``. Only the request's specs steer a synthesis; the others are
    judged and reported.
    """

    quantity: str
    sense: Sense
    limit: Floats
    source: Literal["request", "spec_pack", "limits"] = "request"

    @property
    def scale(self) -> Floats:
        """What a distance from the limit is a part of: the limit's size, or 1 where it is zero."""
        size = np.abs(self.limit)
        return np.where(size > 0.0, size, 1.0) if isinstance(size, np.ndarray) else float(size or 1.0)

    def take(self, index: Any) -> Spec:
        """The same spec at some points of its grid."""
        if not isinstance(self.limit, np.ndarray):
            return self
        return replace(self, limit=np.asarray(self.limit[index], dtype=float))

    def tightened(self, part: Floats) -> Spec:
        """The same spec asked for more strictly, by a part of its limit; by a negative part, less."""
        return replace(self, limit=self.limit + (part if self.sense == "min" else -part) * np.abs(self.limit))

    def met(self, values: FloatArray, tolerance: float = 1e-9) -> BoolArray:
        """Mask of the values that meet the limit; a value that does not exist (nan) does not."""
        slack = tolerance * np.maximum(1.0, np.abs(self.limit))
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
    def distance(self) -> FloatArray:
        """How far inside its limit each value is (*G,), negative outside; nan where there is no value."""
        return self.spec.distance(self.values)

    @property
    def worst(self) -> int | None:
        """Flat index of the worst judged point (a missing value is worst of all); None when there is none.

        The worst is the least inside its limit, or the farthest outside, as a part of the limit.
        """
        if not np.any(self.judged):
            return None
        with np.errstate(over="ignore"):
            part = np.where(np.isnan(self.values), -np.inf, self.distance / self.spec.scale)
        return int(np.argmin(np.where(self.judged, part, np.inf)))


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
