"""Stabilising solution of a Riccati equation from the eigenvectors of its Hamiltonian, batched."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from design.lqr.regulator import RiccatiEquation
from model.arrays import ComplexArray, FloatArray

Matrices = TypeVar("Matrices", FloatArray, ComplexArray)


def stabilising_candidate(equation: RiccatiEquation) -> FloatArray:
    """``X = U2 U1^-1`` (N, n, n), ``[U1; U2]`` the stable eigenvectors of H (Potter 1966).

    ``H = [A -G; -Q -A']``; nan where it does not have n stable eigenvalues. Not to be trusted yet: close pairs
    of eigenvalues cost half the digits, and a pair on the axis may have been split by rounding.
    """
    A, Q = equation.A, equation.Q
    n = A.shape[-1]
    H = np.empty((len(A), 2 * n, 2 * n))
    H[:, :n, :n] = A
    H[:, :n, n:] = -equation.G
    H[:, n:, :n] = -Q
    H[:, n:, n:] = -A.mT
    eigenvalues, vectors = eigenvectors_or_nan(H)
    stable = eigenvalues.real < 0
    split = np.sum(stable, axis=1) == n
    if not split.all():
        stable[~split] = np.arange(2 * n) < n
    basis = vectors.mT[stable].reshape(len(A), n, 2 * n)
    X = solve_or_nan(basis[:, :, :n], basis[:, :, n:]).real
    X[~split] = np.nan
    return np.asarray(0.5 * (X + X.mT))


def eigenvectors_or_nan(matrix: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Eigenvalues (N, n) and eigenvectors (N, n, n); nan at a point where LAPACK does not converge."""
    try:
        values, vectors = np.linalg.eig(matrix)
    except np.linalg.LinAlgError:
        if len(matrix) == 1:
            nan = np.full(matrix.shape, np.nan, dtype=complex)
            return nan[:, 0], nan
    else:
        # numpy gives real arrays where every eigenvalue of the batch happens to be real.
        return values.astype(complex, copy=False), vectors.astype(complex, copy=False)
    halves = [eigenvectors_or_nan(half) for half in np.array_split(matrix, 2)]
    return np.concatenate([h[0] for h in halves]), np.concatenate([h[1] for h in halves])


def solve_or_nan(matrix: Matrices, right: Matrices) -> Matrices:
    """``matrix^-1 right`` (N, n, k), nan at singular points: numpy would raise for the whole batch."""
    solution = np.full_like(right, np.nan)
    try:
        solution[:] = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        with np.errstate(all="ignore"):
            regular = np.linalg.slogdet(matrix)[0] != 0
        solution[regular] = np.linalg.solve(matrix[regular], right[regular])
    return solution
