"""Poles of ``A - k M`` for many gains k, M of rank one, at a fraction of the eigenvalue problems.

The characteristic polynomial is affine in k. So between two gains whose poles a and b are known it is, with
t the part of the way, ``(1 - t) prod(s - a_j) + t prod(s - b_j)``: no coefficients, and no digits lost to
them. Its roots are found from a cubic between a and b by simultaneous iteration (Weierstrass 1891, Durand,
Kerner), and kept when the discs that are known to hold them do not touch. What is left, above all the gains
next to those at which poles meet, are eigenvalue problems again.
"""

from __future__ import annotations

import numpy as np

from design.branches import successors
from design.poles import pole_order
from model.arrays import BoolArray, ComplexArray, FloatArray

#: Every how many gains the eigenvalues themselves are computed.
STRIDE = 12
#: Number of iterations; each doubles the number of digits.
ITERATIONS = 3
#: Largest last correction over the least distance between two roots; the error left is about its square.
SEPARATED = 1e-6


def poles_along(A: FloatArray, M: FloatArray, gains: FloatArray) -> ComplexArray:
    """Eigenvalues of ``A - k M`` (N, K, n), each list in `pole_order`.

    Parameters
    ----------
    A, M : (N, n, n), M of rank one
    gains : (N, K), strictly monotonic along the last axis
    """
    N, K = gains.shape
    n = A.shape[-1]
    segments = (K - 1) // STRIDE
    spanned = segments * STRIDE
    values = np.empty((N, K, n), dtype=complex)
    missing = np.ones((N, K), dtype=bool)
    if segments:
        missing[:, : spanned + 1 : STRIDE] = False
        values[:, : spanned + 1 : STRIDE] = _eigenvalues(A[:, None], M[:, None], gains[:, : spanned + 1 : STRIDE])
        found, certain = _between(values[:, : spanned + 1 : STRIDE], gains[:, : spanned + 1])
        values[:, :spanned].reshape(N, segments, STRIDE, n)[:, :, 1:] = found
        missing[:, :spanned].reshape(N, segments, STRIDE)[:, :, 1:] = ~certain
    rows = np.nonzero(missing)[0]
    values[missing] = _eigenvalues(A[rows], M[rows], gains[missing])
    return values


def _eigenvalues(A: FloatArray, M: FloatArray, gains: FloatArray) -> ComplexArray:
    return pole_order(np.linalg.eigvals(A - gains[..., None, None] * M).astype(complex))


def _between(anchors: ComplexArray, gains: FloatArray) -> tuple[ComplexArray, BoolArray]:
    """Poles (N, S, STRIDE-1, n) between the gains whose poles (N, S+1, n) are given, and which are certain.

    Not even tried are the segments in which a pair leaves or reaches the real axis.
    """
    follows = successors(anchors)
    start = anchors[:, :-1]
    end = np.take_along_axis(anchors[:, 1:], follows, axis=-1)
    lower, upper = start.imag < 0.0, start.imag > 0.0
    # In pole order the upper one of a pair follows the lower one.
    partner = np.arange(start.shape[-1]) + lower - upper
    alike = np.all(np.take_along_axis(end, partner, axis=-1) == np.conj(end), axis=-1)
    k = gains[:, :-1].reshape(*start.shape[:2], STRIDE)
    t = (k[..., 1:] - k[..., :1]) / (gains[:, STRIDE::STRIDE, None] - k[..., :1])
    values = np.zeros((*t.shape, start.shape[-1]), dtype=complex)
    certain = np.zeros(t.shape, dtype=bool)
    if alike.any():
        roots, certain[alike] = _simultaneous(start[alike], end[alike], t[alike])
        mirrored = np.conj(np.take_along_axis(roots, partner[alike][:, None, :], axis=-1))
        values[alike] = pole_order(0.5 * (roots + mirrored))
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
        largest = np.max(correction.real**2 + correction.imag**2, axis=0)
        certain = largest <= SEPARATED**2 * _nearest(s)
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


def _nearest(s: ComplexArray) -> FloatArray:
    """Least ``|s_i - s_j|^2`` of any two, (...) for s (n, ...)."""
    nearest = np.full(s.shape[1:], np.inf)
    for i in range(len(s)):
        for j in range(i):
            apart = s[i] - s[j]
            np.minimum(nearest, apart.real**2 + apart.imag**2, out=nearest)
    return nearest
