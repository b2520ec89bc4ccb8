"""One Lyapunov matrix for many closed loops: the semidefinite programme, assembled by hand for clarabel.

    maximise t    so that    A_k' X + X A_k + 2 alpha X + t I <= 0  for all k,    X <= I

in coordinates in which the answer is not far from the identity. X needs no lower bound: where ``A_k + alpha I`` is
stable a negative left-hand side makes X positive, and where none is the answer is t <= 0. A symmetric matrix is the
vector of its upper triangle, column by column, off-diagonal entries times ``sqrt(2)``, as clarabel wants it.
"""

from __future__ import annotations

from functools import lru_cache

import clarabel
import numpy as np
from scipy import sparse

from model.arrays import FloatArray, IntArray

#: The verdict is not the solver's: it need not be more accurate than this.
TOLERANCE = 1e-6
MOST_ITERATIONS = 60


def best_lyapunov(A: FloatArray, alpha: float) -> FloatArray | None:
    """X (n, n), symmetric, that makes ``A_k' X + X A_k + 2 alpha X`` most negative at the worst of all k.

    Nothing is promised of it: whoever asks must look what it proves. None where the solver has no answer at all.

    Parameters
    ----------
    A : (K, n, n) in balanced coordinates [1/s]
    alpha : decay rate asked for [1/s]
    """
    n = A.shape[-1]
    basis, pick = symmetric_basis(n)
    m = len(basis)
    shifted = A + alpha * np.eye(n)
    scale = max(float(np.max(np.abs(shifted))), np.finfo(float).tiny)
    half = np.einsum("jab,kbc->kjac", basis, shifted / scale)
    rows = upper_triangles(half + np.swapaxes(half, -1, -2), pick)  # (K, m, m): unknown, then entry
    count = len(A) * m
    matrix = np.zeros((count + m, m + 1))
    matrix[:count, :m] = np.swapaxes(rows, -1, -2).reshape(count, m)
    matrix[:count, m] = np.tile(upper_triangles(np.eye(n), pick), len(A))
    matrix[count:, :m] = np.eye(m)
    bound = np.concatenate([np.zeros(count), upper_triangles(np.eye(n), pick)])
    cost = np.zeros(m + 1)
    cost[m] = -1.0
    cones = [clarabel.PSDTriangleConeT(n)] * (len(A) + 1)
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((m + 1, m + 1)), cost, sparse.csc_matrix(matrix), bound, cones, solver_settings()
    )
    x = np.array(solver.solve().x)
    return np.einsum("j,jab->ab", x[:m], basis) if x.size == m + 1 and np.all(np.isfinite(x)) else None


def solver_settings() -> clarabel.DefaultSettings:
    """As quiet and as accurate as the verdict, which is another's, asks for."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = MOST_ITERATIONS
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    return settings


@lru_cache(maxsize=32)
def symmetric_basis(n: int) -> tuple[FloatArray, tuple[IntArray, IntArray]]:
    """Orthonormal basis (m, n, n) of the symmetric matrices, and rows and columns of their upper triangle."""
    columns, rows = np.tril_indices(n)
    basis = np.zeros((len(rows), n, n))
    k = np.arange(len(rows))
    basis[k, rows, columns] = basis[k, columns, rows] = np.where(rows == columns, 1.0, np.sqrt(0.5))
    return basis, (np.asarray(rows, dtype=np.int64), np.asarray(columns, dtype=np.int64))


def upper_triangles(matrix: FloatArray, pick: tuple[IntArray, IntArray]) -> FloatArray:
    """Upper triangles (..., m) of symmetric matrices (..., n, n)."""
    rows, columns = pick
    return np.asarray(matrix[..., rows, columns] * np.where(rows == columns, 1.0, np.sqrt(2.0)))
