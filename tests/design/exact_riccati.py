"""A judge that shares nothing with numpy's linear algebra: Newton's method in 60 decimal digits.

It starts from the solution under test, goes to convergence, and proves by a Lyapunov or Stein equation and a Cholesky
factorisation, all in decimals, whether what it converged to is the stabilising solution.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext

import numpy as np

from model.arrays import FloatArray, ObjectArray

DIGITS = 60


@dataclass(frozen=True)
class ExactSolution:
    """The stabilising solution next to a candidate: `stabilising` False when there is none."""

    K: FloatArray
    X: FloatArray
    stabilising: bool


def exact_solution(A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, X: FloatArray) -> ExactSolution:
    """Exact K and X of ``A'X + XA - XB R^-1 B'X + Q = 0`` for the matrices as they are in binary."""
    with localcontext() as context:
        context.prec = DIGITS
        A, B, Q, R, X = (_decimals(m) for m in (A, B, Q, R, X))
        gain = _solve(R, B.T)
        G = B @ gain
        change = Decimal(1)
        for _ in range(40):
            step = _lyapunov(A - G @ X, A.T @ X + X @ A - X @ G @ X + Q)
            X, change = X - step, _relative(step, X)
            if change < Decimal(10) ** -40:
                break
        P = _lyapunov(A - G @ X, _decimals(-np.eye(len(A))))
        settled = change < Decimal(10) ** -30
        return ExactSolution((gain @ X).astype(float), X.astype(float), settled and _positive_definite(P))


def exact_discrete_solution(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray, X: FloatArray
) -> ExactSolution:
    """Exact K and X of ``X = A'XA - (A'XB + N)(R + B'XB)^-1 (B'XA + N') + Q``, likewise."""
    with localcontext() as context:
        context.prec = DIGITS
        A, B, Q, R, N, X = (_decimals(m) for m in (A, B, Q, R, N, X))
        change = Decimal(1)
        for _ in range(60):
            K = _solve(R + B.T @ X @ B, B.T @ X @ A + N.T)
            step = _stein(A - B @ K, A.T @ X @ A - X - (A.T @ X @ B + N) @ K + Q)
            X, change = X - step, _relative(step, X)
            if change < Decimal(10) ** -40:
                break
        K = _solve(R + B.T @ X @ B, B.T @ X @ A + N.T)
        P = _stein(A - B @ K, _decimals(-np.eye(len(A))))
        settled = change < Decimal(10) ** -30
        return ExactSolution(K.astype(float), X.astype(float), settled and _positive_definite(P))


def _relative(step: ObjectArray, X: ObjectArray) -> Decimal:
    size = max(abs(v) for v in X.ravel())
    return max(abs(v) for v in step.ravel()) / size if size else Decimal(0)


def _decimals(matrix: FloatArray) -> ObjectArray:
    return np.vectorize(lambda v: Decimal(float(v)), otypes=[object])(matrix)


def _lyapunov(Ac: ObjectArray, right: ObjectArray) -> ObjectArray:
    """D with ``Ac'D + D Ac = right`` from the n(n+1)/2 equations of its upper triangle, written out."""
    n = len(Ac)
    pairs, place = _triangle(n)
    matrix = np.full((len(pairs), len(pairs)), Decimal(0), dtype=object)
    for row, (i, j) in enumerate(pairs):
        for k in range(n):
            matrix[row, place[k, j]] += Ac[k, i]
            matrix[row, place[i, k]] += Ac[k, j]
    return _symmetric_solution(matrix, right)


def _stein(Ac: ObjectArray, right: ObjectArray) -> ObjectArray:
    """D with ``Ac'D Ac - D = right``, likewise."""
    n = len(Ac)
    pairs, place = _triangle(n)
    matrix = np.full((len(pairs), len(pairs)), Decimal(0), dtype=object)
    for row, (i, j) in enumerate(pairs):
        matrix[row, row] -= 1
        for k in range(n):
            for m in range(n):
                matrix[row, place[k, m]] += Ac[k, i] * Ac[m, j]
    return _symmetric_solution(matrix, right)


def _triangle(n: int) -> tuple[list[tuple[int, int]], dict[tuple[int, int], int]]:
    pairs = [(i, j) for i in range(n) for j in range(i, n)]
    return pairs, {pair: k for k, pair in enumerate(pairs)} | {(j, i): k for k, (i, j) in enumerate(pairs)}


def _symmetric_solution(matrix: ObjectArray, right: ObjectArray) -> ObjectArray:
    n = len(right)
    pairs, place = _triangle(n)
    unknowns = _solve(matrix, np.array([[right[i, j]] for i, j in pairs], dtype=object))[:, 0]
    return np.array([[unknowns[place[i, j]] for j in range(n)] for i in range(n)], dtype=object)


def _solve(matrix: ObjectArray, right: ObjectArray) -> ObjectArray:
    """Gauss elimination with row pivoting."""
    matrix, right = matrix.copy(), right.copy()
    for c in range(len(matrix)):
        pivot = max(range(c, len(matrix)), key=lambda k: abs(matrix[k, c]))
        matrix[[c, pivot]], right[[c, pivot]] = matrix[[pivot, c]], right[[pivot, c]]
        factor = matrix[c + 1 :, c] / matrix[c, c]
        matrix[c + 1 :, c:] -= factor[:, None] * matrix[c, c:]
        right[c + 1 :] -= factor[:, None] * right[c]
    for c in range(len(matrix) - 1, -1, -1):
        right[c] = (right[c] - matrix[c, c + 1 :] @ right[c + 1 :]) / matrix[c, c]
    return right


def _positive_definite(P: ObjectArray) -> bool:
    P = P.copy()
    for c in range(len(P)):
        if P[c, c] <= 0:
            return False
        P[c + 1 :, c + 1 :] -= np.outer(P[c + 1 :, c], P[c, c + 1 :]) / P[c, c]
    return True
