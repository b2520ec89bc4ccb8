"""Which inputs can reach which outputs at all: told from the entries that are zero, where rounding has no say."""

from __future__ import annotations

import numpy as np

from model.arrays import BoolArray, FloatArray


def reaches(left: FloatArray | BoolArray, right: FloatArray | BoolArray) -> BoolArray:
    """Where the product of two matrices has a term that is not zero."""
    return np.asarray((left != 0.0).astype(float) @ (right != 0.0).astype(float) > 0.0)


def ways(A: FloatArray | BoolArray) -> BoolArray:
    """(*G, n, n) mask ``[to, from]`` of the states that act on each other, through any others, or are the same."""
    n = A.shape[-1]
    way = np.asarray((A != 0.0) | np.eye(n, dtype=bool))
    for _ in range(int(np.ceil(np.log2(max(n, 2))))):
        way = reaches(way, way)
    return way
