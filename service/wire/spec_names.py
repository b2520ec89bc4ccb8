"""Specs on the wire: ``phase_margin_deg_min`` is the quantity ``phase_margin``, in degrees, at least."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Literal

import numpy as np

from design.specs import QUANTITIES, Sense, Spec
from model.arrays import Floats

#: Unit inside -> unit on the wire, ending of the name, and its size in the unit inside.
_WIRE_UNITS = {
    "rad": ("deg", "_deg", radians(1.0)),
    "rad/s": ("deg/s", "_deg_s", radians(1.0)),
    "s": ("s", "_s", 1.0),
    "dB": ("dB", "_db", 1.0),
    "N m": ("N m", "_n_m", 1.0),
    "W": ("W", "_w", 1.0),
    "1": ("1", "", 1.0),
}
#: Quantities that are not in the wire unit of their kind: a frequency is no rate of an angle.
_OWN_UNITS = {"overshoot": ("%", "_percent", 0.01), "bandwidth": ("rad/s", "_rad_s", 1.0)}


@dataclass(frozen=True)
class SpecField:
    """One quantity with the way it binds, as the wire names it.

    An answer about a spec whose limit varies over the grid has the limit of a point where it speaks of that point
    (`limit_at`), and null where it speaks of the grid as a whole (`limit`).

    Attributes
    ----------
    name : field of a request, and the `spec` of a verdict
    unit : unit of its limit and values on the wire
    quantity, sense : of the `Spec`
    scale : one wire unit, in the unit of the quantity
    """

    name: str
    unit: str
    quantity: str
    sense: Sense
    scale: float

    def spec(self, limit: Floats, source: Literal["request", "spec_pack"] = "request") -> Spec:
        """The spec that asks for this limit, a number or (*G,), given in wire units."""
        return Spec(self.quantity, self.sense, limit * self.scale, source)

    def value(self, inside: float) -> float:
        """A value of the quantity, in wire units."""
        return inside / self.scale

    def limit(self, spec: Spec) -> float | None:
        """The limit as it was asked for; None when it varies over the grid."""
        return None if np.ndim(spec.limit) else self._as_asked(spec)

    def limit_at(self, spec: Spec, index: tuple[int, ...]) -> float:
        """The limit at a point of the grid, as it was asked for."""
        return self._as_asked(spec.take(index))

    def _as_asked(self, spec: Spec) -> float:
        """One limit: turning 30 degrees to radians and back must not leave 30.000000000000004."""
        return float(f"{self.value(float(spec.limit)):.12g}")


def spec_field(quantity: str, sense: Sense) -> SpecField:
    """The wire's name and unit of a spec."""
    unit, ending, scale = _OWN_UNITS.get(quantity) or _WIRE_UNITS[QUANTITIES[quantity]]
    return SpecField(f"{quantity}{ending}_{sense}", unit, quantity, sense, scale)


#: Every spec there can be, by its name on the wire.
SPEC_FIELDS: dict[str, SpecField] = {
    field.name: field for quantity in QUANTITIES for sense in ("min", "max") for field in (spec_field(quantity, sense),)
}
