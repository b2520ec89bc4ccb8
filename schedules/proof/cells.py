"""The cells between the grid points of a schedule, and the gains at their corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.outcome import Outcomes
from model.arrays import FloatArray, IntArray
from model.flight import GridAxis
from schedules.proof.flight_box import Box


@dataclass(frozen=True)
class Cell:
    """A cell: its lower corner's index, its box, and the grid's indices of its corners along each axis."""

    index: tuple[int, int]
    box: Box
    across: tuple[int, int]
    along: tuple[int, int]

    def corners(self, table: FloatArray) -> FloatArray:
        """What stands at its corners (2, 2, ...) of a table (nh, ns, ...)."""
        return table[np.ix_(self.across, self.along)]

    def failed(self, outcomes: Outcomes) -> str | None:
        """Which corner has no gains and why, in words; None where all have."""
        for i in self.across:
            for j in self.along:
                if not outcomes.ok[i, j]:
                    return f"grid point [{i}, {j}] is {outcomes.codes[i, j]}: {outcomes.reasons[i, j]}"
        return None


def cells(axes: tuple[GridAxis, GridAxis]) -> tuple[Cell, ...]:
    """All cells, the speed varying fastest; an axis of one breakpoint has one cell of no width."""
    altitude, speed = (axis.values for axis in axes)
    return tuple(
        Cell((i, j), Box((altitude[i], altitude[p]), (speed[j], speed[q])), (i, p), (j, q))
        for i, p in _intervals(len(altitude))
        for j, q in _intervals(len(speed))
    )


def _intervals(count: int) -> list[tuple[int, int]]:
    return [(k, k + 1) for k in range(count - 1)] or [(0, 0)]


def gains_at(
    axes: tuple[GridAxis, GridAxis], tables: FloatArray, altitude: FloatArray, speed: FloatArray
) -> FloatArray:
    """Gains (*N, g) at any conditions (*N,), from tables (nh, ns, g): multilinear, clipped outside the grid.

    A grid point without gains spoils all cells that it is a corner of.
    """
    (i, u), (j, v) = (_place(np.asarray(axis.values), x) for axis, x in zip(axes, (altitude, speed), strict=True))
    i, u, j, v = np.broadcast_arrays(i, u, j, v)
    above, right = np.minimum(i + 1, len(axes[0].values) - 1), np.minimum(j + 1, len(axes[1].values) - 1)
    u, v = u[..., None], v[..., None]
    low = (1.0 - v) * tables[i, j] + v * tables[i, right]
    high = (1.0 - v) * tables[above, j] + v * tables[above, right]
    return np.asarray((1.0 - u) * low + u * high)


def _place(values: FloatArray, x: FloatArray) -> tuple[IntArray, FloatArray]:
    """Index of the breakpoint below, and the fraction of the way to the next."""
    if values.size == 1:
        return np.zeros(np.shape(x), dtype=np.int64), np.zeros(np.shape(x))
    inside = np.clip(x, values[0], values[-1])
    below = np.clip(np.searchsorted(values, inside, side="right") - 1, 0, values.size - 2)
    return np.asarray(below, dtype=np.int64), np.asarray((inside - values[below]) / (values[below + 1] - values[below]))


def corners_of_part(cell: Box, gains: FloatArray, part: Box) -> FloatArray:
    """Gains (2, 2, g) at the corners of a part of a cell, from those at the cell's corners."""
    u, v = (
        np.array([_fraction(whole, end) for end in ends])
        for whole, ends in ((cell.altitude, part.altitude), (cell.speed, part.speed))
    )
    rows = (1.0 - u)[:, None, None] * gains[0] + u[:, None, None] * gains[1]
    return np.asarray((1.0 - v)[:, None] * rows[:, :1] + v[:, None] * rows[:, 1:])


def _fraction(whole: tuple[float, float], value: float) -> float:
    low, high = whole
    return 0.0 if high == low else (value - low) / (high - low)
