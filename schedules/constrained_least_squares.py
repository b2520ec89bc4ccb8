"""Least squares under linear inequalities, for the small sparse problems of a table of gains."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import splu

from model.arrays import FloatArray

_ROUNDS = 300
#: Weight of the inequalities while they are settled, and how far each round goes beyond its own answer.
_PENALTY, _RELAXATION = 10.0, 1.6
_TOLERANCE = 1e-7


def constrained_least_squares(
    M: csr_array, target: FloatArray, C: csr_array, lower: FloatArray, upper: FloatArray, stay: float
) -> FloatArray:
    """Minimise ``|M x - target|^2 + stay |x|^2`` subject to ``lower <= C x <= upper``.

    By the alternating direction method of multipliers, in the form of Stellato et al. (OSQP, 2020): one
    factorisation, then only products. The inequalities hold to about 1e-4 of the size of x, or less well where they
    contradict each other: what comes out is then a compromise, and must be looked at.

    Parameters
    ----------
    M : (k, n); target : (k,)
    C : (c, n), rows of about equal size; lower, upper : (c,), infinite where there is no bound
    stay : weight that holds x near zero where nothing else decides, positive

    Returns
    -------
    x : (n,)
    """
    n = M.shape[1]
    back = csr_array(C.T)
    normal = M.T @ M + stay * eye_array(n) + _PENALTY * (back @ C)
    factors = splu(normal.tocsc())
    pull = M.T @ target
    bounded, price = np.clip(np.zeros(C.shape[0]), lower, upper), np.zeros(C.shape[0])
    x = np.zeros(n)
    for _ in range(_ROUNDS):
        x = factors.solve(pull + back @ (_PENALTY * bounded - price))
        along = C @ x
        relaxed = _RELAXATION * along + (1.0 - _RELAXATION) * bounded
        before, bounded = bounded, np.clip(relaxed + price / _PENALTY, lower, upper)
        price = price + _PENALTY * (relaxed - bounded)
        if max(np.max(np.abs(along - bounded)), np.max(np.abs(bounded - before))) < _TOLERANCE:
            break
    return np.asarray(x)
