"""Gains at which the poles of a locus are computed first: the special ones, and a few in between.

Special are both ends of the range, the gain chosen, the gains at which poles cross the imaginary axis, and those at
which poles meet, or all but meet. From there poles move like the square root of the distance: between special gains
the logarithm of the gain is made a function of a place x in which they move evenly, and the nodes are even in x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.landmarks import Landmarks, Marks, StationaryPoints
from model.arrays import BoolArray, FloatArray, IntArray

#: A locus runs from this part of the reference gain to its inverse times it.
DECADES_EACH_WAY = 2.0
_RANGE = DECADES_EACH_WAY * np.log(10.0)
#: About as many nodes are spread over the range, and one more on either side of a gain at which poles meet.
SPREAD = 12
#: At most this part of the samples are nodes.
MOST = 0.4
#: Poles all but meet at a complex gain with no more than this ratio of imaginary to real part.
ALL_BUT = 0.5
#: Special gains nearer to each other than this part are one; so are those where poles all but meet, and others.
SAME, NEARLY_SAME = 1e-9, 0.02


@dataclass(frozen=True, eq=False)
class Stretches:
    """L stretches of gains between neighbouring nodes, those of a point in rising order, one point after the other.

    Attributes
    ----------
    row : (L,) the point
    low, high : (L,) gains of the nodes
    log_low, log_width : (L,) the special gains around it, as logarithms; -inf and 0 for the one from the gain 0
    meet_low, meet_high : (L,) whether poles meet there
    x_low, x_high : (L,) places of the nodes between the special gains, from 0 to 1
    """

    row: IntArray
    low: FloatArray
    high: FloatArray
    log_low: FloatArray
    log_width: FloatArray
    meet_low: BoolArray
    meet_high: BoolArray
    x_low: FloatArray
    x_high: FloatArray

    def gains(self, stretch: IntArray, part: FloatArray) -> FloatArray:
        """Gains (S,) at the parts (S,) of the way through the stretches (S,), the way being that in x."""
        low, width, x = self.log_low[stretch], self.log_width[stretch], self.x_low[stretch]
        even = _even(x + part * (self.x_high[stretch] - x), self.meet_low[stretch], self.meet_high[stretch])
        # Multiple poles of the open loop part like roots of the gain, too.
        return np.where(np.isinf(low), self.high[stretch] * part**2, np.exp(low + width * even))


def stretches(
    landmarks: Landmarks,
    crossing: Marks,
    breakaway: Marks,
    stationary: StationaryPoints,
    include: BoolArray,
    count: int,
) -> Stretches:
    """Stretches of N points, the first of each from the gain 0 to the low end of the range.

    Parameters
    ----------
    include : (N,) whether the reference gain is to be a node
    count : number of samples, of which the nodes are a part
    """
    gain, meets = _special(landmarks, crossing, breakaway, stationary, include)
    N = len(gain)
    gain = np.concatenate([np.zeros((N, 1)), gain], axis=-1)
    meets = np.concatenate([np.zeros((N, 1), dtype=bool), meets], axis=-1)
    with np.errstate(divide="ignore"):
        log = np.log(gain)
    width = np.diff(log)
    width[:, 0] = 0.0
    there = ~np.isnan(width)
    beside = meets[:, :-1].astype(int) + meets[:, 1:]
    wanted = np.where(there, np.rint(np.nan_to_num(width) * SPREAD / (2.0 * _RANGE)) + beside, 0.0)
    room = np.maximum(MOST * count - there.sum(axis=-1), 0.0)
    scale = np.minimum(1.0, room / np.maximum(wanted.sum(axis=-1), 1.0))
    parts = np.where(there, 1 + np.floor(wanted * scale[:, None]).astype(int), 0)
    row, column = np.nonzero(there)
    parts = parts[there]
    first = np.cumsum(parts) - parts
    row, column, m = (np.repeat(v, parts) for v in (row, column, parts))
    i = np.arange(m.size) - np.repeat(first, parts)
    log_low, log_width = log[row, column], width[row, column]
    meet_low, meet_high = meets[row, column], meets[row, column + 1]
    low, high = (
        np.where(j == end, v[row, column], np.exp(log_low + log_width * _even(j / m, meet_low, meet_high)))
        for j, end, v in ((i, 0, gain[:, :-1]), (i + 1, m, gain[:, 1:]))
    )
    return Stretches(row, low, high, log_low, log_width, meet_low, meet_high, i / m, (i + 1) / m)


def _even(x: FloatArray, meet_low: BoolArray, meet_high: BoolArray) -> FloatArray:
    """How far the logarithm of the gain has come at the places x, in parts of the way between two special gains."""
    one_side = np.where(meet_low, x**2, np.where(meet_high, x * (2.0 - x), x))
    return np.where(meet_low & meet_high, np.sin(0.5 * np.pi * x) ** 2, one_side)


def _special(
    landmarks: Landmarks, crossing: Marks, breakaway: Marks, stationary: StationaryPoints, include: BoolArray
) -> tuple[FloatArray, BoolArray]:
    """Special gains (N, Q), rising, nan padded, and whether poles meet there, or all but meet."""
    centre = landmarks.reference[:, None]
    ends = centre * 10.0 ** np.array([-DECADES_EACH_WAY, DECADES_EACH_WAY])
    k = stationary.gain
    with np.errstate(invalid="ignore", divide="ignore"):
        all_but = (k.imag >= 0.0) & (k.imag <= ALL_BUT * k.real)
        known = np.abs(k.real[:, :, None] / breakaway.gain[:, None, :] - 1.0) < NEARLY_SAME
        near = np.where(all_but & ~known.any(axis=-1), k.real, np.nan)
        marks = np.concatenate([crossing.gain, breakaway.gain, near], axis=-1)
        marks = np.where(np.abs(marks / centre - 1.0) <= SAME, centre, marks)
        marks = np.where((marks > ends[:, :1] * (1.0 + SAME)) & (marks < ends[:, 1:] * (1.0 - SAME)), marks, np.nan)
    gain = np.concatenate([ends, np.where(include[:, None], centre, np.nan), marks], axis=-1)
    meets = np.zeros(gain.shape, dtype=bool)
    meets[:, 3 + crossing.gain.shape[-1] :] = True
    gain, meets = _sorted(gain, meets)
    with np.errstate(invalid="ignore"):
        again = gain[:, 1:] <= gain[:, :-1] * (1.0 + SAME)
    meets[:, :-1] |= again & meets[:, 1:]
    gain[:, 1:][again] = np.nan
    gain, meets = _sorted(gain, meets)
    return gain, meets & ~np.isnan(gain)


def _sorted(gain: FloatArray, meets: BoolArray) -> tuple[FloatArray, BoolArray]:
    order = np.argsort(gain, axis=-1, stable=True)
    return np.take_along_axis(gain, order, axis=-1), np.take_along_axis(meets, order, axis=-1)
