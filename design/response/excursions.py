"""What a signal does on the other side of zero between two samples that are both on this side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.response.extremes import NOISE
from design.response.interpolant import Polynomials, windows
from model.arrays import FloatArray, IntArray

#: Zero may be reached from this many times as far as the slope at the sample leads within an interval.
_REACH = 2.0


@dataclass(frozen=True, eq=False)
class Excursions:
    """Excursions (E,): row and interval of each, where it begins and ends [samples], its course and side (1, -1)."""

    row: IntArray
    interval: IntArray
    begin: FloatArray
    end: FloatArray
    course: Polynomials
    side: FloatArray


def hidden_excursions(rows: FloatArray, size: FloatArray) -> Excursions:
    """Where rows cross zero and come back between two samples beside each other.

    Parameters
    ----------
    rows : (R, m+1) even samples that resolve the signals
    size : (R,) of the signals: what is rounding is so beside it
    """
    differences = np.diff(rows)
    slope = np.empty_like(rows)
    slope[:, 1:-1] = 0.5 * (differences[:, 1:] + differences[:, :-1])
    slope[:, 0] = 1.5 * differences[:, 0] - 0.5 * differences[:, 1]
    slope[:, -1] = 1.5 * differences[:, -1] - 0.5 * differences[:, -2]
    # It leads to zero at the one sample and away from it at the other, fast enough to have been there.
    turns = (slope[:, :-1] * slope[:, 1:] < 0.0) & (rows[:, :-1] * slope[:, :-1] < 0.0)
    row, k = np.nonzero(turns)
    before, after, there, back = (each[row, k + i] for each in (rows, slope) for i in (0, 1))
    near = (np.abs(before) < _REACH * np.abs(there)) & (np.abs(after) < _REACH * np.abs(back))
    near &= (before * after > 0.0) & (np.abs(there) > NOISE * size[row])
    row, k, side = row[near], k[near], -np.sign(before[near])
    low = k.astype(float)
    course = windows(rows, row, low + 0.5)
    place = course.derivative().root(low, low + 1.0, low + 0.5)
    crosses = np.flatnonzero(course.value(place) * side > 0.0)
    row, k, side, low, place = row[crosses], k[crosses], side[crosses], low[crosses], place[crosses]
    course = Polynomials(course.coefficients[:, crosses], course.origin[crosses])
    begin = course.root(low, place, 0.5 * (low + place))
    end = course.root(place, low + 1.0, 0.5 * (place + low + 1.0))
    return Excursions(row, k, begin, end, course, side)
