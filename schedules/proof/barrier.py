"""One Lyapunov matrix for a few small loops, quickly: Newton's method on a barrier, stopped as soon as it can be.

    maximise t    so that    -(A_k' X + X A_k) - t I > 0  for all k,    X > 0,    trace X = n

A matrix with ``t > 0`` proves all loops; no better one is needed. On the central path t is within ``nu / weight`` of
the largest there is, nu the sum of the blocks' orders: a path that stays farther below zero shows that no matrix
proves them. What lies between is left to `semidefinite`, which is slower and goes to the end. Loops are as many as a
cell has: each step solves for all unknowns at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

import numpy as np

from model.arrays import FloatArray
from schedules.proof.semidefinite import symmetric_basis

#: Steps at most, and the gap at which what is found is neither: parts of the largest entry of a loop.
MOST_STEPS = 80
SMALLEST_GAP = 1e-8
#: The weight of t grows by this as soon as a step of Newton's is as short as `NEAR` in the barrier's own measure.
GROWTH, NEAR = 50.0, 0.5


class Answer(Enum):
    """What the path says of the loops."""

    PROVED = "proved"
    NONE = "none"
    UNCLEAR = "unclear"


@dataclass(frozen=True, eq=False)
class Central:
    """Where the path was left.

    Attributes
    ----------
    answer : what it says of the loops
    X : (n, n) the matrix there, of trace n and positive definite
    steps : of Newton's method
    """

    answer: Answer
    X: FloatArray
    steps: int


def central(A: FloatArray) -> Central:
    """Follow the path for loops A (K, n, n) [1/s], in coordinates in which the identity is a good guess."""
    n = A.shape[-1]
    A = A / max(float(np.max(np.abs(A))), np.finfo(float).tiny)
    basis = _traceless(n)
    slopes = _slopes(A, basis)
    blocks = np.concatenate([-(A + np.swapaxes(A, -1, -2)), np.eye(n)[None]])
    t = float(np.min(np.linalg.eigvalsh(blocks[:-1])[:, 0])) - 1.0
    blocks[:-1] -= t * np.eye(n)
    x, weight, steps = np.append(np.zeros(len(basis)), t), float(len(blocks)), 0
    answer = Answer.UNCLEAR
    while answer is Answer.UNCLEAR and steps < MOST_STEPS:
        steps += 1
        try:
            step, short = _newton(blocks, slopes, weight)
        except np.linalg.LinAlgError:
            break  # at the end of what arithmetic can tell apart
        x = x + step
        blocks = blocks + (step @ slopes.reshape(len(x), -1)).reshape(blocks.shape)
        # On the path itself t is within nu / weight of the largest there is; near it, within twice that.
        gap = 2.0 * blocks.shape[0] * n / weight
        if x[-1] > 0.0:
            answer = Answer.PROVED
        elif short and x[-1] + gap < 0.0:
            answer = Answer.NONE
        elif short and gap < SMALLEST_GAP:
            break
        elif short:
            weight *= GROWTH
    return Central(answer, np.eye(n) + np.einsum("j,jab->ab", x[:-1], basis), steps)


def _newton(blocks: FloatArray, slopes: FloatArray, weight: float) -> tuple[FloatArray, bool]:
    """A step (m,) that keeps the blocks (K, n, n) positive definite, and whether it is a short one.

    Raises
    ------
    numpy.linalg.LinAlgError : the blocks are not positive definite but for rounding
    """
    count, n, _ = blocks.shape
    inverse = np.linalg.inv(np.linalg.cholesky(blocks))
    # Slopes side by side: one product a block, not one a slope.
    wide = np.moveaxis(slopes, 0, 2).reshape(count, n, -1)
    left = np.moveaxis((inverse @ wide).reshape(count, n, -1, n), 2, 0)
    turned = (left @ np.swapaxes(inverse, -1, -2)).reshape(len(slopes), -1)
    uphill = turned @ np.tile(np.eye(n).ravel(), count)
    uphill[-1] += weight
    step = np.linalg.solve(turned @ turned.T, uphill)
    if not np.all(np.isfinite(step)):
        raise np.linalg.LinAlgError("the step is not finite")
    if np.sqrt(max(float(uphill @ step), 0.0)) < NEAR:
        return np.asarray(step), True
    reach = -float(np.min(np.linalg.eigvalsh((step @ turned).reshape(blocks.shape))))
    return np.asarray(step * (0.8 / max(reach, 0.8))), False


def _slopes(A: FloatArray, basis: FloatArray) -> FloatArray:
    """How the blocks (K + 1, n, n) change with coefficients of the basis (m, n, n) and with t: (m + 1, K + 1, n, n)."""
    n = A.shape[-1]
    half = basis[:, None] @ A
    slopes = np.zeros((len(basis) + 1, len(A) + 1, n, n))
    slopes[:-1, :-1] = -(half + np.swapaxes(half, -1, -2))
    slopes[-1, :-1] = -np.eye(n)
    slopes[:-1, -1] = basis
    return slopes


@lru_cache(maxsize=32)
def _traceless(n: int) -> FloatArray:
    """Orthonormal basis (m, n, n) of the symmetric matrices of trace zero."""
    basis = symmetric_basis(n)[0]
    traces = np.trace(basis, axis1=1, axis2=2)
    others = np.linalg.qr(np.column_stack([traces, np.eye(len(basis))]))[0][:, 1:]
    return np.asarray(np.einsum("ij,iab->jab", others, basis))
