"""Landmarks of a root locus: where it crosses the axis, where poles meet, and where it goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from design.crossovers import real_axis_frequencies
from design.polynomials import evaluate, leading_zeros, magnitude_bound, product, roots, with_derivatives
from design.transfer import Transfer, response, transfer
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: A polynomial counts as zero below this part of the terms it is the sum of. At a simple pole on the axis the
#: root of a polynomial is good to nearly all digits; where two poles meet, to half of them, and poles that
#: crowd together make small values of their own.
VANISHING_ON_AXIS, VANISHING = 1e-9, 1e-13
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

    Common factors s of numerator and denominator are cancelled in `transfer` (an integral that the loop does
    not feed back): they are poles that do not move, and would hide a crossing at the origin.
    """

    A: FloatArray
    b: FloatArray
    c: FloatArray
    transfer: Transfer
    scale: FloatArray

    @classmethod
    def of(cls, A: FloatArray, b: FloatArray, c: FloatArray) -> Self:
        """From the state matrices (N, n, n), (N, n), (N, n) of N points in rad/s; b carries the sign."""
        full = transfer(A, b, c)
        scale = full.frequency_scale
        return cls(A / scale[:, None, None], b / scale[:, None], c, full.scaled(scale).without_common_origin(), scale)


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
    marked = _significant(ratio, s, VANISHING_ON_AXIS)
    gain = np.full(s.shape, np.nan)
    denominator, numerator = ratio.denominator[:, -1], ratio.numerator[:, -1]
    gain[:, 0] = np.where(marked[:, 0], -denominator / np.where(marked[:, 0], numerator, 1.0), np.nan)
    # The origin has been dealt with by the polynomials, where a pole that does not move is cancelled.
    marked[:, 0] = False
    rows = np.nonzero(marked)[0]
    w = omega[marked]
    at = response(landmarks.A[rows], landmarks.b[rows], landmarks.c[rows], s[marked][:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(at.value.imag == 0.0, 0.0, at.value.imag / at.slope.real)[:, 0]
    close = np.abs(step) <= SETTLED * w
    w = np.where(close, w - step, w)
    at = response(landmarks.A[rows], landmarks.b[rows], landmarks.c[rows], np.asarray(1j * w, dtype=complex)[:, None])
    s[marked] = 1j * w
    gain[marked] = np.where(close, (-1.0 / at.value[:, 0]).real, np.nan)
    return _sorted(gain, np.asarray(s * landmarks.scale[:, None], dtype=complex))


def breakaways(landmarks: Landmarks) -> Marks:
    """Gains > 0 at which two poles meet, (N, 2n-2), and where: ``dk/ds = 0``, that is ``L'(s) = 0``."""
    ratio = landmarks.transfer
    width = max(2 * ratio.denominator.shape[-1] - 4, 0)
    top, bottom = with_derivatives(ratio.numerator), with_derivatives(ratio.denominator)
    stationary = product(bottom[:, 0], top[:, 1]) - product(bottom[:, 1], top[:, 0])
    s = roots(stationary)[:, :width]
    marked = _significant(ratio, s, VANISHING)
    estimate = -evaluate(ratio.denominator, s) / np.where(marked, evaluate(ratio.numerator, s), 1.0)
    with np.errstate(invalid="ignore"):
        marked &= (estimate.real > 0.0) & (np.abs(estimate.imag) <= PLAUSIBLE * np.abs(estimate))
    gain = np.full(s.shape, np.nan)
    rows = np.nonzero(marked)[0]
    start = point = s[marked]
    A, b, c = landmarks.A[rows], landmarks.b[rows], landmarks.c[rows]
    for _ in range(3):
        at = response(A, b, c, point[:, None])
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(at.slope == 0.0, 0.0, at.slope / at.curvature)[:, 0]
        point = np.where(np.abs(step) <= NEARBY * np.abs(point), point - step, point)
    settled = (np.abs(step) <= SETTLED * np.abs(point)) & (np.abs(point - start) <= NEARBY * np.abs(start))
    k = -1.0 / response(A, b, c, point[:, None]).value[:, 0]
    s[marked] = point
    gain[marked] = np.where(settled & (np.abs(k.imag) <= NEARLY_REAL * np.abs(k)), k.real, np.nan)
    return _sorted(gain, np.asarray(s * landmarks.scale[:, None], dtype=complex))


def asymptotes(landmarks: Landmarks) -> tuple[FloatArray, FloatArray]:
    """Centroid (N,) [rad/s] and angles (N, n) [rad] of the branches that go to infinity.

    With p more poles than zeros, ``L -> h / (s - centroid)^p``: angles ``(2 l + 1) pi / p`` for ``h > 0`` and
    ``2 l pi / p`` for ``h < 0``; the centroid is (sum of poles - sum of zeros) / p.
    """
    ratio, n = landmarks.transfer, landmarks.A.shape[-1]
    pole, zero = leading_zeros(ratio.denominator), leading_zeros(ratio.numerator)
    excess = (zero - pole)[:, None]
    exists = zero <= n
    h, of_zeros = _coefficients(ratio.numerator, zero)
    _, of_poles = _coefficients(ratio.denominator, pole)
    centroid = (of_zeros / np.where(exists, h, 1.0) - of_poles) / excess[:, 0]
    turn = 2 * np.arange(n) + (h > 0.0)[:, None]
    angle = np.pi * np.where(turn > excess, turn - 2 * excess, turn) / excess
    angle = np.where(exists[:, None] & (np.arange(n) < excess), angle, np.nan)
    return np.where(exists, centroid * landmarks.scale, np.nan), np.sort(angle, axis=-1)


def natural_gain(landmarks: Landmarks) -> FloatArray:
    """Gain (N,) at which ``|k L| = 1`` at the frequency of the fastest poles; 1 where there is none."""
    j = np.full((len(landmarks.scale), 1), 1j)
    top, bottom = (np.abs(evaluate(p, j))[:, 0] for p in (landmarks.transfer.denominator, landmarks.transfer.numerator))
    usable = (top > 0.0) & (bottom > 0.0)
    return np.where(usable, top / np.where(usable, bottom, 1.0), 1.0)


def _coefficients(p: FloatArray, place: IntArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients at `place` (N,) and after it, of (N, m), zero where there are none."""
    padded = np.concatenate([p, np.zeros((len(p), 2))], axis=-1)
    first, second = (np.take_along_axis(padded, (place + i)[:, None], axis=-1)[:, 0] for i in (0, 1))
    return first, second


def _significant(ratio: Transfer, s: ComplexArray, least: float) -> BoolArray:
    """Mask of the points (N, M) where neither numerator nor denominator vanishes: the gain is not 0, nor infinite."""
    parts = ratio.numerator, ratio.denominator
    return np.logical_and(*(np.abs(evaluate(p, s)) > least * magnitude_bound(p, s) for p in parts))


def _sorted(gain: FloatArray, point: ComplexArray) -> Marks:
    """Only gains > 0, rising; of the two of a pair the lower one first; each point once."""
    gain = np.where(gain > 0.0, gain, np.nan)
    lower = np.argsort(point.imag, axis=-1)
    rising = np.argsort(np.take_along_axis(gain, lower, axis=-1), axis=-1, stable=True)
    order = np.take_along_axis(lower, rising, axis=-1)
    gain, point = np.take_along_axis(gain, order, axis=-1), np.take_along_axis(point, order, axis=-1)
    apart = np.abs(point[:, :, None] - point[:, None, :]) > SAME * np.abs(point)[:, None, :]
    repeated = ~(apart | np.isnan(gain)[:, None, :] | np.triu(np.ones(apart.shape[-2:], dtype=bool)))
    gain = np.where(repeated.any(axis=-1), np.nan, gain)
    order = np.argsort(gain, axis=-1, stable=True)
    gain, point = np.take_along_axis(gain, order, axis=-1), np.take_along_axis(point, order, axis=-1)
    return Marks(gain, np.where(np.isnan(gain), complex(np.nan, np.nan), point))
