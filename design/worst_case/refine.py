"""Both bounds of programmes, on meshes that are refined where the two differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from design.worst_case.kernel import INTERPOLATION, Samples
from design.worst_case.programme import Bounded, Proved, Reached, prove, reach
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Where the bounds differ by less than this part of their value the mesh is fine enough.
CLOSE = 1e-4
#: Passes of refinement, and parts into which each makes an interval.
_PASSES, _PARTS = 5, 6
#: Numbers in the table of levels of the rows that are solved together: what a processor keeps at hand.
_TABLE = 30_000


@dataclass(frozen=True, eq=False)
class Pass(GridArrays):
    """One pass over the rows that the passes before left open: ``row`` (M,) says which of the N they are."""

    row: IntArray
    problem: Bounded
    reached: Reached
    proved: Proved


@dataclass(frozen=True, eq=False)
class Bounds(GridArrays):
    """What a reference of size 1 can reach at most, each (N,): for certain (`lower`) and at most (`upper`)."""

    lower: FloatArray
    upper: FloatArray


def unlimited(samples: Samples, direct: FloatArray) -> Bounds:
    """Bounds (N,) for references that may jump: what reaches the output directly (N,), and ``int |g|``."""
    row = np.repeat(np.arange(len(direct)), samples.nodes.shape[-1])
    value, _ = samples.at(row, samples.nodes.reshape(-1))
    variation = np.abs(np.diff(value.reshape(len(direct), -1))).sum(axis=-1)
    value = np.abs(direct) + variation
    return Bounds(np.maximum(value - samples.error, 0.0), value + samples.error + samples.beyond)


def limited(samples: Samples, direct: FloatArray, travel_time: FloatArray) -> Bounds:
    """Bounds (N,) for references that take `travel_time` (N,) [horizons] to change by their size."""
    free = unlimited(samples, direct)
    lower, upper = np.zeros(len(direct)), free.upper.copy()
    for each in passes(samples, direct, travel_time):
        row, rate = each.row, 1.0 / travel_time[each.row]
        end, ahead = each.proved.last, each.problem.value[:, -1]
        rest = np.minimum(
            np.abs(end) + rate * samples.area_beyond[row],  # u zero beyond the horizon
            np.abs(ahead - end) + samples.beyond[row],  # u as gamma there
        )
        # an error of gamma counts by its variation or, u and rho as they are, by its integral over tau
        error = samples.error[row] * np.minimum(1.0, rate) + INTERPOLATION * each.proved.value
        upper[row] = np.minimum(upper[row], each.proved.value + rest + error)
        lower[row] = np.maximum(lower[row], each.reached.value - error)
    return Bounds(lower, upper)


def passes(samples: Samples, direct: FloatArray, travel_time: FloatArray) -> Iterator[Pass]:
    """Solve N programmes, again and again where their bounds are not close, on ever finer meshes."""
    width = max(_TABLE // samples.nodes.shape[-1], 1)
    for first in range(0, len(direct), width):
        row = np.arange(first, min(first + width, len(direct)))
        times = samples.nodes[row]
        for _ in range(_PASSES):
            some = samples.take(row)
            problem = Bounded.on(some, direct[row] + some.value[:, 0, 0], travel_time[row], times)
            reached = reach(problem)
            proved = prove(problem, reached, some)
            yield Pass(row, problem, reached, proved)
            left = proved.value - reached.value > CLOSE * proved.value
            if not left.any():
                break
            row, times = row[left], _split(times[left], _worth(proved.take(left)))


def _worth(proved: Proved) -> BoolArray:
    """(N, k) mask of the intervals that keep the bounds apart, with those next to them."""
    large = proved.gap > 0.05 * CLOSE * proved.value[:, None]
    large[:, 1:] |= large[:, :-1]
    large[:, :-1] |= large[:, 1:]
    return large


def _split(times: FloatArray, where: BoolArray) -> FloatArray:
    """Nodes (N, k+1) with those inside some intervals (N, k), all made equal in number by repeating the last."""
    row, j = np.nonzero(where)
    low, high = times[row, j], times[row, j + 1]
    inside = low[:, None] + (high - low)[:, None] * (np.arange(1, _PARTS) / _PARTS)
    count = np.bincount(row, minlength=len(times)) * (_PARTS - 1)
    more = np.ones((len(times), int(count.max(initial=0))))
    more[np.arange(more.shape[-1]) < count[:, None]] = inside.reshape(-1)
    return np.sort(np.concatenate([times, more], axis=-1), axis=-1)
