"""What every source of hinge moments answers: the coefficients and their gradient, at any angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats, GridArrays


@dataclass(frozen=True)
class Angles:
    """Incidence, tab angle (relative to the aileron) and aileron angle [rad]; order [alpha, dt, da] in arrays."""

    alpha: float = 0.0
    dt: float = 0.0
    da: float = 0.0


@dataclass(frozen=True, eq=False)
class HingeMoments(GridArrays):
    """Hinge-moment coefficients and their gradient: the first-order expansion of seed 2.2.9 and 2.2.10.

    ``C_H`` is per unit span, divided by dynamic pressure and the *wing* chord squared, and restoring:
    it stands on the left of ``J d'' + q c^2 s C_H = T`` (seed 2.2.8), so a positive value drives the
    surface against the positive direction of its angle.

    Attributes
    ----------
    value : (*G, 2) ``[C_Ht, C_Ha]`` [-]
    gradient : (*G, 2, 3) rows [tab, aileron], columns d/d(alpha, dt, da) [1/rad]
    """

    value: FloatArray
    gradient: FloatArray


class HingeMomentSource(Protocol):
    """Anything that knows the hinge moments: a theory, given numbers, a fitted table."""

    def at(self, alpha: Floats, dt: Floats, da: Floats) -> HingeMoments:
        """Coefficients and gradient at incidence alpha, tab angle dt (relative) and aileron angle da [rad].

        Arguments broadcast to the shape ``*G`` of the answer.
        """
        ...

    def covers(self, alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
        """Mask (*G,) of the angles [rad] that the source knows about; `at` answers beyond them too."""
        ...

    @property
    def domain(self) -> str:
        """What `covers` covers, in words and degrees."""
        ...


def every_angle(alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
    """Mask (*G,) that is True everywhere: what a linear source covers."""
    return np.ones(np.broadcast_shapes(np.shape(alpha), np.shape(dt), np.shape(da)), dtype=bool)
