"""Proofs: the search for a cell's Lyapunov matrix against clarabel, and the re-check of many against scipy."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvalsh, solve_continuous_lyapunov

from model.arrays import FloatArray
from schedules.proof.barrier import Answer, central
from schedules.proof.decay import decay_rates, slowest
from schedules.proof.search import modal
from schedules.proof.semidefinite import best_lyapunov
from tests.benchmarks.cases import Case
from tests.benchmarks.measure import Row

CELLS, CORNERS = 1000, 8
#: Cells that a matrix is looked for, and how far their corners' loops lie apart: parts of an entry.
SEARCHED, APART = 24, 0.2


def search_row(c: Case) -> Row:
    """Whether the loops at a cell's corners share a matrix at half their slowest rate; both start from the modes."""
    closed, rng = c.loop.closed, np.random.default_rng(5)
    cells = []
    for i in rng.integers(0, len(closed), SEARCHED):
        A = closed[i] * (1.0 + APART * rng.standard_normal((CORNERS, *closed.shape[1:])))
        A = A + 0.5 * float(np.min(slowest(A))) * np.eye(A.shape[-1])
        L = np.linalg.cholesky(modal(np.mean(A, axis=0)))
        cells.append(L.T @ A @ np.linalg.inv(L).T)

    def ours() -> list[bool]:
        return [central(A).answer is Answer.PROVED for A in cells]

    def theirs() -> list[bool]:
        found = [best_lyapunov(A, 0.0) for A in cells]
        return [
            X is not None and np.linalg.eigvalsh(X)[0] > 1e-9 and bool(np.min(decay_rates(A, X)) > 0.0)
            for A, X in zip(cells, found, strict=True)
        ]

    def agree(mine: list[bool], other: list[bool]) -> None:
        assert mine == other

    return Row(f"one matrix for a cell's {CORNERS} corners, {SEARCHED} cells", "clarabel", 2.0, ours, theirs, agree)


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
