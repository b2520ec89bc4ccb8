"""Poles of ``A - k M`` for many gains k, M of rank one, at a fraction of the eigenvalue problems.

The characteristic polynomial is affine in k. So between two gains whose poles a and b are known it is, with
t the part of the way, ``(1 - t) prod(s - a_j) + t prod(s - b_j)``: no coefficients, and no digits lost to
them. Its roots are found from a cubic between a and b by simultaneous iteration (Weierstrass 1891, Durand,
Kerner), and kept when the discs that are known to hold them do not touch. What is left, above all the gains
next to those at which poles meet, are eigenvalue problems again.
"""

from __future__ import annotations

import numpy as np

from design.frequency.poles import pole_order
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from model.branches import continuations, squared_gaps

#: Every how many gains the eigenvalues themselves are computed, and again in the segments that this leaves open.
STRIDES = (16, 4)
#: Number of iterations; each doubles the number of digits.
ITERATIONS = 3
#: Largest last correction over the distance to the nearest root; the error left is smaller by as much again.
SEPARATED = 1e-6


def poles_along(A: FloatArray, M: FloatArray, gains: FloatArray) -> ComplexArray:
    """Eigenvalues of ``A - k M`` (N, K, n).

    Those that come from an eigenvalue problem are in `pole_order`; the others keep the places of those they
    continue, so that few lists differ in their order from the one before.

    Parameters
    ----------
    A, M : (N, n, n), M of rank one
    gains : (N, K), strictly monotonic along the last axis
    """
    values = np.empty((*gains.shape, A.shape[-1]), dtype=complex)
    missing = np.ones(gains.shape, dtype=bool)

    def solve(wanted: BoolArray) -> None:
        rows = np.nonzero(wanted)[0]
        closed = A[rows] - gains[wanted][:, None, None] * M[rows]
        values[wanted] = pole_order(np.linalg.eigvals(closed).astype(complex))
        missing[wanted] = False

    for stride in STRIDES:
        rows, first = _open_segments(missing, stride)
        ends = np.zeros_like(missing)
        ends[rows, first] = ends[rows, first + stride] = True
        solve(ends & missing)
        inner = first[:, None] + np.arange(1, stride)
        k, low, high = gains[rows[:, None], inner], gains[rows, first], gains[rows, first + stride]
        parts = (k - low[:, None]) / (high - low)[:, None]
        found, certain = _between(values[rows, first], values[rows, first + stride], parts)
        where = np.broadcast_to(rows[:, None], inner.shape)[certain], inner[certain]
        values[where], missing[where] = found[certain], False
    solve(missing)
    return values


def _open_segments(missing: BoolArray, stride: int) -> tuple[IntArray, IntArray]:
    """Rows and first places (L,) of the segments of `stride` gains with one inside that is missing (N, K)."""
    N, K = missing.shape
    count = (K - 1) // stride
    inside = missing[:, : count * stride].reshape(N, count, stride)[:, :, 1:].any(axis=-1)
    rows, segment = np.nonzero(inside)
    return rows, segment * stride


def _between(start: ComplexArray, end: ComplexArray, parts: FloatArray) -> tuple[ComplexArray, BoolArray]:
    """Poles (L, m, n) at the `parts` (L, m) of the way from `start` to `end` (L, n), and which (L, m) are sure.

    Not even tried are the segments in which a pair leaves or reaches the real axis.
    """
    end = np.take_along_axis(end, continuations(start, end), axis=-1)
    # In pole order the upper one of a pair follows the lower one.
    partner = np.arange(start.shape[-1]) + (start.imag < 0.0) - (start.imag > 0.0)
    alike = np.all(np.take_along_axis(end, partner, axis=-1) == np.conj(end), axis=-1)
    values = np.zeros((*parts.shape, start.shape[-1]), dtype=complex)
    certain = np.zeros(parts.shape, dtype=bool)
    if alike.any():
        roots, certain[alike] = _simultaneous(start[alike], end[alike], parts[alike])
        mirrored = np.conj(np.take_along_axis(roots, partner[alike][:, None, :], axis=-1))
        values[alike] = 0.5 * (roots + mirrored)
    return values, certain


def _simultaneous(a: ComplexArray, b: ComplexArray, t: FloatArray) -> tuple[ComplexArray, BoolArray]:
    """Roots (L, m, n) at the parts `t` (L, m) of the way from a to b (L, n), and which of them (L, m) are sure."""
    a, b = (np.moveaxis(v, -1, 0)[..., None] for v in (a, b))
    s = _cubic(a, b, t)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(ITERATIONS):
            value = (1.0 - t) * _product(s, a) + t * _product(s, b)
            correction = value / _others(s)
            s = s - correction
        squared = correction.real**2 + correction.imag**2
        certain = np.all(squared <= SEPARATED**2 * squared_gaps(s), axis=0)
    return np.moveaxis(s, 0, -1), certain


def _cubic(a: ComplexArray, b: ComplexArray, t: FloatArray) -> ComplexArray:
    """Cubic (n, L, m) from a to b (n, L, 1) with the true slopes at both ends, where they are not excessive."""
    chord = b - a
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first, last = -_product(a, b) / _others(a), _product(b, a) / _others(b)
        first, last = (np.where(np.abs(v) <= 4.0 * np.abs(chord), v, chord) for v in (first, last))
    return a + t * (first + t * (3.0 * chord - 2.0 * first - last + t * (first + last - 2.0 * chord)))


def _product(s: ComplexArray, zeros: ComplexArray) -> ComplexArray:
    """``prod_j (s - zeros_j)``: s (n, L, m), zeros (n, L, 1)."""
    result: ComplexArray = np.subtract(s, zeros[0])
    factor = np.empty_like(result)
    for zero in zeros[1:]:
        np.subtract(s, zero, out=factor)
        np.multiply(result, factor, out=result)
    return result


def _others(s: ComplexArray) -> ComplexArray:
    """``prod_(j != i) (s_i - s_j)``, the shape of s, (n, ...)."""
    product = np.ones_like(s)
    for i in range(len(s)):
        for j in range(i):
            apart = s[i] - s[j]
            product[i] *= apart
            product[j] *= apart
        # s_i is yet to meet the later roots, each time with the other sign.
        if (len(s) - 1 - i) % 2:
            np.negative(product[i], out=product[i])
    return product
