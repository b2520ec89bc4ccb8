"""Pressure difference along the chord, ``Cp_lower - Cp_upper``, of the motions in `closed_forms.py`.

Glauert's series summed: an incidence ``e(x)`` gives ``4 (A0 cot(theta/2) + sum A_n sin(n theta))``. All
are per unit of the motion, trailing edge down, and zero at the trailing edge (Kutta). `x` lies in (0, 1];
at the leading edge, and at its own hinge a flap's pressure, is infinite.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, Floats
from model.hinge_moments.angles import cosine, log_kernel, rest, sine


def incidence_pressure(x: Floats) -> FloatArray:
    """Per radian of incidence: ``4 cot(theta/2)``."""
    x = np.asarray(x, float)
    return np.asarray(4.0 * np.sqrt((1.0 - x) / x))


def flap_pressure(x: Floats, flap: Floats) -> FloatArray:
    """Per radian of a flap hinged at `flap`; logarithmically infinite at the hinge itself."""
    return np.asarray(rest(flap) / np.pi * incidence_pressure(x) + 4.0 / np.pi * log_kernel(x, flap, 0))


def ramp_pressure(x: Floats, start: Floats) -> FloatArray:
    """Of the incidence ``(x - start)+``: the integral of `flap_pressure` over hinges behind `start`."""
    w, s, b = rest(start), sine(start), cosine(start)
    mean = (w * b + s) / (2.0 * np.pi)
    series = w * sine(x) - log_kernel(x, start, 1)
    return np.asarray(mean * incidence_pressure(x) + 2.0 / np.pi * series)


def parabola_pressure(x: Floats, start: Floats) -> FloatArray:
    """Of the incidence ``(x - start)+^2 / 2``: the integral of `ramp_pressure` over starts behind `start`."""
    w, s, b = rest(start), sine(start), cosine(start)
    mean = (w * (b * b + 0.5) + 1.5 * s * b) / (8.0 * np.pi)
    series = log_kernel(x, start, 2) + sine(x) * (s + w * (2.0 * b - cosine(x)))
    return np.asarray(mean * incidence_pressure(x) + series / (2.0 * np.pi))
