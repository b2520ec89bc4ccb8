"""Matrices that get more states: zeros behind what is there."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray


def padded(matrix: FloatArray, rows: int, columns: int) -> FloatArray:
    """`matrix` (*G, r, c) with rows and columns of zeros behind its own, always a copy."""
    made = np.zeros((*matrix.shape[:-2], rows, columns))
    made[..., : matrix.shape[-2], : matrix.shape[-1]] = matrix
    return made
