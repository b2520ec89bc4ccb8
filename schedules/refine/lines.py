"""Lines of a table, and the finer mesh of points that is looked at between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from model.arrays import FloatArray

AXES = ("altitude", "speed")


@dataclass(frozen=True)
class Lines:
    """Breakpoints of a table: of altitude [m] and of speed (in the axis's unit), increasing.

    An envelope of one altitude or of one speed has one line there.
    """

    altitude: tuple[float, ...]
    speed: tuple[float, ...]

    def __getitem__(self, axis: int) -> tuple[float, ...]:
        """Those of altitude (0) or of speed (1)."""
        return (self.altitude, self.speed)[axis]

    @property
    def shape(self) -> tuple[int, int]:
        """How many of altitude and of speed."""
        return len(self.altitude), len(self.speed)

    @property
    def points(self) -> int:
        """Number of points of the table."""
        return len(self.altitude) * len(self.speed)

    def replaced(self, axis: int, values: tuple[float, ...]) -> Lines:
        """The same with other lines along an axis."""
        return replace(self, **{AXES[axis]: values})

    def added(self, axis: int, value: float) -> Lines:
        """The same and one line more."""
        return self.replaced(axis, tuple(sorted((*self[axis], value))))

    def without(self, axis: int, value: float) -> Lines:
        """The same without one line."""
        return self.replaced(axis, tuple(x for x in self[axis] if x != value))

    def interior(self) -> list[tuple[int, float]]:
        """Lines between the ends: axis and place of each."""
        return [(axis, value) for axis in (0, 1) for value in self[axis][1:-1]]

    def mesh(self, parts: int) -> Lines:
        """All lines, and others that cut each interval into equal parts."""
        return Lines(*(_cut(self[axis], parts) for axis in (0, 1)))

    def joined(self, others: Lines) -> Lines:
        """These and others, those beyond the ends left out."""
        ends = ((self[axis][0], self[axis][-1]) for axis in (0, 1))
        return Lines(
            *(
                tuple(sorted({*self[axis], *(x for x in others[axis] if low < x < high)}))
                for axis, (low, high) in enumerate(ends)
            )
        )


def uniform(ends: Lines, shape: tuple[int, int]) -> Lines:
    """Evenly spaced lines between the ends of others."""
    return Lines(*(_even(ends[axis], count) for axis, count in enumerate(shape)))


def read_between(lines: Lines, tables: FloatArray, mesh: Lines) -> FloatArray:
    """What tables (nh, ns, ...) over the lines give on a mesh (Nh, Ns, ...): multilinear, as a schedule is read.

    Where a nan carries weight the answer is nan.
    """
    weights = [_weights(lines[axis], mesh[axis]) for axis in (0, 1)]
    known = np.isfinite(tables)
    found = _summed(weights, np.where(known, tables, 0.0))
    if np.all(known):
        return found
    spoiled = _summed([(part > 0.0).astype(float) for part in weights], (~known).astype(float))
    return np.where(spoiled > 0.0, np.nan, found)


def _summed(weights: list[FloatArray], tables: FloatArray) -> FloatArray:
    rows = np.tensordot(weights[0], tables, axes=(1, 0))
    return np.asarray(np.moveaxis(np.tensordot(weights[1], rows, axes=(1, 1)), 0, 1))


def _weights(lines: tuple[float, ...], mesh: tuple[float, ...]) -> FloatArray:
    """Parts (N, n) that the lines have in what is read on a mesh within their ends."""
    if len(lines) == 1:
        return np.ones((len(mesh), 1))
    at, x = np.asarray(lines), np.clip(mesh, lines[0], lines[-1])
    below = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(lines) - 2)
    share = (x - at[below]) / (at[below + 1] - at[below])
    found, row = np.zeros((len(mesh), len(lines))), np.arange(len(mesh))
    found[row, below] = 1.0 - share
    found[row, below + 1] += share
    return found


def _even(ends: tuple[float, ...], count: int) -> tuple[float, ...]:
    low, high = ends[0], ends[-1]
    return (low,) if low == high else (*(low + (high - low) * k / (count - 1) for k in range(count - 1)), high)


def _cut(values: tuple[float, ...], parts: int) -> tuple[float, ...]:
    found = [low + (high - low) * k / parts for low, high in pairwise(values) for k in range(parts)]
    return (*found, values[-1])
