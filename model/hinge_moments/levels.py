"""Distinct values of an angle in a table: its levels."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, IntArray

#: Angles closer than this are one level [rad].
SAME_ANGLE = 1e-9


def level_index(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distinct values (m,), increasing, and the level of each value (n,).

    Neighbours within `SAME_ANGLE` belong to one level, which takes the smallest value of them.
    """
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    begins = np.concatenate([[True], np.diff(ordered) > SAME_ANGLE])
    index = np.empty(len(values), dtype=np.int64)
    index[order] = np.cumsum(begins) - 1
    return ordered[begins], index
