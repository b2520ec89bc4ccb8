"""Thin-aerofoil hinge moments in closed form: the load moment at a hinge due to incidence and flaps.

Chordwise position is ``x = (1 - cos theta) / 2`` from 0 at the leading to 1 at the trailing edge. Every
function gives the load moment about the hinge `x_h`,

    G_h = integral from x_h to 1 of (Cp_lower - Cp_upper) (x - x_h) dx,

per unit of one motion of the mean line. Angles are positive trailing edge DOWN here, the classical sense;
`thin_aerofoil.py` turns them into restoring coefficients. Arguments are fractions of the chord and
broadcast. The forms follow by superposition from Glauert's flap (R&M 1095, 1927) and reduce for a single
hinge to Theodorsen's T-functions (NACA report 496), for tab on flap to NACA report 736 with C(k) = 1.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from model.arrays import FloatArray, Floats
from model.hinge_moments.angles import cosine, log_kernel, rest, sine


def incidence_moment(hinge: Floats) -> FloatArray:
    """Load moment at `hinge` per radian of incidence of the whole aerofoil [1/rad]; ``T12 / 2``."""
    cos = cosine(hinge)
    return np.asarray(rest(hinge) * (cos - 0.5) + sine(hinge) * (1.0 - 0.5 * cos))


def flap_moment(hinge: Floats, flap: Floats) -> FloatArray:
    """Load moment at `hinge` per radian of a flap hinged at `flap` [1/rad]; ``C_H,delta`` itself."""
    k = _Pair(hinge, flap)
    circulation = k.rest_f * incidence_moment(hinge)
    shape = 0.5 * k.log_term(2) + 0.5 * k.sin_f * ((2.0 * k.cos_h - k.cos_f) * k.rest_h + k.sin_h)
    return np.asarray((circulation + shape) / np.pi)


def ramp_moment(hinge: Floats, start: Floats) -> FloatArray:
    """Load moment at `hinge` of the incidence ``(x - start)+``: zero ahead of `start`, linear behind it.

    It is the integral of `flap_moment` over flap hinges from `start` to the trailing edge: piecewise
    linear mean-line slopes are sums of it, and so is the circulatory part of a flap's rate.
    """
    k = _Pair(hinge, start)
    a, b, S, s, P, w = k.cos_h, k.cos_f, k.sin_h, k.sin_f, k.rest_h, k.rest_f
    circulation = incidence_moment(hinge) * (w * b + s)
    shape = S / 6.0 * ((a * a + 0.5) * w + 2.0 * a * s - 0.5 * s * b)
    moment = 0.25 * (2.0 * a * P + S) * (w + s * b) + P * s**3 / 6.0
    return np.asarray((circulation - k.log_term(3) / 6.0 + shape + moment) / (2.0 * np.pi))


def parabola_moment(hinge: Floats, start: Floats) -> FloatArray:
    """Load moment at `hinge` of the incidence ``(x - start)+^2 / 2`` (5-digit mean lines)."""
    k = _Pair(hinge, start)
    a, S, P, e = k.cos_h, k.sin_h, k.rest_h, _Integrals(k)
    circulation = incidence_moment(hinge) * (e.cos_2 + e.one)
    shape = S / 6.0 * ((a * a + 0.5) * e.first + 2.0 * a * e.one - 0.5 * e.cube)
    moment = 0.25 * (2.0 * a * P + S) * (e.first + e.cube) + P / 6.0 * e.fourth
    return np.asarray((circulation - e.log / 6.0 + shape + moment) / (4.0 * np.pi))


def apparent_mass_rate_moment(hinge: Floats, flap: Floats) -> FloatArray:
    """Part of `rate_moment` that is d(phi)/dt of the flow without circulation."""
    k = _Pair(hinge, flap)
    a, b, S, s, P = k.cos_h, k.cos_f, k.sin_h, k.sin_f, k.rest_h
    first = k.rest_f * (0.5 * a * (P + S * a) + S**3 / 3.0)
    second = s / 6.0 * (P * (1.0 - b * b + 3.0 * a * b) + S * (b + 2.0 * a))
    return np.asarray((first + second - k.log_term(3) / 6.0) / (2.0 * np.pi))


def rate_moment(hinge: Floats, flap: Floats) -> FloatArray:
    """Load moment at `hinge` per unit of ``c beta'/V`` of a flap at `flap`, quasi-steady (C(k) = 1).

    The incidence ``c beta'/V (x - flap)+`` that the moving flap sees, and the pressure of the flow it
    accelerates: `ramp_moment` + `apparent_mass_rate_moment`.
    """
    return ramp_moment(hinge, flap) + apparent_mass_rate_moment(hinge, flap)


def acceleration_moment(hinge: Floats, flap: Floats) -> FloatArray:
    """Load moment at `hinge` per unit of ``c^2 beta''/V^2`` of a flap at `flap`; symmetric in the two.

    The virtual inertia of the air, independent of circulation and therefore of C(k).
    """
    k = _Pair(hinge, flap)
    a, S, P, e = k.cos_h, k.sin_h, k.rest_h, _Integrals(k)
    first = (0.5 * a * (P + S * a) + S**3 / 3.0) * e.first
    second = P * (e.one - e.eighth + 3.0 * a * e.cube) + S * (e.cube + 2.0 * a * e.one)
    return np.asarray((first + second / 6.0 - e.log / 6.0) / (4.0 * np.pi))


def between_surfaces(
    form: Callable[[Floats, Floats], FloatArray], aileron_hinge: Floats, tab_hinge: Floats
) -> FloatArray:
    """Evaluate `form` between both hinges and both surfaces: (*H, 2, 2), rows hinge, order [tab, aileron]."""
    hinges = np.stack(np.broadcast_arrays(np.asarray(tab_hinge, float), np.asarray(aileron_hinge, float)), -1)
    return form(hinges[..., :, None], hinges[..., None, :])


class _Pair:
    """Trigonometry of the hinge h where the moment is taken and the hinge f of what moves."""

    def __init__(self, hinge: Floats, flap: Floats) -> None:
        self.hinge, self.flap = hinge, flap
        self.cos_h, self.cos_f = cosine(hinge), cosine(flap)
        self.sin_h, self.sin_f = sine(hinge), sine(flap)
        self.rest_h, self.rest_f = rest(hinge), rest(flap)

    def log_term(self, power: int) -> FloatArray:
        return log_kernel(self.hinge, self.flap, power)


class _Integrals:
    """Integrals over the moving part from f to the trailing edge, shared by the two quadratic forms."""

    def __init__(self, k: _Pair) -> None:
        a, S, b, s, w = k.cos_h, k.sin_h, k.cos_f, k.sin_f, k.rest_f
        sin_2 = 2.0 * s * b
        sin_4 = 2.0 * sin_2 * (2.0 * b * b - 1.0)
        self.cos_2 = 0.25 * w * (2.0 * b * b - 1.0) + sin_2 / 8.0
        self.one = 0.5 * w + 0.25 * sin_2
        self.first = w * b + s
        self.cube = -(s**3) / 3.0
        self.fourth = 3.0 * w / 8.0 + sin_2 / 4.0 - sin_4 / 32.0
        self.eighth = w / 8.0 + sin_4 / 32.0
        cubic = a**3 * w + 3.0 * a * a * s + 3.0 * a * (0.5 * w - 0.5 * s * b) + s - s**3 / 3.0
        self.log = -0.25 * k.log_term(4) + 0.25 * S * cubic
