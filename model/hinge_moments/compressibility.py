"""Prandtl-Glauert correction of hinge moments, and the Mach numbers it may be trusted to."""

from __future__ import annotations

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats

#: Above it, uncorrected coefficients deserve a warning (seed 2.2: valid below Mach 0.3).
UNCORRECTED_MACH_LIMIT = 0.3
#: Above it, corrected ones do: shocks reach the hinge, and linear theory does not know them.
CORRECTED_MACH_LIMIT = 0.7


def is_subsonic(mach: Floats) -> BoolArray:
    """Mask of the points (*G,) where the linear theory has any meaning: Mach below one."""
    return np.asarray(np.asarray(mach, float) < 1.0)


def prandtl_glauert(mach: Floats) -> FloatArray:
    """Factor ``1 / sqrt(1 - M^2)`` on every steady coefficient (*G,) [-].

    Raises
    ------
    ValueError : a Mach number that is negative, not finite, or one and more; see `is_subsonic`
    """
    mach = np.asarray(mach, float)
    if not np.all((mach >= 0.0) & is_subsonic(mach)):
        raise ValueError("Mach number must lie in [0, 1) for the Prandtl-Glauert correction")
    return np.asarray(1.0 / np.sqrt(1.0 - mach**2))
