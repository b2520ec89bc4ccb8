"""Stable invariant subspace of balanced Hamiltonian matrices, batched over the grid.

The stabilising solution of ``A'X + XA - XGX + Q = 0`` is ``U2 U1^-1``, where ``[U1; U2]`` spans the
stable invariant subspace of ``H = [A -G; -Q -A']`` (Potter 1966, Laub 1979). States in mixed units
and weights decades apart make H badly scaled, so everything is done in balanced coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

Matrices = TypeVar("Matrices", FloatArray, ComplexArray)

#: Sweeps of the balancing; each one halves what is left, and 1e160 is 2^531.
MAX_SWEEPS = 24
#: Rows and columns within a factor of 16 of each other are balanced [log2].
BALANCED = 4.0


@dataclass(frozen=True, eq=False)
class RiccatiEquation(GridArrays):
    """``A'X + XA - X F F' X + Q = 0`` in coordinates scaled by powers of two (no rounding).

    Attributes
    ----------
    A (N, n, n), F (N, n, m), Q (N, n, n) : the scaled equation
    state_exponent : (N, n) tau: ``x = 2^tau x'`` state by state
    time_exponent : (N,) k, even: time runs ``2^k`` times slower in the scaled equation
    """

    A: FloatArray
    F: FloatArray
    Q: FloatArray
    state_exponent: IntArray
    time_exponent: IntArray

    @cached_property
    def G(self) -> FloatArray:
        """``F F'`` (N, n, n)."""
        return np.asarray(self.F @ self.F.mT)

    def solution_in_states(self, X: FloatArray) -> FloatArray:
        """X (N, n, n) of the scaled equation, in the states' own units."""
        tau = self.state_exponent
        return np.ldexp(X, -(tau[:, :, None] + tau[:, None, :]))

    def feedback_in_states(self, X: FloatArray) -> FloatArray:
        """``F'X`` (N, m, n) of the scaled equation, in the states' own units."""
        exponent = self.time_exponent[:, None, None] // 2 - self.state_exponent[:, None, :]
        return np.ldexp(self.F.mT @ X, exponent)


def balance_exponents(A: FloatArray, F: FloatArray, Q: FloatArray) -> IntArray:
    """Scaling ``x = 2^tau x'`` that balances rows and columns of the Hamiltonian (Osborne 1960).

    Works on logarithms in the largest-entry norm, so no product can overflow. A point stops moving
    when it is balanced, so its scaling does not depend on its neighbours in the batch.

    Parameters
    ----------
    A (N, n, n), F (N, n, m), Q (N, n, n) : finite

    Returns
    -------
    (N, n + 1) integers: tau, then the binary exponent of the largest entry of the balanced H
    """
    h = _log2_hamiltonian(A, F, Q)
    n = A.shape[-1]
    d = np.zeros((len(A), 2 * n))
    columns = np.max(h, axis=1)
    # The row of state i has the entries of the column of its costate n + i. Nothing to balance where one is zero.
    scalable = np.isfinite(columns[:, n:] - columns[:, :n])
    for _ in range(MAX_SWEEPS):
        gap = np.where(scalable, columns[:, n:] - columns[:, :n], 0.0)
        moving = np.max(np.abs(gap), axis=1, keepdims=True) > BALANCED
        if not moving.any():
            break
        step = 0.25 * gap * moving
        d[:, :n] += step
        d[:, n:] -= step
        columns = np.max(h - d[:, :, None], axis=1) + d
    size = np.max(columns, axis=1, keepdims=True)
    size[~np.isfinite(size)] = 0.0
    return np.rint(np.concatenate([d[:, :n], size], axis=1)).astype(np.int64)


def _log2_hamiltonian(A: FloatArray, F: FloatArray, Q: FloatArray) -> FloatArray:
    """log2 |H| (N, 2n, 2n) without the diagonal of A, which no scaling moves; -inf where H is zero."""
    n = A.shape[-1]
    size = np.frexp(np.max(np.abs(F), axis=(-2, -1), initial=0.0, keepdims=True))[1]
    F = np.ldexp(F, -size)
    H = np.empty((len(A), 2 * n, 2 * n))
    H[:, :n, :n] = A
    H[:, :n, n:] = F @ F.mT
    H[:, n:, :n] = Q
    H[:, n:, n:] = A.mT
    with np.errstate(divide="ignore"):
        h = np.log2(np.abs(H))
    h[:, :n, n:] += 2 * size
    diagonal = np.arange(2 * n)
    h[:, diagonal, diagonal] = -np.inf
    return h


def balanced_equation(A: FloatArray, F: FloatArray, Q: FloatArray) -> RiccatiEquation:
    """The equation in balanced states and a time scale in which its Hamiltonian is of order one.

    Parameters
    ----------
    A (N, n, n), F (N, n, m), Q (N, n, n) : finite; ``F F' = G``
    """
    exponents = balance_exponents(A, F, Q)
    tau, size = exponents[:, :-1], exponents[:, -1]
    k = 2 * ((size + 1) // 2)
    row, col, time = tau[:, :, None], tau[:, None, :], k[:, None, None]
    return RiccatiEquation(
        A=np.ldexp(A, col - row - time),
        F=np.ldexp(F, -row - time // 2),
        Q=np.ldexp(Q, row + col - time),
        state_exponent=tau,
        time_exponent=k,
    )


def stabilising_candidate(equation: RiccatiEquation) -> FloatArray:
    """``X = U2 U1^-1`` (N, n, n) from the eigenvectors of H; nan where n of them are not stable.

    Not yet to be trusted: close pairs of eigenvalues cost half the digits, and eigenvalues on the axis may have
    fallen to either side of it.
    """
    A, Q = equation.A, equation.Q
    n = A.shape[-1]
    H = np.empty((len(A), 2 * n, 2 * n))
    H[:, :n, :n] = A
    H[:, :n, n:] = -equation.G
    H[:, n:, :n] = -Q
    H[:, n:, n:] = -A.mT
    eigenvalues, vectors = _eigenvectors(H)
    stable = eigenvalues.real < 0
    split = np.sum(stable, axis=1) == n
    if not split.all():
        stable[~split] = np.arange(2 * n) < n
    basis = vectors.mT[stable].reshape(len(A), n, 2 * n)
    X = solve_or_nan(basis[:, :, :n], basis[:, :, n:]).real
    X[~split] = np.nan
    return 0.5 * (X + X.mT)


def _eigenvectors(H: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Eigenvalues and eigenvectors; nan at a point where LAPACK's iteration does not converge."""
    try:
        return np.linalg.eig(H)
    except np.linalg.LinAlgError:
        if len(H) == 1:
            nan = np.full(H.shape, np.nan, dtype=complex)
            return nan[:, 0], nan
    halves = [_eigenvectors(half) for half in np.array_split(H, 2)]
    return np.concatenate([h[0] for h in halves]), np.concatenate([h[1] for h in halves])


def solve_or_nan(matrix: Matrices, right: Matrices) -> Matrices:
    """``matrix^-1 right`` (N, n, k), nan at singular points: numpy would raise for the whole batch."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        regular: BoolArray = np.linalg.slogdet(matrix)[0] != 0
    solution = np.full(right.shape, np.nan, dtype=right.dtype)
    solution[regular] = np.linalg.solve(matrix[regular], right[regular])
    return solution
