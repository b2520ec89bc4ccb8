"""A proof that a single transfer is nowhere above a level, at a quarter of the cost of its Hamiltonian."""

from __future__ import annotations

import numpy as np

from design.disturbance.level_set import RESOLUTION, is_own_pair, nearness
from design.disturbance.lyapunov import observability_gramians
from design.disturbance.open_parts import Matrices
from design.disturbance.summits import Summits
from model.arrays import BoolArray, FloatArray, IntArray

#: Where the gain at infinity is above this part of the level, digits cancel.
_LOUD = 0.99
#: The screen is believed when it gives the known gain's square to this part.
_AGREEMENT = 1e-8


class PairScreen:
    """Proof for single transfers by matrices of half the size of the Hamiltonian.

    With ``A'Q + Q A + c'c = 0`` and ``l = b'Q + d c`` the squared gain is, in ``x = w^2``,
    ``d^2 - 2 l A (xI + A^2)^-1 b``: it is at a level where x is an eigenvalue of ``-A^2 - 2 b l A / (level^2 - d^2)``.
    Squares cost digits where the modes are decades apart. What then looks like a positive eigenvalue, or does not
    give the known gain, is doubtful.
    """

    def __init__(self, system: Matrices, scale: FloatArray) -> None:
        """Of all pairs of balanced systems (N, ...), in the order (N o p,), each output in units of a scale."""
        A, B = system.A, system.B
        Q = observability_gramians(A, system.C)
        o, p = system.D.shape[-2:]
        row = B.mT[:, None] @ Q + system.D[..., None] * system.C[:, :, None]  # (N, o, p, n)
        self.points = np.repeat(np.arange(len(A)), o * p)
        self.square = A @ A
        self.b = np.broadcast_to(B.mT[:, None], row.shape).reshape(-1, A.shape[-1])
        self.row = 2.0 * (row @ A[:, None]).reshape(-1, A.shape[-1]) / scale[:, None] ** 2
        self.d = system.D.reshape(-1) / scale

    def __call__(self, rows: IntArray, known: Summits) -> BoolArray:
        """(K,) mask of the pairs that this does not prove to be nowhere above what is known."""
        square, b, row, d = self.square[self.points[rows]], self.b[rows], self.row[rows], self.d[rows]
        level = known.gain * (1.0 + RESOLUTION)
        gap = (level - d) * (level + d)
        matrix = -square - b[:, :, None] * (row / gap[:, None])[:, None, :]
        x = np.linalg.eigvals(matrix).astype(np.complex128)
        rounding = nearness(np.abs(x), np.linalg.norm(matrix, axis=(-2, -1)))
        root = np.sqrt(x)
        crosses = (np.abs(x.imag) <= rounding) & (x.real > -rounding) & ~is_own_pair(root.real, root.imag, known)
        inside = np.isfinite(known.omega)
        shifted = square + np.where(inside, known.omega, 0.0)[:, None, None] ** 2 * np.eye(square.shape[-1])
        seen = d**2 - np.sum(row * np.linalg.solve(shifted, b[..., None])[..., 0], axis=-1)
        agrees = np.where(inside, np.abs(seen - level**2) <= _AGREEMENT * level**2, True)
        return np.asarray(crosses.any(axis=-1) | ~agrees | (np.abs(d) > _LOUD * level))
