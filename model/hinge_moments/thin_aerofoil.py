"""Hinge moments by thin-aerofoil theory: steady, incompressible, linear in the angles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats
from model.hinge_moments.camber import SYMMETRIC, MeanLine
from model.hinge_moments.closed_forms import (
    between_surfaces,
    flap_moment,
    incidence_moment,
    parabola_moment,
    ramp_moment,
)
from model.hinge_moments.expansion import HingeMoments, every_angle
from model.hinge_moments.pressure import (
    flap_pressure,
    incidence_pressure,
    parabola_pressure,
    ramp_pressure,
)

#: Which deflection is positive: trailing edge up (seed Fig 2.2), or down as in the classical literature.
PositiveDeflection = Literal["te_up", "te_down"]


@dataclass(frozen=True)
class ThinAerofoil:
    """Source of hinge moments from the section's mean line and its two hinges.

    With deflections positive trailing edge up, an incidence floats the surfaces up and its coefficients
    are negative; ``te_down`` changes the sign of ``C_H`` at zero deflection and of ``C_H,alpha`` and
    leaves the four deflection derivatives, because moment and angle turn together. Torques follow the
    angles: with ``te_down`` a positive torque drives the trailing edge down.

    Attributes
    ----------
    aileron_hinge, tab_hinge : fractions of the wing chord, scalars or (*H,), 0 < aileron < tab < 1
    mean_line : camber of the section; it sits on the undeflected section
    positive : which deflection is positive

    Raises
    ------
    ValueError : hinges out of order or outside the chord, or an unknown `positive`
    """

    aileron_hinge: Floats
    tab_hinge: Floats
    mean_line: MeanLine = SYMMETRIC
    positive: PositiveDeflection = "te_up"

    def __post_init__(self) -> None:
        aileron, tab = np.asarray(self.aileron_hinge), np.asarray(self.tab_hinge)
        if not np.all((aileron > 0) & (aileron < tab) & (tab < 1)):
            raise ValueError("hinges must satisfy 0 < aileron_hinge < tab_hinge < 1 (fractions of chord)")
        if self.positive not in ("te_up", "te_down"):
            raise ValueError(f"positive must be 'te_up' or 'te_down', not {self.positive!r}")

    @cached_property
    def offset(self) -> FloatArray:
        """``C_H`` at zero incidence and deflection (*H, 2), order [tab, aileron] [-]."""
        return self._turn * camber_moment(self.mean_line, self._hinges)

    @cached_property
    def gradient(self) -> FloatArray:
        """Derivatives (*H, 2, 3), rows [tab, aileron], columns d/d(alpha, dt, da) [1/rad]."""
        incidence = self._turn * incidence_moment(self._hinges)
        deflection = between_surfaces(flap_moment, self.aileron_hinge, self.tab_hinge)
        return np.concatenate([incidence[..., None], deflection], axis=-1)

    def at(self, alpha: Floats, dt: Floats, da: Floats) -> HingeMoments:
        """Coefficients and gradient at incidence and deflections [rad]; see `HingeMomentSource.at`."""
        angles = np.stack(np.broadcast_arrays(*(np.asarray(x, float) for x in (alpha, dt, da))), axis=-1)
        value = self.offset + np.sum(self.gradient * angles[..., None, :], axis=-1)
        return HingeMoments(value, np.broadcast_to(self.gradient, (*value.shape[:-1], 2, 3)))

    def covers(self, alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
        """Every angle (*G,): the theory is linear and knows no stall; see `HingeMomentSource.covers`."""
        return every_angle(alpha, dt, da)

    @property
    def domain(self) -> str:
        """Every angle."""
        return "every angle"

    def pressure_difference(self, x: FloatArray, alpha: Floats, dt: Floats, da: Floats) -> FloatArray:
        """``Cp_lower - Cp_upper`` along the chord, camber included (seed Fig 2.3).

        The moment of this load about a hinge is minus ``C_H`` there (``te_up``; plus for ``te_down``).

        Parameters
        ----------
        x : positions (n,) as fractions of the chord, in (0, 1], away from both hinges
        alpha, dt, da : incidence and deflections (*G,) [rad]; hinge arrays broadcast with them

        Returns
        -------
        (*G, n) array [-]

        Raises
        ------
        ValueError : a position outside (0, 1], or where the linear theory is infinite: leading edge, hinges
        """
        x = np.asarray(x, float)
        if not np.all((x > 0) & (x <= 1)):
            raise ValueError("chord positions must lie in (0, 1]: the load is infinite at the leading edge")
        hinges = self._hinges[..., None]
        if np.any(np.abs(x - hinges) < 1e-12):
            raise ValueError("the load is infinite at a hinge: choose chord positions beside it")
        alpha, dt, da = (np.asarray(v, float)[..., None] for v in (alpha, dt, da))
        flaps = flap_pressure(x, hinges)
        deflection = self._turn * (flaps[..., 0, :] * dt + flaps[..., 1, :] * da)
        return np.asarray(camber_pressure(self.mean_line, x) + incidence_pressure(x) * alpha + deflection)

    @property
    def _turn(self) -> float:
        """Trailing-edge-down angle of a unit positive deflection."""
        return -1.0 if self.positive == "te_up" else 1.0

    @property
    def _hinges(self) -> FloatArray:
        hinges = np.broadcast_arrays(np.asarray(self.tab_hinge, float), np.asarray(self.aileron_hinge, float))
        return np.stack(hinges, axis=-1)


def camber_moment(line: MeanLine, hinge: Floats) -> FloatArray:
    """Load moment at `hinge` (*X,) of the mean line at zero incidence, signed as in `closed_forms.py` [-]."""
    moment = line.incidence * incidence_moment(hinge)
    for bend in line.ramps:
        moment = moment + bend.weight * ramp_moment(hinge, bend.start)
    for bend in line.parabolas:
        moment = moment + bend.weight * parabola_moment(hinge, bend.start)
    return np.asarray(moment)


def camber_pressure(line: MeanLine, x: FloatArray) -> FloatArray:
    """``Cp_lower - Cp_upper`` of the mean line at zero incidence, at positions x (n,) in (0, 1] [-]."""
    pressure = line.incidence * incidence_pressure(x)
    for bend in line.ramps:
        pressure = pressure + bend.weight * ramp_pressure(x, bend.start)
    for bend in line.parabolas:
        pressure = pressure + bend.weight * parabola_pressure(x, bend.start)
    return np.asarray(pressure)
