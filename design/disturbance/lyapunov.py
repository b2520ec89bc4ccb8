"""Gramians of a stable linear system over a batch, and how far rounding can have moved what is read off them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from design.disturbance.open_parts import Matrices
from design.lqr.balance import balance_exponents
from design.lqr.hamiltonian import solve_or_nan
from model.arrays import FloatArray, GridArrays, IntArray


@dataclass(frozen=True, eq=False)
class Variances(GridArrays):
    """Integrals of squared impulse responses (N, o, p), and a bound of their error by rounding (N, o, p)."""

    value: FloatArray
    error: FloatArray


def variances(system: Matrices) -> Variances:
    """``int_0^inf (c_i exp(A t) b_j)^2 dt`` for every output i and input j, D left out.

    With ``A P + P A' + b b' = 0`` it is ``c P c'``; with ``A'Q + Q A + c'c = 0`` it is ``b'Q b``. Both equations are
    solved, in states balanced by powers of two. When ``A P + P A' + b b' = E`` is what is left of the first, the
    integral is ``c P c' + tr(Q E)`` exactly: that corrects it, and bounds what the rounding of E hides.

    Parameters
    ----------
    system : finite matrices (N, ...), A stable

    Returns
    -------
    Variances; nan where the equations are singular to working precision
    """
    system = balanced(system)
    A, B, C = system.A, system.B, system.C
    rounding = (A.shape[-1] + 3.0) * np.finfo(float).eps
    reached, seen = _outer(B.mT), _outer(C)
    P, Q = _solution(A, reached), _solution(A.mT, seen)
    left = A[:, None] @ P
    rest = left + left.mT + reached
    terms = np.abs(A)[:, None] @ np.abs(P)
    terms = terms + terms.mT + np.abs(reached)
    value = _pairs(seen, P) + _pairs(Q, rest)
    error = _pairs(np.abs(Q), np.abs(rest) + rounding * terms) + rounding * _pairs(np.abs(seen), np.abs(P))
    # A Gramian that rounding has moved far bounds nothing: the two ways must agree.
    return Variances(value, np.maximum(error, np.abs(value - _pairs(Q, reached))))


def balanced(system: Matrices) -> Matrices:
    """The systems (N, ...) in states scaled by powers of two, so that inputs reach them and outputs see them alike."""
    tau = balance_exponents(system.A, system.B, system.C.mT @ system.C)[:, : system.A.shape[-1]]
    row, column = tau[:, :, None], tau[:, None, :]
    return Matrices(np.ldexp(system.A, column - row), np.ldexp(system.B, -row), np.ldexp(system.C, column), system.D)


def observability_gramians(A: FloatArray, C: FloatArray) -> FloatArray:
    """Q (N, o, n, n) of ``A'Q + Q A + c'c = 0`` for each row c of C (N, o, n), A (N, n, n) stable and balanced."""
    return _solution(A.mT, _outer(C))


def _outer(vectors: FloatArray) -> FloatArray:
    """``v v'`` (N, k, n, n) of vectors (N, k, n)."""
    return np.asarray(vectors[..., :, None] * vectors[..., None, :])


def _pairs(left: FloatArray, right: FloatArray) -> FloatArray:
    """``tr(left_i right_j)`` (N, o, p) of symmetric matrices (N, o, n, n) and (N, p, n, n)."""
    first, second = (matrix.reshape(*matrix.shape[:2], left.shape[-1] ** 2) for matrix in (left, right))
    return np.asarray(first @ second.mT)


def _solution(A: FloatArray, right: FloatArray) -> FloatArray:
    """X (N, k, n, n) of ``A X + X A' = -right``, symmetric matrices packed to n (n + 1) / 2 numbers."""
    n = A.shape[-1]
    rows, columns, unpack, operator = _packing(n)
    matrix = (A.reshape(-1, n * n) @ operator).reshape(-1, rows.size, rows.size)
    packed = solve_or_nan(matrix, np.ascontiguousarray(-right[..., rows, columns].mT))
    return packed.mT[..., unpack]


@lru_cache(maxsize=16)
def _packing(n: int) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
    """Packing of symmetric matrices, and the map from A to the matrix of ``X -> A X + X A'`` on it.

    Returns
    -------
    rows, columns (q,) of the upper triangle; unpack (n, n) the place of each entry; operator (n n, q q)
    """
    rows, columns = np.triu_indices(n)
    unpack = np.zeros((n, n), dtype=np.int64)
    unpack[rows, columns] = unpack[columns, rows] = np.arange(rows.size)
    operator = np.zeros((n, n, rows.size, rows.size))
    for equation, (i, j) in enumerate(zip(rows, columns, strict=True)):
        for k in range(n):
            operator[i, k, equation, unpack[k, j]] += 1.0
            operator[j, k, equation, unpack[i, k]] += 1.0
    return rows, columns, unpack, operator.reshape(n * n, -1)
