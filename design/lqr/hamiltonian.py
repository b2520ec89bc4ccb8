"""Stabilising solution of a Riccati equation from the eigenvectors of its Hamiltonian, batched.

Two ways to the stable eigenvectors of ``H = [A -G; -Q -A']``, 2n x 2n:

- of its *square*, which the eigenvalues ``s`` and ``-s`` share. With ``J = [0 I; -I 0]`` every Krylov space of H^2 is
  isotropic (``V'JV = 0``), so Arnoldi's method ends after n steps with ``H^2 V = V M``, and half the size is left
  (Van Loan 1984; Mehrmann and Watkins 2001). An eigenvector ``V e`` of H^2 is a mixture of those of s and -s; ``H - s``
  leaves the one of -s. Two to three times as fast, and loses digits where the s range over many decades.
- of H itself (Potter 1966).

Neither is to be trusted yet: close pairs of eigenvalues cost half the digits, and a pair on the axis may have
been split by rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np

from design.lqr.regulator import RiccatiEquation, finite
from model.arrays import ComplexArray, FloatArray

Matrices = TypeVar("Matrices", FloatArray, ComplexArray)


@dataclass(frozen=True, eq=False)
class StableSubspace:
    """The graph of a stable invariant subspace over N points; nan where it is none.

    Attributes
    ----------
    X : (N, n, n) ``U2 U1^-1``, real and symmetric, ``[U1; U2]`` a basis of the subspace
    modes, inverse : (N, n, n) ``U1``, the eigenvectors of the closed loop as far as X solves the equation, and its
        inverse
    """

    X: FloatArray
    modes: ComplexArray
    inverse: ComplexArray


def subspace_by_square(H: FloatArray) -> StableSubspace:
    """Stable subspace of a Hamiltonian matrix (N, 2n, 2n) by way of its square."""
    V = isotropic_krylov_basis(H)
    image = H @ V
    squares, mixtures = eigenvectors_or_nan(V.mT @ (H @ image))
    return _graph(image @ mixtures - (V @ mixtures) * np.sqrt(squares)[:, None, :])


def subspace(H: FloatArray) -> StableSubspace:
    """Stable subspace of a Hamiltonian matrix (N, 2n, 2n); nan where it does not have n stable eigenvalues."""
    n = H.shape[-1] // 2
    eigenvalues, vectors = eigenvectors_or_nan(H)
    stable = eigenvalues.real < 0
    split = np.sum(stable, axis=1) == n
    if not split.all():
        stable[~split] = np.arange(2 * n) < n
    basis = vectors.mT[stable].reshape(len(H), n, 2 * n).mT
    return _graph(np.where(split[:, None, None], basis, np.nan))


def stabilising_candidate(equation: RiccatiEquation) -> FloatArray:
    """X (N, n, n) of the stable subspace of H; nan where there is none."""
    return subspace(hamiltonian(equation.A, equation.G, equation.Q)).X


def hamiltonian(A: FloatArray, G: FloatArray, Q: FloatArray) -> FloatArray:
    """``[A -G; -Q -A']`` (N, 2n, 2n)."""
    n = A.shape[-1]
    H = np.empty((len(A), 2 * n, 2 * n))
    H[:, :n, :n] = A
    H[:, :n, n:] = -G
    H[:, n:, :n] = -Q
    H[:, n:, n:] = -A.mT
    return H


def isotropic_krylov_basis(H: FloatArray) -> FloatArray:
    """Orthonormal V (N, 2n, n) with ``V'JV = 0`` that spans ``v, H^2 v, H^4 v, ...``, H Hamiltonian.

    In exact arithmetic the vectors are orthogonal to those of J V by themselves; here they are made so. Where the
    sequence ends early, what rounding leaves of the next vector is a fresh start, as good as any.
    """
    points, size, _ = H.shape
    n = size // 2
    square = H @ H
    # v_1, J v_1, v_2, J v_2, ... as rows
    basis = np.empty((points, size, size))
    v = np.broadcast_to(_first_vector(size), (points, size))
    for k in range(0, size, 2):
        if k:
            before = basis[:, :k]
            v = square @ basis[:, k - 2, :, None]
            v -= before.mT @ (before @ v)
            v -= before.mT @ (before @ v)
            v = v[:, :, 0]
            v = v / np.sqrt(np.vecdot(v, v))[:, None]
        basis[:, k] = v
        basis[:, k + 1, :n] = v[:, n:]
        np.negative(v[:, :n], out=basis[:, k + 1, n:])
    return basis[:, ::2].mT


@lru_cache(maxsize=16)
def _first_vector(size: int) -> FloatArray:
    """A unit vector (size,) with something of every mode in it: no pattern that a plant could have too."""
    v = np.cos(np.arange(1.0, size + 1.0) ** 2)
    return np.asarray(v / np.linalg.norm(v))


def _graph(basis: ComplexArray) -> StableSubspace:
    """The subspace that the columns of ``[U1; U2]`` (N, 2n, n) span; nan where U1 is singular."""
    n = basis.shape[-1]
    modes = basis[:, :n]
    identity: ComplexArray = np.broadcast_to(np.eye(n, dtype=np.complex128), modes.shape)
    inverse: ComplexArray = solve_or_nan(modes, identity)
    X = (basis[:, n:] @ inverse).real
    return StableSubspace(np.asarray(0.5 * (X + X.mT)), modes, inverse)


def eigenvectors_or_nan(matrix: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Eigenvalues (N, n) and eigenvectors (N, n, n); nan at points not finite, or where LAPACK does not converge."""
    try:
        values, vectors = np.linalg.eig(matrix)
    except np.linalg.LinAlgError:
        return _eigenvectors_one_by_one(matrix)
    # numpy gives real arrays where every eigenvalue of the batch happens to be real.
    return values.astype(complex, copy=False), vectors.astype(complex, copy=False)


def _eigenvectors_one_by_one(matrix: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """The same for a batch that numpy raises for: without the points that are not finite, else half by half."""
    values, vectors = np.full(matrix.shape[:-1], np.nan, complex), np.full(matrix.shape, np.nan, complex)
    known = finite(matrix)
    if not known.all():
        values[known], vectors[known] = eigenvectors_or_nan(matrix[known])
    elif len(matrix) > 1:
        half = len(matrix) // 2
        values[:half], vectors[:half] = eigenvectors_or_nan(matrix[:half])
        values[half:], vectors[half:] = eigenvectors_or_nan(matrix[half:])
    return values, vectors


def solve_or_nan(matrix: Matrices, right: Matrices) -> Matrices:
    """``matrix^-1 right`` (N, n, k), nan at singular points: numpy would raise for the whole batch."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=right.dtype)
    except np.linalg.LinAlgError:
        with np.errstate(all="ignore"):
            regular = np.linalg.slogdet(matrix)[0] != 0
    solution = np.full_like(right, np.nan)
    solution[regular] = np.linalg.solve(matrix[regular], right[regular])
    return solution
