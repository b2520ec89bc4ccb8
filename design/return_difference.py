"""The return difference of a state feedback over all frequencies: Kalman's inequality, measured.

For an optimal gain with no cross term, ``(I + L)* R (I + L) >= R`` with ``L = K (jwI - A)^-1 B``: the smallest
singular value of ``R^1/2 (I + L) R^-1/2`` is at least 1 at every frequency (Kalman 1964), so the loop keeps
60 degrees of phase margin and half to infinity of gain margin at each input. Its reciprocal, the largest
singular value of the sensitivity ``I - K (jwI - A + BK)^-1 B``, is what is computed: the closed loop has no pole
on the axis, whatever the plant has.
"""

from __future__ import annotations

import numpy as np

from design.hamiltonian import eigenvectors_or_nan, solve_or_nan
from model.arrays import ComplexArray, FloatArray

#: Points of the logarithmic part of the frequency grid, and how far beyond the poles it reaches.
GRID_POINTS, GRID_REACH = 80, 100.0
#: Eigenvectors with a larger condition than this are not used.
MAX_CONDITION = 1e6


def return_difference_min(
    A: FloatArray, B: FloatArray, K: FloatArray, R: FloatArray, tolerance: float = 1e-6
) -> FloatArray:
    """Smallest singular value of ``R^1/2 (I + L(jw)) R^-1/2`` over frequency (*G,).

    The grid of each point is logarithmic, from far below its slowest closed-loop pole to far above its fastest,
    with the natural and damped frequency of every pole added. L vanishes at infinite frequency, so the value
    is never above 1 by more than the last grid point leaves.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, 2), K (*G, 2, n) : finite, ``A - BK`` stable
    R (2, 2) : positive definite
    tolerance : values below ``1 - tolerance`` are computed again without eigenvectors before they are believed
    """
    n, m = B.shape[-2:]
    grid = A.shape[:-2]
    values, vectors = np.linalg.eigh(R)
    root = (vectors * np.sqrt(values)) @ vectors.T
    inverse_root = (vectors / np.sqrt(values)) @ vectors.T
    B = (B @ inverse_root).reshape(-1, n, m)
    closed = A.reshape(-1, n, n) - B @ (root @ K.reshape(-1, m, n))
    K = root @ K.reshape(-1, m, n)
    with np.errstate(all="ignore"):
        poles, modes = eigenvectors_or_nan(closed)
        omega = _frequencies(poles)
        peak, condition = _peak_by_modes(poles, modes, B, K, omega)
        again = ~((condition <= MAX_CONDITION) & (peak * (1.0 - tolerance) <= 1.0))
        for i in np.flatnonzero(again):
            peak[i] = _peak_by_solving(closed[i], B[i], K[i], omega[i])
    return np.asarray(1.0 / peak).reshape(grid)


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
    identity = np.broadcast_to(np.eye(modes.shape[-1], dtype=complex), modes.shape)
    inverse = solve_or_nan(modes.astype(complex), identity)
    condition = np.linalg.norm(modes, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
    left, right = K @ modes, inverse @ B
    m = B.shape[-1]
    residues = left[:, :, None, :] * right.mT[:, None, :, :]
    transfer = residues.reshape(len(K), m * m, -1) @ (1.0 / (1j * omega[:, None, :] - poles[:, :, None]))
    sensitivity = np.eye(m).reshape(1, m * m, 1) - transfer
    return np.max(_largest_singular(sensitivity), axis=1), condition


def _peak_by_solving(closed: FloatArray, B: FloatArray, K: FloatArray, omega: FloatArray) -> float:
    """The same peak at one point, by a linear system per frequency."""
    n, m = B.shape
    pencil = 1j * omega[:, None, None] * np.eye(n) - closed
    transfer = K @ solve_or_nan(pencil, np.broadcast_to(B.astype(complex), (len(omega), n, m)))
    sensitivity = (np.eye(m) - transfer).reshape(len(omega), m * m).T
    return float(np.max(_largest_singular(sensitivity[None])))


def _largest_singular(matrices: ComplexArray) -> FloatArray:
    """Largest singular value (N, W) of 2x2 matrices given as their four entries (N, 4, W), row by row.

    The singular values are the roots of ``s^4 - |M|^2 s^2 + |det M|^2``.
    """
    a, b, c, d = matrices[:, 0], matrices[:, 1], matrices[:, 2], matrices[:, 3]
    square = sum(x.real**2 + x.imag**2 for x in (a, b, c, d))
    determinant = 2.0 * np.abs(a * d - b * c)
    gap = np.sqrt(np.maximum((square - determinant) * (square + determinant), 0.0))
    return np.asarray(np.sqrt(0.5 * (square + gap)))
