"""Lyapunov and Stein equations with symmetric solutions, batched: one linear system over the upper triangle each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from design.lqr.hamiltonian import solve_or_nan
from model.arrays import FloatArray, IntArray

#: Numbers that the linear systems of one go may hold; more points than that are solved in turn.
CHUNK = 1_000_000


@dataclass(frozen=True, eq=False)
class SymmetricPacking:
    """Where the entries of symmetric matrices stand in vectors of their upper triangle, p = n (n + 1) / 2.

    Attributes
    ----------
    rows, columns : (p,) of the entries of the triangle
    upper : (p,) position of each entry of the triangle in the flattened matrix
    whole : (n n,) position in the vector of each entry of the flattened matrix
    diagonal : (n,) position in the vector of the diagonal
    """

    rows: IntArray
    columns: IntArray
    upper: IntArray
    whole: IntArray
    diagonal: IntArray


@lru_cache(maxsize=16)
def symmetric_packing(n: int) -> SymmetricPacking:
    """The packing of symmetric n x n matrices, made once."""
    rows, columns = np.triu_indices(n)
    place = np.zeros((n, n), dtype=np.int64)
    place[rows, columns] = place[columns, rows] = np.arange(len(rows))
    return SymmetricPacking(rows, columns, rows * n + columns, place.ravel(), np.diagonal(place).copy())


@lru_cache(maxsize=16)
def _lyapunov_terms(n: int) -> IntArray:
    """Positions (2, p p) in a flattened Ac with a zero appended: the matrix of ``D -> Ac'D + D Ac`` is their sum."""
    packing = symmetric_packing(n)
    i, j, place = packing.rows, packing.columns, packing.whole.reshape(n, n)
    p = len(i)
    # (Ac'D + D Ac)_ij = sum over k of Ac_ki D_kj + Ac_kj D_ik; each of the two has every entry of D once at most.
    terms = np.full((2, p, p), n * n)
    equation, k = np.arange(p)[:, None], np.arange(n)
    terms[0, equation, place[j]] = k * n + i[:, None]
    terms[1, equation, place[i]] = k * n + j[:, None]
    return terms.reshape(2, -1)


@lru_cache(maxsize=16)
def _stein_terms(n: int) -> IntArray:
    """Positions (4, p p) in a flattened Ac: ``a b + c d`` is the matrix of ``D -> Ac'D Ac``, D's diagonal doubled."""
    packing = symmetric_packing(n)
    i, j, k, m = packing.rows[:, None], packing.columns[:, None], packing.rows, packing.columns
    # (Ac'D Ac)_ij = sum over k <= m of D_km (Ac_ki Ac_mj + Ac_mi Ac_kj), for k = m half of it.
    return np.array([k * n + i, m * n + j, m * n + i, k * n + j]).reshape(4, -1)


def solve_lyapunov(Ac: FloatArray, full: FloatArray, diagonal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Symmetric D and P (N, n, n) with ``Ac'D + D Ac = full``, ``Ac'P + P Ac = diag(diagonal)``; nan where singular.

    Parameters
    ----------
    Ac (N, n, n), full (N, n, n) symmetric, diagonal (N, n)
    """
    return _solved(lyapunov_operator, Ac, full, diagonal)


def solve_stein(Ac: FloatArray, full: FloatArray, diagonal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Symmetric D and P (N, n, n) with ``Ac'D Ac - D = full``, ``Ac'P Ac - P = diag(diagonal)``; nan where singular.

    Parameters
    ----------
    Ac (N, n, n), full (N, n, n) symmetric, diagonal (N, n)
    """
    return _solved(stein_operator, Ac, full, diagonal)


def lyapunov_operator(Ac: FloatArray) -> FloatArray:
    """Matrix (N, p, p) of ``D -> Ac'D + D Ac`` over the upper triangle of D, Ac (N, n, n)."""
    n = Ac.shape[-1]
    p = n * (n + 1) // 2
    entries = np.zeros((len(Ac), n * n + 1))
    entries[:, :-1] = Ac.reshape(-1, n * n)
    one, other = _lyapunov_terms(n)
    return np.asarray((entries.take(one, axis=1) + entries.take(other, axis=1)).reshape(-1, p, p))


def stein_operator(Ac: FloatArray) -> FloatArray:
    """Matrix (N, p, p) of ``D -> Ac'D Ac - D`` over the upper triangle of D, Ac (N, n, n)."""
    n = Ac.shape[-1]
    packing = symmetric_packing(n)
    p = len(packing.upper)
    a, b, c, d = (Ac.reshape(-1, n * n).take(index, axis=1) for index in _stein_terms(n))
    operator = (a * b + c * d).reshape(-1, p, p)
    operator[:, :, packing.diagonal] *= 0.5
    operator[:, np.arange(p), np.arange(p)] -= 1.0
    return np.asarray(operator)


def _solved(
    operator: Callable[[FloatArray], FloatArray], Ac: FloatArray, full: FloatArray, diagonal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The two symmetric matrices that an operator sends to `full` and to the diagonal one."""
    points, n, _ = Ac.shape
    packing = symmetric_packing(n)
    p = len(packing.upper)
    right = np.zeros((points, p, 2))
    right[:, :, 0] = full.reshape(-1, n * n).take(packing.upper, axis=1)
    right[:, packing.diagonal, 1] = diagonal
    step = max(1, CHUNK // p**2)
    if points > step:
        parts = [slice(k, k + step) for k in range(0, points, step)]
        both = np.concatenate([solve_or_nan(operator(Ac[part]), right[part]) for part in parts])
    else:
        both = solve_or_nan(operator(Ac), right)
    D, P = (both[:, :, k].take(packing.whole, axis=1).reshape(-1, n, n) for k in (0, 1))
    return D, P
