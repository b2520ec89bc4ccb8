"""How far a candidate may be from the solution of its Riccati equation: the sizes that the proofs are made of."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray

#: Rounding error of a sum of products, in units of the sum of their magnitudes.
ROUNDING = 16 * float(np.finfo(float).eps)


def norm(matrix: FloatArray) -> FloatArray:
    """Frobenius norm (N,)."""
    entries = matrix.reshape(len(matrix), matrix.shape[1] * matrix.shape[2])
    return np.asarray(np.sqrt(np.vecdot(entries, entries)))


def doubt_of(G: FloatArray, P: FloatArray, bound: FloatArray) -> FloatArray:
    """``trace(W^-1 P) trace(G P)`` (N,), W the diagonal `bound` (N, n); inf where P is not positive.

    P solves a Lyapunov or Stein equation with -W, and is positive definite exactly where the closed loop is stable,
    which is seen by its poles; here a negative entry of the diagonal is enough.
    """
    diagonal = np.diagonal(P, axis1=-2, axis2=-1)
    trace = np.vecdot(G.reshape(len(G), G.shape[1] ** 2), P.reshape(len(P), P.shape[1] ** 2))
    doubt = np.sum(diagonal / bound, axis=-1) * trace
    return np.where(np.min(diagonal, axis=-1) > 0, doubt, np.inf)


def residual_bound(size: FloatArray, error: FloatArray) -> FloatArray:
    """Diagonal of W (N, n), positive, ``-W <= R(X) <= W``: row sums of the residual and of its rounding error.

    Parameters
    ----------
    size : (N, n, n) sums of the magnitudes of the terms that the residual is computed from
    error : (N, n, n) residual
    """
    bound = np.sum(np.abs(error) + ROUNDING * size, axis=2)
    # A state without any terms still needs a positive weight for P to be a Lyapunov function.
    floor = np.finfo(float).eps * np.max(bound, axis=1, keepdims=True) + np.finfo(float).tiny
    return np.asarray(bound + floor)
