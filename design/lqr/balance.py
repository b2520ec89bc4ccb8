"""Balancing of Riccati equations by powers of two (Osborne 1960), batched.

States in mixed units and weights decades apart make the Hamiltonian ``H = [A -G; -Q -A']`` badly scaled.
Scaling the states by powers of two brings its rows and columns to like size without any rounding.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, IntArray

#: Sweeps at most; each one about halves what is left, and 1e160 is 2^531.
MAX_SWEEPS = 24
#: Rows and columns within a factor of 16 of each other are balanced [log2].
BALANCED = 4.0


def balance_exponents(A: FloatArray, F: FloatArray, Q: FloatArray) -> IntArray:
    """Scaling ``x = 2^tau x'`` that balances the rows and columns of the Hamiltonian, ``G = F F'``.

    Works on logarithms in the largest-entry norm, so no product can overflow. A point stops moving
    when it is balanced, so its scaling does not depend on its neighbours in the batch.

    Parameters
    ----------
    A (N, n, n), F (N, n, m), Q (N, n, n) : finite

    Returns
    -------
    (N, n + 1) integers: tau, then the binary exponent of the largest entry of the balanced H
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        h = _log2_hamiltonian(A, F, Q)
        d, columns = _levelled(h)
        poles = np.log2(np.abs(np.diagonal(A, axis1=1, axis2=2)).max(axis=1))
    size = np.maximum(columns.max(axis=0), poles)
    size[~np.isfinite(size)] = 0.0
    n = A.shape[-1]
    return np.asarray(np.rint(np.concatenate([d[:n], size[None]])).T, dtype=np.int64)


def _levelled(h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Exponents (2n, N) of states and costates, and log2 of the largest entry of each column under them."""
    n = len(h) // 2
    d = np.zeros((2 * n, h.shape[-1]))
    columns = np.max(h, axis=0)
    # The row of state i has the entries of the column of its costate n + i; zero ones cannot be balanced.
    scalable = np.isfinite(columns[n:] - columns[:n])
    for _ in range(MAX_SWEEPS):
        gap = np.where(scalable, columns[n:] - columns[:n], 0.0)
        moving = np.abs(gap).max(axis=0) > BALANCED
        if not moving.any():
            break
        # A quarter, as all the states move at once: half would overshoot where they are coupled.
        step = 0.25 * gap * moving
        d[:n] += step
        d[n:] -= step
        columns = np.max(h - d[:, None], axis=0) + d
    return d, columns


def _log2_hamiltonian(A: FloatArray, F: FloatArray, Q: FloatArray) -> FloatArray:
    """log2 |H| (2n, 2n, N) without the diagonal of A, which no scaling moves; -inf where H is zero.

    The points come last, where maxima over rows are several times faster.
    """
    n = A.shape[-1]
    size = np.frexp(np.max(np.abs(F), axis=(-2, -1), initial=0.0, keepdims=True))[1]
    F = np.ldexp(F, -size)
    H = np.empty((len(A), 2 * n, 2 * n))
    H[:, :n, :n] = A
    H[:, :n, n:] = F @ F.mT
    H[:, n:, :n] = Q
    H[:, n:, n:] = A.mT
    diagonal = np.arange(2 * n)
    H[:, diagonal, diagonal] = 0.0
    h = np.abs(H.transpose(1, 2, 0), order="C")
    np.log2(h, out=h)
    h[:n, n:] += 2 * size[:, 0, 0]
    return h
