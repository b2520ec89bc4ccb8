"""Grids of frequencies, one for each point, on which a signal's summits can be told."""

from __future__ import annotations

import numpy as np

from model.arrays import BoolArray, FloatArray

#: Frequencies nearer to each other than this part of them are one.
_SAME = 1e-9
#: A summit that stands out by less than this part of it is rounding.
_NOISE = 1e-10


def distinct(grid: FloatArray) -> FloatArray:
    """The frequencies (N, W) >= 0 in order, each once; what is left over goes beyond the last one.

    A frequency that is there twice is of no use: its neighbours would not enclose anything.
    """
    grid = np.sort(grid, axis=-1)
    twice = np.diff(grid, axis=-1, prepend=-1.0) <= _SAME * grid
    beyond = grid[:, -1:] * np.linspace(1.01, 1.1, grid.shape[-1])
    return np.sort(np.where(twice, beyond, grid), axis=-1)


def summits(height: FloatArray, worth: float, most: int) -> FloatArray:
    """Places of the highest summits of signals (N, W, q) on a grid: (N, most, q), the highest first, else -1.

    Parameters
    ----------
    height : (N, W, q), at least 0
    worth : part of the highest below which a summit is left out
    most : how many are kept; the highest value of all is always among them
    """
    highest = np.argmax(height, axis=1)[:, None]
    top = np.take_along_axis(height, highest, axis=1)
    padded = np.pad(height, ((0, 0), (1, 1), (0, 0)), mode="edge")
    before, after = padded[:, :-2], padded[:, 2:]
    stands: BoolArray = (height >= np.maximum(before, after)) & (height > np.minimum(before, after) * (1.0 + _NOISE))
    kept = np.where(stands & (height >= worth * top), height, -1.0)
    np.put_along_axis(kept, highest, top, axis=1)
    place = np.argsort(-kept, axis=1, kind="stable")[:, :most]
    return np.where(np.take_along_axis(kept, place, axis=1) >= 0.0, place, -1)
