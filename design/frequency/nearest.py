"""Which of many critical gains are looked at: the nearest to the gain that is flown, upwards and downwards alike."""

from __future__ import annotations

import numpy as np

from design.frequency.positive_roots import position_in_row
from model.arrays import BoolArray, FloatArray, IntArray


def nearest_each_way(rows: IntArray, ratio: FloatArray, count: int, width: int) -> BoolArray:
    """Mask (K,) of at most `width` entries of each row, those of gain ratios (K,) nearest to 1.

    Ratios above and below 1 take turns: many of the one kind, as a delay makes them, must not hide the last of the
    other. Ratios that are not positive or nan are no critical gains and come last.

    Parameters
    ----------
    rows : (K,) row of each entry, from 0 to `count` - 1, rising
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(ratio > 0.0, np.abs(np.log(np.abs(ratio))), np.inf)
    distance = np.where(np.isnan(distance), np.inf, distance)
    side = np.where(np.isinf(distance), 2, (ratio < 1.0).astype(np.int64))
    # Place of each entry among those of its row and side.
    order = np.lexsort((distance, side, rows))
    turn = np.empty(rows.size, dtype=np.int64)
    turn[order] = position_in_row((3 * rows + side)[order], 3 * count)
    turn = np.where(side == 2, rows.size + turn, turn)
    order = np.lexsort((distance, turn, rows))
    kept = np.empty(rows.size, dtype=bool)
    kept[order] = position_in_row(rows[order], count) < width
    return kept
