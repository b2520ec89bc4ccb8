"""Arithmetic on batches of real polynomials.

A polynomial is the last axis of an array, highest power first as `numpy.poly` has it, so
``(*G, n+1)`` holds one polynomial of degree n at most for every grid point. Leading coefficients may
be zero: the degree may differ from point to point, and the arrays need not know.
"""

from __future__ import annotations

import numpy as np

from model.arrays import ComplexArray, FloatArray, IntArray


def product(p: FloatArray, q: FloatArray) -> FloatArray:
    """``p q``: (*G, a) and (*G, b) give (*G, a+b-1)."""
    if p.shape[-1] < q.shape[-1]:
        p, q = q, p
    shape = np.broadcast_shapes(p.shape[:-1], q.shape[:-1])
    result = np.zeros((*shape, p.shape[-1] + q.shape[-1] - 1))
    for i in range(q.shape[-1]):
        result[..., i : i + p.shape[-1]] += q[..., i : i + 1] * p
    return result


def total(p: FloatArray, q: FloatArray) -> FloatArray:
    """``p + q`` for different lengths: the constant terms are aligned."""
    if p.shape[-1] < q.shape[-1]:
        p, q = q, p
    shape = np.broadcast_shapes(p.shape[:-1], q.shape[:-1])
    result = np.zeros((*shape, p.shape[-1]))
    result[...] = p
    result[..., p.shape[-1] - q.shape[-1] :] += q
    return result


def derivative(p: FloatArray) -> FloatArray:
    """``dp/ds``: (*G, n+1) gives (*G, n); the derivative of a constant has no coefficients."""
    return p[..., :-1] * np.arange(p.shape[-1] - 1, 0, -1)


def evaluate(p: FloatArray, s: ComplexArray | FloatArray) -> ComplexArray | FloatArray:
    """Value of (*G, n+1) at (*G, m) points, (*G, m), by Horner's rule; real for real `s`."""
    result = np.zeros_like(s)
    for i in range(p.shape[-1]):
        result = result * s + p[..., i : i + 1]
    return result


def magnitude_bound(p: FloatArray, s: ComplexArray | FloatArray) -> FloatArray:
    """Sum of the magnitudes of the terms of `p` at `s`: what its value is small or large against."""
    return np.asarray(evaluate(np.abs(p), np.abs(s)))


def even_part(p: FloatArray) -> FloatArray:
    """E of ``p(jw) = E(x) + j w O(x)``, ``x = w^2``, as a polynomial in x."""
    return _alternating(p[..., ::-1][..., 0::2])


def odd_part(p: FloatArray) -> FloatArray:
    """O of ``p(jw) = E(x) + j w O(x)``, ``x = w^2``, as a polynomial in x."""
    return _alternating(p[..., ::-1][..., 1::2])


def squared_magnitude(p: FloatArray) -> FloatArray:
    """``|p(jw)|^2`` as a polynomial in ``x = w^2``: (*G, n+1) gives (*G, n+1)."""
    return real_cross(p, p)


def real_cross(p: FloatArray, q: FloatArray) -> FloatArray:
    """``Re(p(jw) conj q(jw))`` as a polynomial in ``x = w^2``; p and q (*G, n+1) give (*G, n+1)."""
    even = product(even_part(p), even_part(q))
    odd = product(odd_part(p), odd_part(q))
    shifted = np.concatenate([odd, np.zeros((*odd.shape[:-1], 1))], axis=-1)
    return total(even, shifted)


def imaginary_cross(p: FloatArray, q: FloatArray) -> FloatArray:
    """``Im(p(jw) conj q(jw)) / w`` as a polynomial in ``x = w^2``."""
    return total(product(odd_part(p), even_part(q)), -product(even_part(p), odd_part(q)))


def _alternating(ascending: FloatArray) -> FloatArray:
    signs = np.where(np.arange(ascending.shape[-1]) % 2 == 0, 1.0, -1.0)
    return (ascending * signs)[..., ::-1]


def leading_zeros(p: FloatArray) -> IntArray:
    """How many leading coefficients are exactly zero, (*G,); all of them for the zero polynomial."""
    nonzero = p != 0.0
    return np.where(nonzero.any(axis=-1), nonzero.argmax(axis=-1), p.shape[-1])


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
    for kind in np.unique(kinds[kinds >= 0]):
        h, t = divmod(int(kind), n + 1)
        members = kinds == kind
        found = _nonzero_roots(rows[members, h : n + 1 - t])
        result[members, : n - h - t] = found
        result[members, n - h - t : n - h] = 0.0
    return result.reshape(*p.shape[:-1], n)


def _nonzero_roots(p: FloatArray) -> ComplexArray:
    """Roots of (N, m+1) whose first and last coefficients are not zero."""
    m = p.shape[-1] - 1
    if m == 0:
        return np.zeros((p.shape[0], 0), dtype=complex)
    scale = power_of_two_scale(p)
    scaled = p / p[:, :1] / scale[:, None] ** np.arange(m + 1)
    companion = np.zeros((p.shape[0], m, m))
    companion[:, np.arange(1, m), np.arange(m - 1)] = 1.0
    companion[:, 0, :] = -scaled[:, 1:]
    return np.linalg.eigvals(companion).astype(complex) * scale[:, None]


def power_of_two_scale(p: FloatArray) -> FloatArray:
    """Power of two near the largest root of (*G, n+1) with a leading coefficient that is not zero, (*G,).

    ``max |p_k / p_0|^(1/k)`` is within a factor 2n of the largest root. A power of two, so that scaling
    rounds nothing; 1 when every root is zero.
    """
    degree = np.arange(1, p.shape[-1])
    largest = np.max(np.abs(p[..., 1:] / p[..., :1]) ** (1.0 / degree), axis=-1, initial=0.0)
    positive = np.where(largest > 0.0, largest, 1.0)
    return np.exp2(np.round(np.log2(positive)))
