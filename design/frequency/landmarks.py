"""Landmarks of a root locus: where it crosses the axis, where poles meet, and where it goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from design.frequency.crossovers import real_axis_frequencies
from design.frequency.poles import pole_order
from design.frequency.polynomials import (
    evaluate,
    leading_zeros,
    magnitude_bound,
    nearby_power_of_two,
    roots,
    with_derivatives,
)
from design.frequency.transfer import Response, Transfer, markov_parameters, natural_gain, response, transfer_of_poles
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

#: A polynomial counts as zero below this part of the terms it is the sum of. At a simple pole on the axis the
#: root of a polynomial is good to nearly all digits; where two poles meet, to half of them, and poles that
#: crowd together make small values of their own.
VANISHING_ON_AXIS, VANISHING = 1e-9, 1e-13
#: Poles below this part of the largest are at the origin; the origin is looked at this far below the others.
AT_ORIGIN, LOW = 1e-7, 1e-5
#: Gains outside these multiples of the reference are 0 or infinite but for rounding.
RANGE = (1e-10, 1e12)
#: A crossing is this near to the root of the polynomial that it starts from, in parts of its frequency; the
#: last of the Newton steps to a breakaway is not longer than this, and all of them together than `NEARBY`.
SETTLED, NEARBY = 1e-5, 1e-2
#: Roots whose gain has an imaginary part beyond this part of it are not worth a Newton step.
PLAUSIBLE = 1e-2
#: Points nearer to each other than this part of their distance from the origin are one.
SAME = 1e-6
#: A gain counts as real when its imaginary part is below this part of it.
NEARLY_REAL = 1e-6


@dataclass(frozen=True, eq=False)
class Landmarks(GridArrays):
    """The loop ``L = c (sI - A)^-1 b`` of a locus ``1 + k L = 0``, k > 0, in units of `scale` [rad/s].

    Attributes
    ----------
    A, b, c : (N, n, n), (N, n), (N, n)
    poles, moved : (N, n) closed-loop poles at the gain 0, in `pole_order`, and at the reference
    transfer : L as polynomials, (N, n+1)
    markov : (N, n+1) its expansion at infinity
    reference : (N,) a gain that moves the poles fairly
    origin : (N,) a frequency far below those of all poles that are not at the origin
    scale : (N,) [rad/s]
    """

    A: FloatArray
    b: FloatArray
    c: FloatArray
    poles: ComplexArray
    moved: ComplexArray
    transfer: Transfer
    markov: FloatArray
    reference: FloatArray
    origin: FloatArray
    scale: FloatArray

    @classmethod
    def of(cls, A: FloatArray, b: FloatArray, c: FloatArray, gain: FloatArray) -> Self:
        """From the state matrices (N, n, n), (N, n), (N, n) of N points in rad/s; b carries the sign.

        The reference is `gain` (N,), or where that is 0 the natural one.
        """
        poles = pole_order(np.linalg.eigvals(A).astype(complex))
        if np.any(gain == 0.0):
            gain = np.where(gain == 0.0, natural_gain(A, b, c, poles), gain)
        moved = np.linalg.eigvals(A - gain[:, None, None] * b[:, :, None] * c[:, None, :]).astype(complex)
        size = np.abs(np.concatenate([poles, moved], axis=-1))
        scale = nearby_power_of_two(size.max(axis=-1))
        slowest = np.where(size > AT_ORIGIN * scale[:, None], size, np.inf).min(axis=-1)
        A, b = A / scale[:, None, None], b / scale[:, None]
        markov = markov_parameters(A, b, c)
        poles, moved = (np.asarray(v / scale[:, None], dtype=complex) for v in (poles, moved))
        ratio = transfer_of_poles(poles, moved, gain, markov)
        origin = LOW * np.where(np.isfinite(slowest), slowest / scale, 1.0)
        return cls(A, b, c, poles, moved, ratio, markov, gain, origin, scale)


@dataclass(frozen=True, eq=False)
class Marks(GridArrays):
    """Gains (N, M), rising, nan padded, and the points (N, M) [rad/s] where the poles are."""

    gain: FloatArray
    point: ComplexArray


def crossings(landmarks: Landmarks) -> Marks:
    """Gains > 0 that put a pole on the imaginary axis, (N, n), and the upper of the points."""
    ratio = landmarks.transfer
    omega = real_axis_frequencies(ratio.numerator, ratio.denominator)
    s = np.asarray(1j * omega, dtype=complex)
    marked = _significant(ratio, s, VANISHING_ON_AXIS) & (omega > 0.0)
    gain = np.full(s.shape, np.nan)
    gain[:, 0] = _gain_at_origin(landmarks)
    rows = np.nonzero(marked)[0]
    w = omega[marked]
    at = response_beside_poles(landmarks.A[rows], landmarks.b[rows], landmarks.c[rows], s[marked][:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(at.value.imag == 0.0, 0.0, at.value.imag / at.slope.real)
        close = np.abs(step[:, 0]) <= SETTLED * w
        gain[marked] = np.where(close, (-1.0 / value_beside(at, -1j * step)[:, 0]).real, np.nan)
    s[marked] = 1j * np.where(close, w - step[:, 0], w)
    gain = np.where(in_range(gain, landmarks), gain, np.nan)
    return _sorted(gain, np.asarray(s * landmarks.scale[:, None], dtype=complex))


def _gain_at_origin(landmarks: Landmarks) -> FloatArray:
    """Gain (N,) that puts a moving pole at the origin; nan where L has no limit there.

    L is looked at just beside the origin, where a pole at the origin that does not move (an integral that the
    loop does not feed back) does no harm, and extrapolated. It has a limit if it is the same twice as far out.
    """
    s = np.asarray(1j * landmarks.origin[:, None] * np.array([1.0, 2.0]), dtype=complex)
    L = response(landmarks.A, landmarks.b, landmarks.c, s).value
    near, far = L[:, 0], L[:, 1]
    limit = (np.abs(far - near) < 1e-3 * np.abs(near)) & np.any(landmarks.markov != 0.0, axis=-1)
    inverse = -1.0 / np.where(limit[:, None], L, 1.0).real
    gain = (4.0 * inverse[:, 0] - inverse[:, 1]) / 3.0
    return np.where(limit & in_range(gain[:, None], landmarks)[:, 0], gain, np.nan)


def in_range(gain: FloatArray, landmarks: Landmarks) -> BoolArray:
    """Mask of the gains (N, M) > 0 that are not 0 or infinite but for rounding."""
    part = gain / landmarks.reference[:, None]
    return np.asarray((part > RANGE[0]) & (part < RANGE[1]))


@dataclass(frozen=True, eq=False)
class StationaryPoints(GridArrays):
    """Where ``dL/ds = 0``: points (N, 2n-2), nan padded, and the gains there (N, 2n-2), most of them complex."""

    point: ComplexArray
    gain: ComplexArray


def stationary_points(landmarks: Landmarks) -> StationaryPoints:
    """All points at which two poles meet at some gain, real or not, as far as polynomials tell."""
    ratio = landmarks.transfer
    width = max(2 * ratio.denominator.shape[-1] - 4, 0)
    top, bottom = with_derivatives(ratio.numerator), with_derivatives(ratio.denominator)
    stationary = _product(bottom[:, 0], top[:, 1]) - _product(bottom[:, 1], top[:, 0])
    s = roots(stationary)[:, :width]
    there = _significant(ratio, s, VANISHING)
    gain = -evaluate(ratio.denominator, s) / np.where(there, evaluate(ratio.numerator, s), 1.0)
    return StationaryPoints(s, np.where(there, gain, complex(np.nan, np.nan)))


def _product(p: FloatArray, q: FloatArray) -> FloatArray:
    """``p q`` of two (N, n+1), (N, 2n+1), each point by itself: in a matrix product its neighbours have a part in the
    last digit, and of that the poles of a breakaway gain keep every other one.
    """
    n = p.shape[-1]
    result = np.zeros((p.shape[0], 2 * n - 1))
    for i in range(n):
        result[:, i : i + n] += p[:, i : i + 1] * q
    return result


def breakaways(landmarks: Landmarks, found: StationaryPoints) -> Marks:
    """Gains > 0 at which two poles meet, (N, 2n-2), and where: ``dk/ds = 0``, that is ``L'(s) = 0``."""
    s = found.point.copy()
    with np.errstate(invalid="ignore"):
        plausible = np.abs(found.gain.imag) <= PLAUSIBLE * found.gain.real
        marked = plausible & in_range(found.gain.real, landmarks)
    gain = np.full(s.shape, np.nan)
    rows = np.nonzero(marked)[0]
    start = point = s[marked]
    A, b, c = landmarks.A[rows], landmarks.b[rows], landmarks.c[rows]
    for _ in range(3):
        at = response_beside_poles(A, b, c, point[:, None])
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(at.slope == 0.0, 0.0, at.slope / at.curvature)
            k = -1.0 / value_beside(at, -step)[:, 0]
        step = step[:, 0]
        point = np.where(np.abs(step) <= NEARBY * np.abs(point), point - step, point)
    settled = (np.abs(step) <= SETTLED * np.abs(point)) & (np.abs(point - start) <= NEARBY * np.abs(start))
    # A point that is its own mirror image but for rounding is real.
    s[marked] = np.where(np.abs(point.imag) <= SAME * np.abs(point), point.real, point)
    gain[marked] = np.where(settled & (np.abs(k.imag) <= NEARLY_REAL * np.abs(k)), k.real, np.nan)
    return _sorted(gain, np.asarray(s * landmarks.scale[:, None], dtype=complex))


def asymptotes(landmarks: Landmarks) -> tuple[FloatArray, FloatArray]:
    """Centroid (N,) [rad/s] and angles (N, n) [rad] of the branches that go to infinity.

    With p more poles than zeros, ``L = h / s^p + h' / s^(p+1) .. -> h / (s - centroid)^p``: the angles are
    ``(2 l + 1) pi / p`` for ``h > 0`` and ``2 l pi / p`` for ``h < 0``; the centroid ``h' / (p h)`` is (sum of
    poles - sum of zeros) / p.
    """
    markov = landmarks.markov
    n = markov.shape[-1] - 1
    chain = leading_zeros(markov)
    exists = chain < n
    excess = np.where(exists, chain + 1, 1)
    h, following = (np.take_along_axis(markov, np.minimum(chain + i, n)[:, None], axis=-1)[:, 0] for i in (0, 1))
    centroid = landmarks.scale * following / (np.where(exists, h, 1.0) * excess)
    turn = 2 * np.arange(n) + (h > 0.0)[:, None]
    angle = np.pi * np.where(turn > excess[:, None], turn - 2 * excess[:, None], turn) / excess[:, None]
    angle = np.where(exists[:, None] & (np.arange(n) < excess[:, None]), angle, np.nan)
    return np.where(exists, centroid, np.nan), np.sort(angle, axis=-1)


def value_beside(at: Response, step: ComplexArray) -> ComplexArray:
    """L a step of at most `SETTLED` (in parts of the frequency) away: to the third power of that."""
    return np.asarray(at.value + step * (at.slope + 0.5 * step * at.curvature))


def response_beside_poles(A: FloatArray, b: FloatArray, c: FloatArray, s: ComplexArray) -> Response:
    """Response at `s`, or a rounding beside it where a pole that does not move happens to be exactly there."""
    try:
        return response(A, b, c, s)
    except np.linalg.LinAlgError:
        return response(A, b, c, s * (1.0 + 1e-12))


def _significant(ratio: Transfer, s: ComplexArray, least: float) -> BoolArray:
    """Mask of the points (N, M) where neither numerator nor denominator vanishes: the gain is not 0, nor infinite."""
    parts = ratio.numerator, ratio.denominator
    return np.logical_and(*(np.abs(evaluate(p, s)) > least * magnitude_bound(p, s) for p in parts))


def _sorted(gain: FloatArray, point: ComplexArray) -> Marks:
    """Only gains > 0, rising; of the two of a pair the lower one first; each point once."""
    gain = np.where(gain > 0.0, gain, np.nan)
    gain, point = _by_gain(gain, point)
    apart = np.abs(point[:, :, None] - point[:, None, :]) > SAME * np.abs(point)[:, None, :]
    repeated = ~(apart | np.isnan(gain)[:, None, :] | np.triu(np.ones(apart.shape[-2:], dtype=bool)))
    gain, point = _by_gain(np.where(repeated.any(axis=-1), np.nan, gain), point)
    return Marks(gain, np.where(np.isnan(gain), complex(np.nan, np.nan), point))


def _by_gain(gain: FloatArray, point: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    order = np.lexsort((point.imag, gain), axis=-1)
    rows = np.arange(len(gain))[:, None]
    return gain[rows, order], point[rows, order]
