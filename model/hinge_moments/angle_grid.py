"""A table whose rows fill a rectangular grid of angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, IntArray
from model.hinge_moments.levels import level_index
from model.hinge_moments.table import HingeMomentTable

_SHOWN = 5


@dataclass(frozen=True, eq=False)
class AngleGrid:
    """Levels of the three angles and the coefficients at every combination.

    Attributes
    ----------
    levels : increasing levels of alpha, dt, da [rad]
    nodes : (n_alpha, n_dt, n_da, 2) coefficients [C_Ht, C_Ha]
    """

    levels: tuple[FloatArray, FloatArray, FloatArray]
    nodes: FloatArray


def angle_grid(table: HingeMomentTable) -> AngleGrid:
    """Put the rows of a table in their places.

    Raises
    ------
    ValueError : combinations of angles without a row; the message counts them and names the first
    """
    (alpha, i), (dt, j), (da, k) = (level_index(column) for column in table.angles.T)
    levels = (alpha, dt, da)
    place = (i * len(dt) + j) * len(da) + k  # increasing: the rows of a table are sorted
    size = len(alpha) * len(dt) * len(da)
    if len(place) < size:
        raise ValueError(_gaps(levels, place, size))
    return AngleGrid(levels, table.coefficients.reshape(len(alpha), len(dt), len(da), 2))


def _gaps(levels: tuple[FloatArray, FloatArray, FloatArray], place: IntArray, size: int) -> str:
    shape = tuple(len(x) for x in levels)
    shown = []
    for flat in _first_missing(place, size):
        alpha, dt, da = (np.rad2deg(x[at]) for x, at in zip(levels, np.unravel_index(flat, shape), strict=True))
        shown.append(f"({alpha:.6g}, {dt:.6g}, {da:.6g})")
    return (
        f"an interpolant needs a row for every combination of {shape[0]} alphas, {shape[1]} tab and {shape[2]} aileron "
        f"angles; {size - len(place)} of {size} are missing, the first at (alpha, tab, aileron) = "
        f"{', '.join(shown)} deg. Give them, or fit a Taylor expansion"
    )


def _first_missing(place: IntArray, size: int) -> list[int]:
    """First few numbers below `size` that do not occur in `place`, which increases."""
    missing: list[int] = []
    begin = np.concatenate([[0], place + 1])  # candidates lie between one place and the next
    end = np.concatenate([place, [size]])
    for gap in np.flatnonzero(end > begin)[:_SHOWN]:
        missing += range(int(begin[gap]), min(int(end[gap]), int(begin[gap]) + _SHOWN))
    return missing[:_SHOWN]
