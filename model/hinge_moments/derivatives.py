"""Hinge moments from given numbers: eight coefficients, the first order of seed 2.2.9 and 2.2.10."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats
from model.hinge_moments.expansion import Angles, HingeMoments, HingeMomentSource, every_angle


@dataclass(frozen=True)
class Derivatives:
    """Source of hinge moments that is linear in the angles, from numbers measured or taken from a book.

    ``C_Hh = C_Hh_0 + C_Hh_alpha (alpha - alpha0) + C_Hh_dt (dt - dt0) + C_Hh_da (da - da0)``; restoring, by
    the *wing* chord squared and per unit span, deflections positive trailing edge up (`HingeMoments`).
    Textbook derivatives ``b1``, ``b2`` by the flap's chord and with trailing edge down positive have the
    other sign and another scale: ``C_Hdd = -b2 E^2`` for a flap of chord ratio E.

    Rates need no numbers: quasi-steady damping and virtual inertia follow from the section's geometry
    (`TabAileron`), whatever the source of the steady moments.

    Attributes
    ----------
    C_Ha_0, C_Ht_0 : coefficients at the reference angles, scalars or (*H,) [-]
    C_Ha_alpha, ..., C_Ht_dt : derivatives, scalars or (*H,) [1/rad]
    alpha0, da0, dt0 : reference angles [rad]

    Raises
    ------
    ValueError : a number that is not finite
    """

    C_Ha_0: Floats
    C_Ha_alpha: Floats
    C_Ha_da: Floats
    C_Ha_dt: Floats
    C_Ht_0: Floats
    C_Ht_alpha: Floats
    C_Ht_da: Floats
    C_Ht_dt: Floats
    alpha0: Floats = 0.0
    da0: Floats = 0.0
    dt0: Floats = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not np.all(np.isfinite(value)):
                raise ValueError(f"{name} must be finite")

    @cached_property
    def offset(self) -> FloatArray:
        """Coefficients at the reference angles (*H, 2), order [tab, aileron] [-]."""
        return _stack(self.C_Ht_0, self.C_Ha_0)

    @cached_property
    def gradient(self) -> FloatArray:
        """Derivatives (*H, 2, 3), rows [tab, aileron], columns d/d(alpha, dt, da) [1/rad]."""
        tab = _stack(self.C_Ht_alpha, self.C_Ht_dt, self.C_Ht_da)
        aileron = _stack(self.C_Ha_alpha, self.C_Ha_dt, self.C_Ha_da)
        return np.stack(np.broadcast_arrays(tab, aileron), axis=-2)

    @cached_property
    def reference(self) -> FloatArray:
        """Reference angles (*H, 3), order [alpha, dt, da] [rad]."""
        return _stack(self.alpha0, self.dt0, self.da0)

    def at(self, alpha: Floats, dt: Floats, da: Floats) -> HingeMoments:
        """Coefficients and gradient at incidence and deflections [rad]; see `HingeMomentSource.at`."""
        deviation = _stack(alpha, dt, da) - self.reference
        value = self.offset + np.sum(self.gradient * deviation[..., None, :], axis=-1)
        return HingeMoments(value, np.broadcast_to(self.gradient, (*value.shape[:-1], 2, 3)))

    def covers(self, alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
        """Every angle (*G,): the numbers do not say how far they hold; see `HingeMomentSource.covers`."""
        return every_angle(alpha, dt, da)

    @property
    def domain(self) -> str:
        """Every angle."""
        return "every angle"


def first_order(source: HingeMomentSource, about: Angles) -> Derivatives:
    """The linear source that touches `source` at the angles `about`: seed 2.2.9 and 2.2.10 to first order."""
    moments = source.at(about.alpha, about.dt, about.da)
    tab, aileron = moments.gradient[..., 0, :], moments.gradient[..., 1, :]
    return Derivatives(
        C_Ha_0=moments.value[..., 1], C_Ha_alpha=aileron[..., 0], C_Ha_da=aileron[..., 2], C_Ha_dt=aileron[..., 1],
        C_Ht_0=moments.value[..., 0], C_Ht_alpha=tab[..., 0], C_Ht_da=tab[..., 2], C_Ht_dt=tab[..., 1],
        alpha0=about.alpha, da0=about.da, dt0=about.dt,
    )  # fmt: skip


def _stack(*numbers: Floats) -> FloatArray:
    return np.stack(np.broadcast_arrays(*(np.asarray(x, float) for x in numbers)), axis=-1)
