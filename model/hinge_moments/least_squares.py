"""Linear least squares over any number of rows in bounded memory, with a check that the rows suffice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray

_BLOCK = 2**15
#: Below this ratio of singular values the rows do not determine the unknowns: errors of a row would come out of the
#: fit a hundred thousand times larger. For columns of comparable size.
SMALLEST_RATIO = 1e-5


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Solution of ``design @ x = values`` in the least-squares sense.

    Attributes
    ----------
    solution : (k, 2)
    weakest : (k,) combination of unknowns that the rows determine worst, of length one
    strength : smallest singular value over the largest [-]
    """

    solution: FloatArray
    weakest: FloatArray
    strength: float

    @property
    def determined(self) -> bool:
        """Whether the rows determine every unknown."""
        return self.strength > SMALLEST_RATIO


def least_squares(design: Callable[[slice], FloatArray], unknowns: int, values: FloatArray) -> LeastSquares:
    """Solve by orthogonal triangles, some ten thousand rows at a time.

    The triangle of the rows so far is put on top of the next block and reduced again: as accurate as one
    QR decomposition of all rows, which normal equations are not.

    Parameters
    ----------
    design : rows (m, k) of the design matrix for a slice of the rows
    unknowns : k
    values : (n, 2) right-hand sides, n >= k
    """
    triangle = np.zeros((0, unknowns + values.shape[1]))
    for start in range(0, len(values), _BLOCK):
        rows = slice(start, start + _BLOCK)
        block = np.concatenate([design(rows), values[rows]], axis=-1)
        triangle = np.asarray(np.linalg.qr(np.concatenate([triangle, block]), mode="r"))
    left, strengths, right = np.linalg.svd(triangle[:unknowns, :unknowns])
    strength = float(strengths[-1] / strengths[0]) if strengths[0] > 0 else 0.0
    projected = left.T @ triangle[:unknowns, unknowns:]
    floor = np.maximum(strengths, SMALLEST_RATIO * max(strengths[0], np.finfo(float).tiny))
    return LeastSquares(right.T @ (projected / floor[:, None]), right[-1], strength)
