"""Unsteady circulation: the incidence that drives it, and R. T. Jones's approximation of Theodorsen's function.

The circulatory part of a hinge moment goes with ``C(p) Q``, ``Q = alpha + sum over flaps of (T10/pi beta +
T11/(4 pi) c beta'/V)`` (NACA report 496), at the reduced frequency ``p = s c / (2 V)``. Jones (NACA report 681):

    C(p) = (0.5 p^2 + 0.2808 p + 0.01365) / ((p + 0.0455) (p + 0.3)) = 1 - sum over i of a_i p / (p + b_i),

so that Q reaches the circulation less the part ``a_i`` that still runs behind it through the lag ``b_i``. It is one
at rest and one half for the fastest motions, as the exact function is.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from model.arrays import ComplexArray, FloatArray, Floats
from model.hinge_moments.angles import cosine, rest, sine

#: Poles b_i of Jones's function, in half-chords of way [-].
JONES_RATES: Final = (0.0455, 0.3)


def _weights() -> tuple[float, float]:
    """The a_i: residues of ``(1 - C(p))/p = (0.5 p + 0.0647) / ((p + b_1) (p + b_2))``, adding up to a half."""
    b1, b2 = JONES_RATES
    first = (0.3455 - 0.2808 - 0.5 * b1) / (b2 - b1)
    return first, 0.5 - first


#: Parts a_i of the circulation that lag [-].
JONES_WEIGHTS: Final = _weights()


def jones(p: ComplexArray) -> ComplexArray:
    """Jones's C(p) at complex reduced frequencies ``p = s c/(2 V)`` of any shape, away from its poles."""
    lagging = [a * p / (p + b) for a, b in zip(JONES_WEIGHTS, JONES_RATES, strict=True)]
    return np.asarray(1.0 - lagging[0] - lagging[1])


def circulatory_angle(flap: Floats) -> FloatArray:
    """Incidence that a radian of a flap at `flap` (*X,) is worth to the circulation [-]; ``T10/pi``."""
    return np.asarray((rest(flap) + sine(flap)) / np.pi)


def circulatory_rate(flap: Floats) -> FloatArray:
    """Incidence that a unit of ``c beta'/V`` of a flap at `flap` (*X,) is worth to the circulation; ``T11/(4 pi)``."""
    cos = cosine(flap)
    return np.asarray((rest(flap) * (1.0 + 2.0 * cos) + sine(flap) * (2.0 + cos)) / (4.0 * np.pi))
