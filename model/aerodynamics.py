"""The choice of aerodynamic model: where hinge moments come from, and what motion and Mach number add."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats
from model.hinge_moments.compressibility import is_subsonic, prandtl_glauert
from model.hinge_moments.expansion import HingeMoments, HingeMomentSource

Damping = Literal["thesis", "quasi_steady", "unsteady"]
Compressibility = Literal["none", "prandtl_glauert"]


@dataclass(frozen=True)
class Aerodynamics:
    """Hinge-moment source and the effects added to it.

    Attributes
    ----------
    source : steady hinge moments at given angles
    damping : ``thesis``: induced angles of seed 2.2.12 and 2.2.13, verbatim; ``quasi_steady``: the rate
        derivatives of thin-aerofoil theory with C(k) = 1; ``unsteady``: those, with the circulation behind by
        Jones's approximation of Theodorsen's function, two more states (`lag_states`). All but the steady part is
        thin-aerofoil theory for the section's hinges, whatever the source
    virtual_inertia : add the air's apparent inertia, from thin-aerofoil theory
    compressibility : ``prandtl_glauert`` multiplies the steady coefficients and the rate derivatives by
        ``1/sqrt(1 - M^2)`` (on the rates a first-order guess), not the virtual inertia

    Raises
    ------
    ValueError : an option that does not exist
    """

    source: HingeMomentSource
    damping: Damping = "thesis"
    virtual_inertia: bool = False
    compressibility: Compressibility = "none"

    def __post_init__(self) -> None:
        for name, kind in (("damping", Damping), ("compressibility", Compressibility)):
            if getattr(self, name) not in get_args(kind):
                raise ValueError(f"{name} must be one of {get_args(kind)}, not {getattr(self, name)!r}")

    def covers(self, mach: Floats) -> BoolArray:
        """Mask of the points (*G,) inside the model: subsonic ones, whatever the correction."""
        return is_subsonic(mach)

    def amplification(self, mach: Floats) -> FloatArray:
        """Compressibility factor on the steady coefficients and rate derivatives (*G,) [-].

        Raises
        ------
        ValueError : Mach one and more with ``prandtl_glauert``
        """
        if self.compressibility == "prandtl_glauert":
            return prandtl_glauert(mach)
        return np.ones(np.shape(mach))

    def hinge_moments(self, alpha: Floats, dt: Floats, da: Floats, mach: Floats) -> HingeMoments:
        """Steady coefficients and gradient at given angles [rad], compressibility included (*G, ...)."""
        moments, factor = self.source.at(alpha, dt, da), self.amplification(mach)
        return HingeMoments(
            factor[..., None] * moments.value,
            factor[..., None, None] * moments.gradient,
        )
