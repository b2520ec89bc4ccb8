"""The worst reference of bounded size and rate, as a linear programme on a mesh, and a proof from its dual.

In units of the amplitude the reference is rho with ``|rho| <= 1`` and ``|rho'| <= 1 / tau``, seen backwards from the
moment T of the peak (`design.worst_case.kernel`), and what it reaches is::

    J(rho) = (D + gamma(0)) rho(0) + int_0^inf gamma(s) rho'(s) ds

*From below.* With rho straight between the nodes that is a linear programme, solved exactly by dynamic programming.
The best that can be reached from the far end up to a node is a concave function of rho there; what is kept of it is,
for some levels u, the rho at which its slope is -u. Going over an interval where the mean of gamma is m widens the
function's top by as much as rho may travel: the rho of the levels above m rises by it, that of those below falls by it,
and all stay within -1 and 1. Every level is read once, at its own interval, so the levels are the means themselves.

*From above.* For any function u of bounded variation that ends at zero, by parts and by the two bounds of rho::

    J(rho) <= |D + gamma(0) - u(0)| + int |du| + 1 / tau int |u - gamma|

The best u is gamma where rho is -1 or 1 and constant where rho moves at its largest rate: a step response whose hills
are cut off where they are shorter than the reference can follow. Any u proves a bound, so u is read off the programme's
solution and its bound is worked out exactly. Where the two bounds differ the mesh is refined and all is done again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.worst_case.kernel import Samples
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: What rounding may keep a reference from rising or falling as fast as it may, over one interval.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Bounded(GridArrays):
    """gamma on a mesh, for N programmes, and the bounds of their references.

    Attributes
    ----------
    times : (N, k+1) nodes from 0 to 1, in horizons; some may be equal
    value : (N, k+1) gamma
    mean : (N, k) of gamma over each interval
    start : (N,) ``D + gamma(0)``
    travel_time : (N,) tau: amplitude over rate, in horizons
    """

    times: FloatArray
    value: FloatArray
    mean: FloatArray
    start: FloatArray
    travel_time: FloatArray

    @classmethod
    def on(cls, samples: Samples, start: FloatArray, travel_time: FloatArray, times: FloatArray) -> Bounded:
        """The programmes of N samples on nodes (N, k+1) that hold all of ``samples.nodes``."""
        row = np.repeat(np.arange(len(times)), times.shape[-1])
        value, area = (each.reshape(times.shape) for each in samples.at(row, times.reshape(-1)))
        length = np.diff(times)
        mean = np.diff(area) / np.where(length > 0.0, length, 1.0)
        left, right = value[:, :-1], value[:, 1:]  # gamma is monotone between them, whatever rounding says
        mean = np.clip(mean, np.minimum(left, right), np.maximum(left, right))
        return cls(times, value, mean, start, travel_time)

    @property
    def travel(self) -> FloatArray:
        """(N, k) by how much rho may change over each interval."""
        return np.asarray(np.diff(self.times) / self.travel_time[:, None])


@dataclass(frozen=True, eq=False)
class Reached(GridArrays):
    """The best references on the mesh.

    Attributes
    ----------
    rho : (N, k+1) at the nodes
    side : (N, k) +1 or -1 where rho rises or falls as fast as it may, 0 elsewhere
    value : (N,) what they reach, held at their last value before the horizon
    """

    rho: FloatArray
    side: IntArray
    value: FloatArray


@dataclass(frozen=True, eq=False)
class Proved(GridArrays):
    """Bounds from above.

    Attributes
    ----------
    value : (N,) that no reference exceeds, up to what lies beyond the horizon
    last : (N,) u at the horizon
    gap : (N, k) what each interval adds to the difference of the two bounds
    """

    value: FloatArray
    last: FloatArray
    gap: FloatArray


def reach(problem: Bounded) -> Reached:
    """Solve the programmes on their meshes."""
    level, travel = np.ascontiguousarray(problem.mean.T), np.ascontiguousarray(problem.travel.T)
    intervals = len(level)
    levels = np.concatenate([problem.start[None], level])
    places = np.sign(levels)  # beyond the horizon nothing is gained or lost: only the level 0 is undecided
    moves = np.empty_like(places)
    best = np.empty_like(level)
    for j in range(intervals - 1, -1, -1):
        best[j] = places[j + 1]
        some, move = places[: j + 1], moves[: j + 1]
        np.subtract(levels[: j + 1], level[j], out=move)
        np.copysign(travel[j], move, out=move)
        np.add(some, move, out=some)
        np.maximum(some, -1.0, out=some)
        np.minimum(some, 1.0, out=some)
    rho, side = np.empty((intervals + 1, problem.start.size)), np.empty(level.shape, dtype=np.int64)
    rho[0] = places[0]
    for j in range(intervals):
        low, high = rho[j] - travel[j], rho[j] + travel[j]
        side[j] = (best[j] > high - _ROUNDING).astype(np.int64) - (best[j] < low + _ROUNDING)
        after = np.minimum(np.maximum(best[j], low), high)
        rho[j + 1] = np.where(np.abs(after) > 1.0 - _ROUNDING, np.sign(after), after)
    rho, side = np.ascontiguousarray(rho.T), np.ascontiguousarray(side.T)
    value = problem.start * rho[:, 0] + (problem.mean * np.diff(rho)).sum(axis=-1)
    return Reached(rho, side, value)


def prove(problem: Bounded, reached: Reached, samples: Samples) -> Proved:
    """Bounds from above, by a u that is read off the best references."""
    rho = reached.rho
    bound = np.abs(rho) == 1.0
    resting = bound[:, :-1] & (rho[:, :-1] == rho[:, 1:])
    level = _levels(problem, reached, resting)
    low, high = _range(problem, level, resting)
    first, last = (np.clip(value, low, high) for value in (problem.value[:, :-1], problem.value[:, 1:]))
    jump = first - np.concatenate([problem.start[:, None], last[:, :-1]], axis=-1)
    rise = last - first
    cost = (_excess(problem, samples, high, 1) + _excess(problem, samples, low, -1)) * problem.travel
    moved = np.diff(rho) * (problem.mean - level)
    gap = np.abs(jump) + np.abs(rise) + rho[:, :-1] * (jump + rise) + cost - moved
    value = (np.abs(jump) + np.abs(rise) + cost).sum(axis=-1)
    return Proved(value, last[:, -1], gap)


def _levels(problem: Bounded, reached: Reached, resting: BoolArray) -> FloatArray:
    """(N, k) u where rho moves: one number from one node where rho is -1 or 1 to the next such node.

    It may not be above the mean of an interval over which rho rises as fast as it may, nor below that of one over
    which it falls so. At its ends u meets gamma, and may only fall where rho is 1 and rise where it is -1. It is in the
    middle of what both leave, or of what the means leave where gamma at the ends says otherwise.
    """
    count, k = resting.shape
    moving = problem.travel > 2.0 * _ROUNDING
    high = np.where((reached.side >= 0) & moving, problem.mean, np.inf).reshape(-1)
    low = np.where((reached.side <= 0) & moving, problem.mean, -np.inf).reshape(-1)
    begins = np.abs(reached.rho[:, :-1]) == 1.0
    begins[:, 0] = True
    first = np.flatnonzero(begins)
    ends = np.append(first[1:], begins.size) - 1
    row, last = np.divmod(ends, k)
    high, low = np.minimum.reduceat(high, first), np.maximum.reduceat(low, first)
    # where rho rests before or after, u leaves gamma or meets it anywhere in the interval next to this one
    begin, end = first - row * k, last + 1
    begin = begin - ((begin > 0) & resting[row, begin - 1])
    end = end + ((end < k) & resting[row, np.minimum(end, k - 1)])
    left, right = problem.value[row, begin], problem.value[row, end]
    up, down = reached.rho[row, first - row * k], -reached.rho[row, last + 1]
    highest = np.minimum(np.where(up == 1.0, left, np.inf), np.where(down == 1.0, right, np.inf))
    lowest = np.maximum(np.where(up == -1.0, left, -np.inf), np.where(down == -1.0, right, -np.inf))
    agree = np.maximum(low, lowest) <= np.minimum(high, highest)
    high, low = np.where(agree, np.minimum(high, highest), high), np.where(agree, np.maximum(low, lowest), low)
    high = np.where(high == np.inf, np.maximum(np.minimum(left, right), low), high)
    low = np.where(low == -np.inf, np.minimum(np.maximum(left, right), high), low)
    level = np.where(low == -np.inf, 0.0, 0.5 * (low + high))
    # where rho is not at a bound u cannot jump, at neither end of the time there is
    level = np.where((last == k - 1) & (np.abs(reached.rho[row, -1]) < 1.0), 0.0, level)
    level = np.where((first == row * k) & (np.abs(reached.rho[row, 0]) < 1.0), problem.start[row], level)
    return np.repeat(level, np.diff(np.append(first, count * k))).reshape(count, k)


def _range(problem: Bounded, level: FloatArray, resting: BoolArray) -> tuple[FloatArray, FloatArray]:
    """(N, k) between which u is gamma where rho rests: the levels before and after; elsewhere both are the level."""
    count, k = resting.shape
    places = np.broadcast_to(np.arange(1, k + 1), (count, k))
    back = np.maximum.accumulate(np.where(resting, 0, places), axis=-1)
    ahead = np.minimum.accumulate(np.where(resting, k + 1, places)[:, ::-1], axis=-1)[:, ::-1]
    levels = np.concatenate([problem.start[:, None], level, np.zeros((count, 1))], axis=-1)
    before, after = np.take_along_axis(levels, back, axis=-1), np.take_along_axis(levels, ahead, axis=-1)
    return np.minimum(before, after), np.maximum(before, after)


def _excess(problem: Bounded, samples: Samples, level: FloatArray, sign: int) -> FloatArray:
    """(N, k) means over each interval of how far gamma is above the level (sign 1) or below it (sign -1).

    gamma is monotone there, so where only one end is beyond the level it is crossed once.
    """
    left, right = (sign * (value - level) for value in (problem.value[:, :-1], problem.value[:, 1:]))
    excess = np.where((left > 0.0) & (right > 0.0), sign * (problem.mean - level), 0.0)
    row, j = np.nonzero(((left > 0.0) != (right > 0.0)) & (problem.travel > 0.0))
    low, high = problem.times[row, j], problem.times[row, j + 1]
    middle = samples.crossing(row, low, high, level[row, j])
    first = left[row, j] > 0.0
    outer = np.where(first, low, high)
    area = np.where(first, 1.0, -1.0) * (samples.at(row, middle)[1] - samples.at(row, outer)[1])
    part = sign * (area - level[row, j] * np.abs(middle - outer)) / (high - low)
    excess[row, j] = np.maximum(part, 0.0)
    return excess
