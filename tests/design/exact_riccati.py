"""A judge that shares nothing with numpy's linear algebra: Newton's method in 60 decimal digits.

It starts from the solution under test, goes to convergence, and proves by a Lyapunov equation and a Cholesky
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
    """Exact K and X for the matrices as they are in binary; R must be diagonal."""
    with localcontext() as context:
        context.prec = DIGITS
        return _solve(_decimals(A), _decimals(B), _decimals(Q), _decimals(np.diag(R)), _decimals(X))


def _solve(A: ObjectArray, B: ObjectArray, Q: ObjectArray, r: ObjectArray, X: ObjectArray) -> ExactSolution:
    G = (B / r) @ B.T
    n = len(A)
    change = Decimal(1)
    for _ in range(40):
        error = A.T @ X + X @ A - X @ G @ X + Q
        step = _lyapunov(A - G @ X, error)
        X = X - step
        change = max(abs(v) for v in step.ravel()) / max(abs(v) for v in X.ravel())
        if change < Decimal(10) ** -40:
            break
    P = _lyapunov(A - G @ X, _decimals(-np.eye(n)))
    return ExactSolution(
        ((B / r).T @ X).astype(float), X.astype(float), change < Decimal(10) ** -30 and _positive_definite(P)
    )


def _decimals(matrix: FloatArray) -> ObjectArray:
    return np.vectorize(lambda v: Decimal(float(v)), otypes=[object])(matrix)


def _lyapunov(Ac: ObjectArray, right: ObjectArray) -> ObjectArray:
    """D with ``Ac'D + D Ac = right`` from the n(n+1)/2 equations of its upper triangle, written out."""
    n = len(Ac)
    pairs = [(i, j) for i in range(n) for j in range(i, n)]
    place = {pair: k for k, pair in enumerate(pairs)} | {(j, i): k for k, (i, j) in enumerate(pairs)}
    matrix = np.full((len(pairs), len(pairs)), Decimal(0), dtype=object)
    for row, (i, j) in enumerate(pairs):
        for k in range(n):
            matrix[row, place[k, j]] += Ac[k, i]
            matrix[row, place[i, k]] += Ac[k, j]
    unknowns = _gauss(matrix, np.array([right[i, j] for i, j in pairs], dtype=object))
    return np.array([[unknowns[place[i, j]] for j in range(n)] for i in range(n)], dtype=object)


def _gauss(matrix: ObjectArray, right: ObjectArray) -> ObjectArray:
    matrix, right = matrix.copy(), right.copy()
    for c in range(len(matrix)):
        pivot = max(range(c, len(matrix)), key=lambda k: abs(matrix[k, c]))
        matrix[[c, pivot]], right[[c, pivot]] = matrix[[pivot, c]], right[[pivot, c]]
        factor = matrix[c + 1 :, c] / matrix[c, c]
        matrix[c + 1 :, c:] -= factor[:, None] * matrix[c, c:]
        right[c + 1 :] -= factor * right[c]
    for c in range(len(matrix) - 1, -1, -1):
        right[c] = (right[c] - sum(matrix[c, c + 1 :] * right[c + 1 :], Decimal(0))) / matrix[c, c]
    return right


def _positive_definite(P: ObjectArray) -> bool:
    P = P.copy()
    for c in range(len(P)):
        if P[c, c] <= 0:
            return False
        P[c + 1 :, c + 1 :] -= np.outer(P[c + 1 :, c], P[c, c + 1 :]) / P[c, c]
    return True
