"""Branches through lists of eigenvalues: which of the next list continues which of this one."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray


def continuous_branches(values: ComplexArray) -> ComplexArray:
    """Branches (N, n, K) through lists of eigenvalues (N, K, n), numbered by their places in the first list."""
    return np.swapaxes(np.take_along_axis(values, branch_places(values), axis=-1), 1, 2)


def branch_places(values: ComplexArray) -> IntArray:
    """Where each branch lies in each list: (N, K, n) gives places (N, K, n), in the order of the first list.

    The products of the matchings of `successors`. Where two poles meet, either continuation of each is as
    continuous as the other; the lists are then followed in their own order, so that sorted lists give branches
    that do not depend on rounding.
    """
    N, K, n = values.shape
    follows = successors(values)
    place = np.broadcast_to(np.arange(n), (N, n))
    places = np.empty((N, K, n), dtype=np.int64)
    done = 0
    for k in np.flatnonzero(np.any(follows != np.arange(n), axis=(0, 2))).tolist():
        places[:, done : k + 1] = place[:, None]
        place, done = np.take_along_axis(follows[:, k], place, axis=-1), k + 1
    places[:, done:] = place[:, None]
    return places


def successors(values: ComplexArray) -> IntArray:
    """Which of the next list continues each of this one: (N, K, n) gives places (N, K-1, n).

    Every eigenvalue goes to its nearest. Where that sends two to one place, the assignment of least total
    squared distance is found exactly (squares, so that real poles never overtake each other). All pairs of
    neighbours are matched at once.
    """
    N, K, n = values.shape
    follows = np.empty((N, K - 1, n), dtype=np.int64)
    follows[...] = np.arange(n)
    changed = ~_in_place(values)
    follows[changed] = continuations(values[:, :-1][changed], values[:, 1:][changed])
    return follows


def continuations(before: ComplexArray, after: ComplexArray) -> IntArray:
    """Places in `after` (L, n) of what continues the values `before` (L, n); see `successors`."""
    apart = before[:, :, None] - after[:, None, :]
    squared = apart.real**2 + apart.imag**2
    follows: IntArray = squared.argmin(axis=-1)
    for i in np.flatnonzero(~_is_permutation(follows)):
        follows[i] = _assignment(squared[i])
    return follows


def _in_place(values: ComplexArray) -> BoolArray:
    """Mask (N, K-1) of the pairs of lists in which each place is nearest to itself.

    It is where each moves by less than half its distance to the nearest other.
    """
    s = np.ascontiguousarray(np.moveaxis(values, -1, 0))
    step = s[:, :, 1:] - s[:, :, :-1]
    near = 4.0 * (step.real**2 + step.imag**2) < squared_gaps(s)[:, :, :-1]
    return np.asarray(near.all(axis=0))


def squared_gaps(s: ComplexArray) -> FloatArray:
    """``|s_i - s_j|^2`` to the nearest other along the first axis, the shape of s (n, ...); infinite for n = 1."""
    gaps = np.full(s.shape, np.inf)
    for i in range(len(s)):
        for j in range(i):
            apart = s[i] - s[j]
            squared = apart.real**2 + apart.imag**2
            np.minimum(gaps[i], squared, out=gaps[i])
            np.minimum(gaps[j], squared, out=gaps[j])
    return gaps


def _is_permutation(follows: IntArray) -> BoolArray:
    """Mask (...) of the rows (..., n) in which each of 0 .. n-1 occurs."""
    return np.asarray(np.bitwise_or.reduce(1 << follows, axis=-1) == (1 << follows.shape[-1]) - 1)


def _assignment(squared: FloatArray) -> IntArray:
    """Permutation of least total cost (n, n); of equal ones, the one that keeps the order."""
    order = np.arange(len(squared))
    bias = 1e-12 * squared.max() * (order[:, None] - order) ** 2
    return np.asarray(linear_sum_assignment(squared + bias)[1])
