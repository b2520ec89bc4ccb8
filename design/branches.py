"""Branches through lists of eigenvalues: which of the next list continues which of this one."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray


def continuous_branches(values: ComplexArray) -> ComplexArray:
    """Branches (N, n, K) through lists of eigenvalues (N, K, n), numbered by their places in the first list.

    The products of the matchings of `successors`. Where two poles meet, either continuation of each is as
    continuous as the other; the lists are then followed in their own order, so that sorted lists give branches
    that do not depend on rounding.
    """
    N, K, n = values.shape
    follows = successors(values)
    moved = np.any(follows != np.arange(n), axis=(0, 2))
    place = np.broadcast_to(np.arange(n), (N, n))
    places = np.empty((N, K, n), dtype=np.int64)
    places[:, 0] = place
    for k in range(K - 1):
        if moved[k]:
            place = np.take_along_axis(follows[:, k], place, axis=-1)
        places[:, k + 1] = place
    return np.swapaxes(np.take_along_axis(values, places, axis=-1), 1, 2)


def successors(values: ComplexArray) -> IntArray:
    """Which of the next list continues each of this one: (N, K, n) gives places (N, K-1, n).

    Every eigenvalue goes to its nearest. Where that sends two to one place, the assignment of least total
    squared distance is found exactly (squares, so that real poles never overtake each other). All pairs of
    neighbours are matched at once.
    """
    apart = values[:, :-1, :, None] - values[:, 1:, None, :]
    squared = apart.real**2 + apart.imag**2
    follows: IntArray = squared.argmin(axis=-1)
    for index in np.argwhere(~_is_permutation(follows)):
        at = tuple(index)
        follows[at] = _assignment(squared[at])
    return follows


def _is_permutation(follows: IntArray) -> BoolArray:
    """Mask (...) of the rows (..., n) in which each of 0 .. n-1 occurs."""
    return np.asarray(np.bitwise_or.reduce(1 << follows, axis=-1) == (1 << follows.shape[-1]) - 1)


def _assignment(squared: FloatArray) -> IntArray:
    """Permutation of least total cost (n, n); of equal ones, the one that keeps the order."""
    order = np.arange(len(squared))
    bias = 1e-12 * squared.max() * (order[:, None] - order) ** 2
    return np.asarray(linear_sum_assignment(squared + bias)[1])
