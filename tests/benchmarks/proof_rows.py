"""The re-check of proofs: Lyapunov matrices at the corners of many cells, against a loop over scipy."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvalsh, solve_continuous_lyapunov

from model.arrays import FloatArray
from schedules.proof.decay import decay_rates
from tests.benchmarks.cases import Case
from tests.benchmarks.measure import Row

CELLS, CORNERS = 1000, 8


def proof_row(c: Case) -> Row:
    """Decay that the matrix of each of 1000 cells proves at its 8 corners; the peer solves each corner's pencil."""
    closed, rng = c.loop.closed, np.random.default_rng(3)
    of = rng.integers(0, len(closed), CELLS)
    # Matrices of each cell's first corner; the others lie around it.
    P = np.stack([solve_continuous_lyapunov(closed[i].T, -np.eye(closed.shape[-1])) for i in range(len(closed))])[of]
    A = closed[of][:, None] * (1.0 + 1e-3 * rng.standard_normal((CELLS, CORNERS, 1, 1)))

    def ours() -> FloatArray:
        return decay_rates(A, P[:, None])

    def theirs() -> FloatArray:
        found = np.empty((CELLS, CORNERS))
        for i in range(CELLS):
            for k in range(CORNERS):
                found[i, k] = -0.5 * eigvalsh(A[i, k].T @ P[i] + P[i] @ A[i, k], P[i])[-1]
        return found

    def agree(mine: FloatArray, other: FloatArray) -> None:
        np.testing.assert_allclose(mine, other, rtol=1e-6)

    return Row("re-check of a proof, 1000 cells, 8 corners", "scipy eigvalsh loop", 10.0, ours, theirs, agree)
