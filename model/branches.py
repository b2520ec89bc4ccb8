"""Branches through lists of eigenvalues: which of the next list continues which of this one."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import linear_sum_assignment

from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: Up to so many assignments, it takes less time to search for each than to look whether they are simple.
MANY = 12


def continuous_branches(values: ComplexArray) -> ComplexArray:
    """Branches (N, n, K) through lists of eigenvalues (N, K, n), numbered by their places in the first list."""
    N, K, n = values.shape
    # As `take_along_axis` does, in a third of the time.
    flat = branch_places(values) + n * np.arange(N * K).reshape(N, K, 1)
    return np.swapaxes(values.reshape(-1)[flat], 1, 2)


def branch_places(values: ComplexArray) -> IntArray:
    """Where each branch lies in each list: (N, K, n) gives places (N, K, n), in the order of the first list.

    The products of the matchings of `successors`. Where two poles meet, either continuation of each is as
    continuous as the other; the lists are then followed in their own order, so that sorted lists give branches
    that do not depend on rounding.
    """
    N, K, n = values.shape
    rows, lists, follows = _changes(values)
    # How many changes of places lie before each list; the i-th ones of all rows are composed at once.
    before = np.zeros((N, K), dtype=np.int64)
    before[rows, lists + 1] = 1
    np.cumsum(before, axis=-1, out=before)
    turn = before[rows, lists + 1]
    order = np.argsort(turn, kind="stable")
    ends = np.cumsum(np.bincount(turn, minlength=1)).tolist()
    place = np.empty((len(ends), N, n), dtype=np.int64)
    place[0] = np.arange(n)
    for i, (first, last) in enumerate(itertools.pairwise(ends)):
        these = order[first:last]
        row = rows[these]
        place[i + 1] = place[i]
        place[i + 1, row] = follows[these[:, None], place[i, row]]
    return place[before, np.arange(N)[:, None]]


def successors(values: ComplexArray) -> IntArray:
    """Which of the next list continues each of this one: (N, K, n) gives places (N, K-1, n).

    Every eigenvalue goes to its nearest. Where that sends two to one place, the assignment of least total
    squared distance is found exactly (squares, so that real poles never overtake each other). All pairs of
    neighbours are matched at once.
    """
    N, K, n = values.shape
    result = np.empty((N, K - 1, n), dtype=np.int64)
    result[...] = np.arange(n)
    rows, lists, follows = _changes(values)
    result[rows, lists] = follows
    return result


def _changes(values: ComplexArray) -> tuple[IntArray, IntArray, IntArray]:
    """The successors that are not in their places: rows (L,), lists (L,) in their order, and places (L, n)."""
    rows, lists = np.nonzero(~_in_place(values))
    follows = continuations(values[rows, lists], values[rows, lists + 1])
    changed = np.any(follows != np.arange(values.shape[-1]), axis=-1)
    return rows[changed], lists[changed], follows[changed]


def continuations(before: ComplexArray, after: ComplexArray) -> IntArray:
    """Places in `after` (L, n) of what continues the values `before` (L, n); see `successors`."""
    apart = before[:, :, None] - after[:, None, :]
    squared = apart.real**2 + apart.imag**2
    follows: IntArray = squared.argmin(axis=-1)
    contested = ~_is_permutation(follows)
    if contested.any():
        follows[contested] = _assignments(squared[contested])
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
    for i in range(1, len(s)):
        apart = s[i] - s[:i]
        squared = apart.real**2 + apart.imag**2
        squared.min(axis=0, out=gaps[i])
        np.minimum(gaps[:i], squared, out=gaps[:i])
    return gaps


def _is_permutation(follows: IntArray) -> BoolArray:
    """Mask (...) of the rows (..., n) in which each of 0 .. n-1 occurs."""
    return np.asarray(np.bitwise_or.reduce(1 << follows, axis=-1) == (1 << follows.shape[-1]) - 1)


def _assignments(squared: FloatArray) -> IntArray:
    """Permutations (C, n) of least total cost (C, n, n); of equal ones, the ones that keep the order."""
    C, n, _ = squared.shape
    place = np.arange(n)
    cost = squared + 1e-12 * squared.max(axis=(1, 2))[:, None, None] * (place[:, None] - place) ** 2
    follows, least = _second_choices(cost) if C > MANY else (np.empty((C, n), dtype=np.int64), np.zeros(C, dtype=bool))
    for i in np.flatnonzero(~least):
        follows[i] = linear_sum_assignment(cost[i])[1]
    return follows


def _second_choices(cost: FloatArray) -> tuple[IntArray, BoolArray]:
    """Nearest places (C, n) by the cost (C, n, n), second ones where two want one; and which (C,) cost least of all.

    Where two rows want one place and the one that loses less by going elsewhere goes to the only place left free,
    this is the least: no assignment costs less than all rows' first choices and that loss.
    """
    C, n, _ = cost.shape
    place, rows = np.arange(n), np.arange(C)
    follows: IntArray = cost.argmin(axis=-1)
    chosen = follows[:, :, None] == place
    wanted = chosen.sum(axis=1)
    instead = np.where(chosen, np.inf, cost)
    loss = instead.min(axis=-1) - cost.min(axis=-1)
    contested = follows == wanted.argmax(axis=-1)[:, None]
    loser = np.where(contested, loss, np.inf).argmin(axis=-1)
    free = wanted.argmin(axis=-1)
    least = ((wanted == 0).sum(axis=-1) == 1) & (instead[rows, loser].argmin(axis=-1) == free)
    follows[rows[least], loser[least]] = free[least]
    return follows, least
