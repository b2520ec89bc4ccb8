"""Largest gains over all frequencies, each with the proof that none is higher."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.robustness.gains import Gains, every_gain
from design.robustness.input_loop import InputLoop, complementary, value, with_derivatives
from design.robustness.level_set import Nodes, crossings, nodes
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: A squared gain is proved to be the largest to within this part of it.
RESOLUTION = 1e-10
#: Two or three passes prove a peak; more are for loops that are next to unstable.
LARGEST_NUMBER_OF_PASSES = 30
#: Steps to a peak end when the last one raises the gain by no more than this part of it, or after so many.
SETTLED, LARGEST_NUMBER_OF_STEPS = 1e-8, 20


@dataclass(frozen=True, eq=False)
class Place(GridArrays):
    """Where to climb from (R,), and how far to either side [rad/s]."""

    omega: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class Summits:
    """The highest places found so far.

    Attributes
    ----------
    height : (R,) squared gain
    omega : (R,) frequency [rad/s]
    T : (R, 2, 2) there; for infinite frequency, the way in which it goes to its limit
    """

    height: FloatArray
    omega: FloatArray
    T: ComplexArray

    def raise_to(self, rows: IntArray | BoolArray, found: Summits) -> None:
        """Put what was found in the place of some rows."""
        self.height[rows], self.omega[rows], self.T[rows] = found.height, found.omega, found.T


@dataclass(frozen=True, eq=False)
class Peaks(GridArrays):
    """The five gains of `design.robustness.gains`, in that order.

    Attributes
    ----------
    gain, omega : (N, 5) peak and its frequency [rad/s], 0 and inf included
    T : (N, 5, 2, 2) complementary sensitivity there
    proved : (N,) whether none of them is higher elsewhere, beyond rounding
    """

    gain: FloatArray
    omega: FloatArray
    T: ComplexArray
    proved: BoolArray


def peaks(loop: InputLoop) -> Peaks:
    """Peaks of the five gains without delay.

    From the best of a few frequencies Newton's method climbs to the top; then the crossings of the level just above
    it show whether, and between which frequencies, a gain is higher, and the search goes on from there. Crossings of a
    structured singular value are asked for only where a scaled largest one, which is cheaper, leaves it open.
    """
    points = len(loop.A)
    gains, rows = every_gain(points)
    known = nodes(loop, 2)
    limit = loop.D[rows].astype(complex)
    top = Summits(gains.of(limit), np.full(len(rows), np.inf), (loop.D + loop.K @ loop.B).astype(complex)[rows])
    higher, place = _start(loop, known, rows, gains, top.height)
    top.raise_to(higher, climbed(loop, rows[higher], gains.take(higher), place))
    active = np.flatnonzero(top.height > 0.0)
    cover = gains.take(active).covered(top.T[active])
    active = active[_above(loop, known, rows[active], cover, top.height[active])[0]]
    proved = np.ones(len(rows), dtype=bool)
    for structured in (True, False):
        left = active[gains.structured[active] == structured]
        for _ in range(LARGEST_NUMBER_OF_PASSES):
            if not left.size:
                break
            higher, place = _above(loop, known, rows[left], gains.take(left), top.height[left])
            left = left[higher]
            top.raise_to(left, climbed(loop, rows[left], gains.take(left), place))
        proved[left] = False
    shape = (points, -1)
    return Peaks(
        np.sqrt(top.height).reshape(shape),
        top.omega.reshape(shape),
        np.where(np.isinf(top.omega)[:, None, None], limit, top.T).reshape(*shape, 2, 2),
        np.asarray(proved.reshape(shape).all(axis=-1)),
    )


def _start(loop: InputLoop, known: Nodes, rows: IntArray, gains: Gains, limit: FloatArray) -> tuple[BoolArray, Place]:
    """Which rows (R,) are above `limit` (R,) at the nodes, the poles' frequencies or 0, and where they are most."""
    more = np.concatenate([np.zeros((len(loop.A), 1)), np.abs(loop.poles.imag)], axis=-1)
    omega = np.concatenate([more, known.omega], axis=-1)
    height = gains.of(np.concatenate([complementary(loop, more), known.T], axis=1)[rows])
    best = np.argmax(height, axis=-1)
    higher = height[np.arange(len(rows)), best] > limit
    omega, best = omega[rows[higher]], best[higher]
    start = omega[np.arange(len(best)), best]
    low = np.where(omega < start[:, None], omega, 0.0).max(axis=-1)
    high = np.where(omega > start[:, None], omega, np.inf).min(axis=-1)
    return higher, Place(start, low, np.where(np.isfinite(high), high, 2.0 * start))


def _above(loop: InputLoop, known: Nodes, rows: IntArray, gains: Gains, height: FloatArray) -> tuple[BoolArray, Place]:
    """Which rows (R,) have a gain above `height` (R,), and where it is most amid two crossings."""
    level = height * (1.0 + RESOLUTION)
    edges = crossings(known, rows, gains, level)
    # A cover may be above the level at 0 and at infinity, too.
    ends = np.zeros(len(rows)), 2.0 * np.fmax.reduce(edges, axis=-1)
    edges = np.sort(np.column_stack([ends[0], edges, ends[1]]), axis=-1)
    inner = 0.5 * (edges[:, 1:] + edges[:, :-1])
    row, column = np.nonzero(~np.isnan(inner))
    if not row.size:
        return np.zeros(len(rows), dtype=bool), Place(level[:0], level[:0], level[:0])
    found = np.full(inner.shape, -np.inf)
    found[row, column] = gains.take(row).of(value(loop, rows[row], inner[row, column]))
    best = np.argmax(found, axis=-1)
    higher = found[np.arange(len(rows)), best] > level
    row, best = np.flatnonzero(higher), best[higher]
    return higher, Place(inner[row, best], edges[row, best], edges[row, best + 1])


def climbed(loop: InputLoop, rows: IntArray, gains: Gains, place: Place) -> Summits:
    """The summit that each row reaches from its place.

    By Newton's method or, where it would leave what is left of the interval, by halving.
    """
    omega, low, high = place.omega.copy(), place.low.copy(), place.high.copy()
    height, best = np.full(omega.shape, -np.inf), omega.copy()
    # The slope at 0 is 0, because a gain is the same at -w.
    active = np.flatnonzero(omega > 0.0)
    for _ in range(LARGEST_NUMBER_OF_STEPS):
        if not active.size:
            break
        w = omega[active]
        h, slope, step = gains.take(active).step_to_peak(*with_derivatives(loop, rows[active], w))
        better = h > height[active]
        height[active[better]], best[active[better]] = h[better], w[better]
        left, right = np.where(slope > 0.0, w, low[active]), np.where(slope < 0.0, w, high[active])
        low[active], high[active] = left, right
        with np.errstate(invalid="ignore"):
            inside = (w + step >= left) & (w + step <= right) & (step * slope >= 0.0)
            settled = ~(np.abs(slope) > 0.0) | (inside & (slope * step <= SETTLED * h))
        w = np.where(inside, w + step, 0.5 * (left + right))
        omega[active] = w
        # The last step is taken unseen: the parabola is as good as the function there.
        done = active[settled & inside]
        best[done] = omega[done]
        active = active[~settled]
    T = value(loop, rows, best)
    return Summits(gains.of(T), best, T)
