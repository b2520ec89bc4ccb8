"""Chord positions as Glauert's angle: ``x = (1 - cos theta) / 2``, and the kernel of a deflected flap.

Everything is written with the rest ``pi - theta``, which keeps its digits for the small tabs at the
trailing edge where ``theta`` itself is near pi.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, Floats


def cosine(x: Floats) -> FloatArray:
    """``cos(theta)`` at chord positions x (*X,) in [0, 1]."""
    return np.asarray(1.0 - 2.0 * np.asarray(x, float))


def sine(x: Floats) -> FloatArray:
    """``sin(theta)`` at chord positions x (*X,) in [0, 1]."""
    x = np.asarray(x, float)
    return np.asarray(2.0 * np.sqrt(x * (1.0 - x)))


def rest(x: Floats) -> FloatArray:
    """``pi - theta`` at chord positions x (*X,) in [0, 1] [rad]."""
    return np.asarray(2.0 * np.arcsin(np.sqrt(1.0 - np.asarray(x, float))))


def log_kernel(x: Floats, flap: Floats, power: int) -> FloatArray:
    """``(cos theta - cos f)^power log|sin((theta + f)/2) / sin((theta - f)/2)|``; arguments broadcast.

    For a positive power it is 0, its limit, where x is the hinge f. For power 0 it is infinite there:
    callers keep away from the hinge.
    """
    rest_x, rest_f = rest(x), rest(flap)
    gap = 0.5 * (rest_x - rest_f)
    apart = np.abs(gap) > 1e-12
    ratio = np.where(apart, np.sin(0.5 * (rest_x + rest_f)), 1.0) / np.where(apart, np.sin(gap), 1.0)
    factor = (cosine(x) - cosine(flap)) ** power
    return np.asarray(np.where(apart, factor, 0.0) * np.log(np.abs(ratio)))
