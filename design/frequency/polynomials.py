"""Arithmetic on batches of real polynomials.

A polynomial is the last axis of an array, highest power first as `numpy.poly` has it, so
``(*G, n+1)`` holds one polynomial of degree n at most for every grid point. Leading coefficients may
be zero: the degree may differ from point to point, and the arrays need not know.
"""

from __future__ import annotations

from functools import cache
from typing import TypeVar

import numpy as np

from model.arrays import ComplexArray, FloatArray, IntArray

#: Real or complex points; what comes back is of the same kind.
Points = TypeVar("Points", FloatArray, ComplexArray)


def evaluate(p: FloatArray, s: Points) -> Points:
    """Value of (*G, n+1) at (*G, m) points, (*G, m), by Horner's rule; real for real `s`."""
    result = np.zeros_like(s)
    result += p[..., :1]
    for i in range(1, p.shape[-1]):
        result *= s
        result += p[..., i : i + 1]
    return result


def product(p: FloatArray, q: FloatArray) -> FloatArray:
    """``p q``: two (*G, n+1) give (*G, 2n+1)."""
    return _bilinear(p, q, _product_table(p.shape[-1]))


def with_derivatives(p: FloatArray) -> FloatArray:
    """Polynomial and its first two derivatives, (*G, n+1) gives (*G, 3, n+1), all of the same length."""
    power = np.arange(p.shape[-1] - 1, -1, -1.0)
    result = np.zeros((*p.shape[:-1], 3, p.shape[-1]))
    result[..., 0, :] = p
    result[..., 1, 1:] = (p * power)[..., :-1]
    result[..., 2, 2:] = (p * power * (power - 1.0))[..., :-2]
    return result


def powers(x: FloatArray, length: int) -> FloatArray:
    """``x^(length-1) .. x, 1`` of (K,), (length, K): times the coefficients and summed, the value of a polynomial."""
    factors = np.empty((length, *x.shape))
    factors[0] = 1.0
    factors[1:] = x
    return np.multiply.accumulate(factors, axis=0)[::-1]


def magnitude_bound(p: FloatArray, s: ComplexArray | FloatArray) -> FloatArray:
    """Sum of the magnitudes of the terms of `p` at `s`: what its value is small or large against."""
    return evaluate(np.abs(p), np.abs(s))


def squared_magnitude(p: FloatArray) -> FloatArray:
    """``|p(jw)|^2`` as a polynomial in ``x = w^2``: (*G, n+1) gives (*G, n+1)."""
    return real_cross(p, p)


def real_cross(p: FloatArray, q: FloatArray) -> FloatArray:
    """``Re(p(jw) conj q(jw))`` as a polynomial in ``x = w^2``: two (*G, n+1) give (*G, n+1)."""
    return _bilinear(p, q, _cross_tables(p.shape[-1])[0])


def imaginary_cross(p: FloatArray, q: FloatArray) -> FloatArray:
    """``Im(p(jw) conj q(jw)) / w`` as a polynomial in ``x = w^2``: two (*G, n+1) give (*G, n)."""
    return _bilinear(p, q, _cross_tables(p.shape[-1])[1])


def _bilinear(p: FloatArray, q: FloatArray, table: FloatArray) -> FloatArray:
    products = p[..., :, None] * q[..., None, :]
    return np.asarray(products.reshape(*products.shape[:-2], len(table)) @ table)


@cache
def _product_table(length: int) -> FloatArray:
    """Where the product of two coefficients goes in the product of two polynomials, (length^2, 2 length - 1)."""
    i, j = (m.ravel() for m in np.meshgrid(np.arange(length), np.arange(length), indexing="ij"))
    table = np.zeros((length**2, 2 * length - 1))
    table[np.arange(length**2), i + j] = 1.0
    return table


@cache
def _cross_tables(length: int) -> tuple[FloatArray, FloatArray]:
    """Where the product of two coefficients goes: (length^2, length) and (length^2, length-1).

    The terms ``(jw)^a`` and ``conj (jw)^b`` make ``j^(a-b) w^(a+b)``: real for even ``a - b``, with the sign
    ``(-1)^((a-b)/2)`` and the power ``x^((a+b)/2)``; else j times ``(-1)^((a-b-1)/2) w x^((a+b-1)/2)``.
    """
    power = np.arange(length)[::-1]
    a, b = (m.ravel() for m in np.meshgrid(power, power, indexing="ij"))
    odd = (a - b) % 2
    sign = 1.0 - 2.0 * (((a - b - odd) // 2) % 2)
    place = (a + b - odd) // 2
    real, imaginary = np.zeros((a.size, length)), np.zeros((a.size, length))
    rows = np.arange(a.size)
    real[rows, length - 1 - place] = sign * (1 - odd)
    imaginary[rows, length - 1 - place] = sign * odd
    return real, imaginary[:, 1:]


def with_roots(roots: ComplexArray) -> FloatArray:
    """Monic polynomial (*G, n+1) with the roots (*G, n), complex ones in conjugate pairs."""
    result = np.zeros((*roots.shape[:-1], roots.shape[-1] + 1), dtype=complex)
    result[..., 0] = 1.0
    for i in range(roots.shape[-1]):
        result[..., 1 : i + 2] -= roots[..., i : i + 1] * result[..., : i + 1]
    return result.real


def leading_zeros(p: FloatArray) -> IntArray:
    """How many leading coefficients are exactly zero, (*G,); all of them for the zero polynomial."""
    nonzero = p != 0.0
    return np.asarray(np.where(nonzero.any(axis=-1), nonzero.argmax(axis=-1), p.shape[-1]))


def roots(p: FloatArray) -> ComplexArray:
    """All roots of (*G, n+1), (*G, n), nan padded where the degree is less than n.

    Eigenvalues of companion matrices, balanced by LAPACK. Coefficients that are exactly zero at either
    end lower the degree or give roots that are exactly zero; nothing else is rounded away: whoever made
    the polynomial knows which of its coefficients are only noise. Points are solved together with all
    others of their degree. The zero polynomial has no roots here.
    """
    n = p.shape[-1] - 1
    rows = p.reshape(-1, n + 1)
    result = np.full((rows.shape[0], n), complex(np.nan, np.nan))
    head, tail = leading_zeros(rows), leading_zeros(rows[:, ::-1])
    kinds = np.where(head <= n, head * (n + 1) + tail, -1)
    for kind in set(kinds.tolist()) - {-1}:
        h, t = divmod(kind, n + 1)
        members = kinds == kind
        result[members, : n - h - t] = _nonzero_roots(rows[members, h : n + 1 - t])
        result[members, n - h - t : n - h] = 0.0
    return result.reshape(*p.shape[:-1], n)


def _nonzero_roots(p: FloatArray) -> ComplexArray:
    """Roots of (N, m+1) whose first and last coefficients are not zero."""
    m = p.shape[-1] - 1
    if m == 0:
        return np.zeros((p.shape[0], 0), dtype=complex)
    scale = nearby_power_of_two(np.max(np.abs(p[:, 1:] / p[:, :1]) ** (1.0 / np.arange(1, m + 1)), axis=-1))
    scaled = p / p[:, :1] / scale[:, None] ** np.arange(m + 1)
    companion = np.zeros((p.shape[0], m, m))
    companion[:, np.arange(1, m), np.arange(m - 1)] = 1.0
    companion[:, 0, :] = -scaled[:, 1:]
    values: ComplexArray = np.linalg.eigvals(companion).astype(complex)
    return values * scale[:, None]


def nearby_power_of_two(size: FloatArray) -> FloatArray:
    """Power of two next to each size > 0, so that to scale by it rounds nothing; 1 for 0."""
    return np.exp2(np.round(np.log2(np.where(size > 0.0, size, 1.0))))
