"""The times of a simulation: samples between the knots of the manoeuvre, and steps between the samples.

Runge-Kutta's method of order four errs on a mode ``exp(p t)`` by about ``(h |p|)^4 / 120`` of its size. A point's step
is what that needs for the tolerance, with p the fastest pole of its loop, closed or cut (a saturated loop is a cut
one), divided out of the sampling interval by a power of two. So a point's steps do not depend on its neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from design.delay.characteristic import SHORTEST
from design.manoeuvre import Manoeuvre
from model.arrays import FloatArray, IntArray

#: Largest ``h |p|``, whatever the tolerance: Runge-Kutta's method is stable to 2.78.
LARGEST_STEP = 1.0
#: Steps of a whole simulation above which a point is not simulated.
LARGEST_COUNT = 400_000
#: Times closer than this part of the duration are one.
_SAME = 1e-12
#: A jump that arrives late jumps again in what it drives: so often it is followed.
_ECHOES = 3


@dataclass(frozen=True, eq=False)
class Segment:
    """Even steps from one mark to the next: begin and end [s], number of sampling intervals, knot of the manoeuvre."""

    begin: float
    end: float
    intervals: int
    knot: int

    def times(self, substeps: int) -> FloatArray:
        """(intervals * substeps + 1,) [s], the end exact."""
        return np.linspace(self.begin, self.end, self.intervals * substeps + 1)


def segments(manoeuvre: Manoeuvre, delay: tuple[float, ...], duration: float, samples: int) -> tuple[Segment, ...]:
    """Segments that end where references bend or jump and where a jump arrives behind a delay.

    The samples are ``duration / (samples - 1)`` apart at most.
    """
    late = sorted({d for d in delay if d > SHORTEST})
    jumping = manoeuvre.times[np.any(manoeuvre.jumps != 0.0, axis=-1)]
    echoes = np.zeros(1)
    for _ in range(_ECHOES if late else 0):
        echoes = np.unique(np.concatenate([echoes, *(echoes + d for d in late)]))
    marks = np.concatenate([manoeuvre.times, np.add.outer(jumping, echoes).ravel(), [0.0, duration]])
    marks = np.unique(marks[marks <= duration])
    kept = np.append(True, np.diff(marks) > _SAME * duration)
    marks = marks[kept]
    marks[-1] = duration
    found = []
    for begin, end in pairwise(marks.tolist()):
        count = max(1, int(np.ceil((end - begin) / duration * (samples - 1) * (1.0 - 1e-9))))
        knot = int(np.searchsorted(manoeuvre.times, 0.5 * (begin + end), side="right")) - 1
        found.append(Segment(begin, end, count, knot))
    return tuple(found)


def needed_substeps(
    closed: FloatArray, opened: FloatArray, tolerance: float, interval: float, delay: tuple[float, ...]
) -> IntArray:
    """Steps in a sampling interval (*G,), a power of two; no step is longer than a delay.

    Parameters
    ----------
    closed, opened : (*G, n, n) matrices of the loop, closed and cut
    tolerance : wanted error
    interval : longest time between samples [s]
    delay : of each input [s]
    """
    fastest = np.maximum(*(np.abs(np.linalg.eigvals(M)).max(axis=-1) for M in (closed, opened)))
    step = min(LARGEST_STEP, float((120.0 * tolerance) ** 0.25)) / np.maximum(fastest, 1e-300)
    shortest = min((d for d in delay if d > SHORTEST), default=np.inf)
    turns = np.maximum(interval / np.minimum(step, shortest), 1.0)
    return np.asarray(2 ** np.ceil(np.log2(np.minimum(turns, 2.0**40)) - 1e-9).astype(np.int64))
