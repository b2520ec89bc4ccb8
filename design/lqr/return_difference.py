"""The return difference of a state feedback over all frequencies: Kalman's inequality, measured.

For an optimal gain with no cross term, ``(I + L)* R (I + L) >= R`` with ``L = K (jwI - A)^-1 B``: the smallest
singular value of ``R^1/2 (I + L) R^-1/2`` is at least 1 at every frequency (Kalman 1964), so the loop keeps
60 degrees of phase margin and half to infinity of gain margin at each input. Its reciprocal, the largest
singular value of the sensitivity ``I - K (jwI - A + BK)^-1 B``, is what is computed: the closed loop has no pole
on the axis, whatever the plant has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.hamiltonian import eigenvectors_or_nan, solve_or_nan
from model.arrays import ComplexArray, FloatArray, GridArrays

#: Points of the logarithmic part of the frequency grid, and how far beyond the poles it reaches.
GRID_POINTS, GRID_REACH = 60, 100.0
#: Eigenvectors with a larger condition than this are not used.
MAX_CONDITION = 1e6


@dataclass(frozen=True, eq=False)
class ReturnDifference(GridArrays):
    """What a state feedback does to its loop.

    Attributes
    ----------
    smallest : (*G,) smallest singular value of ``R^1/2 (I + L(jw)) R^-1/2`` over frequency
    poles : (*G, n) eigenvalues of ``A - B K`` [1/s], computed from these matrices alone
    """

    smallest: FloatArray
    poles: ComplexArray


def return_difference(
    A: FloatArray, B: FloatArray, K: FloatArray, R: FloatArray, tolerance: float = 1e-6
) -> ReturnDifference:
    """Smallest return difference over frequency, and the closed-loop poles.

    The grid of each point is logarithmic, from far below its slowest closed-loop pole to far above its fastest,
    with the natural and the damped frequency of every pole added. L vanishes at infinite frequency, so the
    value is never above 1 by more than the last grid point leaves.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, 2), K (*G, 2, n) : finite; `smallest` needs ``A - BK`` stable
    R (2, 2) : positive definite
    tolerance : values below ``1 - tolerance`` are computed again without eigenvectors before they are believed
    """
    n, m = B.shape[-2:]
    grid = A.shape[:-2]
    values, vectors = np.linalg.eigh(R)
    closed = (A - B @ K).reshape(-1, n, n)
    B = (B @ ((vectors / np.sqrt(values)) @ vectors.T)).reshape(-1, n, m)
    K = (((vectors * np.sqrt(values)) @ vectors.T) @ K).reshape(-1, m, n)
    with np.errstate(all="ignore"):
        poles, modes = eigenvectors_or_nan(closed)
        omega = _frequencies(poles)
        peak, condition = _peak_by_modes(poles, modes, B, K, omega)
        doubtful = ~((condition <= MAX_CONDITION) & (peak * (1.0 - tolerance) <= 1.0))
        for i in np.flatnonzero(doubtful):
            peak[i] = _peak_by_solving(closed[i], B[i], K[i], omega[i])
        smallest = 1.0 / peak
    return ReturnDifference(smallest.reshape(grid), poles.reshape(*grid, n))


def _frequencies(poles: ComplexArray) -> FloatArray:
    """Frequencies (N, W) [rad/s]: logarithmic about each point's poles, and the poles' own."""
    size = np.abs(poles)
    low, high = np.log(size.min(axis=1) / GRID_REACH), np.log(size.max(axis=1) * GRID_REACH)
    steps = np.linspace(0.0, 1.0, GRID_POINTS)
    spread = np.exp(low[:, None] + (high - low)[:, None] * steps)
    return np.concatenate([spread, size, np.abs(poles.imag)], axis=1)


def _peak_by_modes(
    poles: ComplexArray, modes: ComplexArray, B: FloatArray, K: FloatArray, omega: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Largest singular value of the sensitivity over omega (N,), and the condition of the eigenvectors (N,)."""
    identity = np.broadcast_to(np.eye(modes.shape[-1], dtype=np.complex128), modes.shape)
    inverse = np.asarray(solve_or_nan(modes, identity), dtype=np.complex128)
    condition = np.linalg.norm(modes, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
    left, right = K @ modes, inverse @ B
    n, m = B.shape[-2:]
    residues = (left[:, :, None, :] * right.mT[:, None, :, :]).reshape(len(K), m * m, n)
    transfer = residues @ _first_order(poles, omega)
    sensitivity = np.eye(m).reshape(1, m * m, 1) - transfer
    return np.max(_largest_singular(sensitivity), axis=1), condition


def _first_order(poles: ComplexArray, omega: FloatArray) -> ComplexArray:
    """``1 / (jw - pole)`` (N, n, W), in real arithmetic: several times faster than complex division."""
    real = -poles.real[:, :, None]
    imaginary = omega[:, None, :] - poles.imag[:, :, None]
    square = real * real + imaginary * imaginary
    response = np.empty(square.shape, dtype=np.complex128)
    response.real, response.imag = real / square, -imaginary / square
    return response


def _peak_by_solving(closed: FloatArray, B: FloatArray, K: FloatArray, omega: FloatArray) -> float:
    """The same peak at one point, by a linear system per frequency."""
    n, m = B.shape
    pencil = np.asarray(1j * omega, dtype=np.complex128)[:, None, None] * np.eye(n) - closed
    inputs = np.broadcast_to(B.astype(np.complex128), (len(omega), n, m))
    states: ComplexArray = solve_or_nan(pencil, inputs)
    sensitivity = np.asarray(np.eye(m) - K @ states, dtype=np.complex128)
    return float(np.max(_largest_singular(sensitivity.reshape(1, len(omega), m * m).mT)))


def _largest_singular(matrices: ComplexArray) -> FloatArray:
    """Largest singular value (N, W) of 2x2 matrices given as their four entries (N, 4, W), row by row.

    The singular values are the roots of ``s^4 - |M|^2 s^2 + |det M|^2``.
    """
    a, b, c, d = matrices[:, 0], matrices[:, 1], matrices[:, 2], matrices[:, 3]
    square = np.sum(matrices.real**2 + matrices.imag**2, axis=1)
    determinant = a * d - b * c
    twice = 2.0 * np.sqrt(determinant.real**2 + determinant.imag**2)
    gap = np.sqrt(np.maximum((square - twice) * (square + twice), 0.0))
    return np.asarray(np.sqrt(0.5 * (square + gap)))
