"""Side-by-side timing: ours and the peer in turn, in one run, and the ratio pair by pair."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Shortest timing [s]; both sides are called as often as it takes to fill it.
SHORTEST = 0.05


@dataclass(frozen=True)
class Row:
    """One comparison of equal work.

    Attributes
    ----------
    job : what both do
    peer : whose way the other one is
    goal : ratio peer / ours that we mean to reach
    ours, theirs : the work, without arguments; both return what they computed
    agree : raises AssertionError unless the two results are the same within the stated tolerance
    copies : how many times the peer's work ours does; the peer's time is multiplied by it
    """

    job: str
    peer: str
    goal: float
    ours: Callable[[], Any]
    theirs: Callable[[], Any]
    agree: Callable[[Any, Any], None]
    copies: int = 1


@dataclass(frozen=True)
class Measured:
    """Wall times [s] of both sides, run in turn."""

    row: Row
    ours: list[float]
    theirs: list[float]

    @property
    def ratio(self) -> float:
        """Best time of the peer over the best of ours."""
        return min(self.theirs) / min(self.ours)

    @property
    def spread(self) -> tuple[float, float]:
        """Smallest and largest ratio of a pair run one after the other."""
        pairs = np.array(self.theirs) / np.array(self.ours)
        return float(pairs.min()), float(pairs.max())


def measure(row: Row, repeats: int) -> Measured:
    """Check that both sides agree, then time them in turn `repeats` times."""
    row.agree(row.ours(), row.theirs())
    calls_of_ours, calls_of_theirs = _calls(row.ours), _calls(row.theirs)
    ours, theirs = [], []
    for _ in range(repeats):
        ours.append(_seconds(row.ours, calls_of_ours))
        theirs.append(row.copies * _seconds(row.theirs, calls_of_theirs))
    return Measured(row, ours, theirs)


def _calls(work: Callable[[], Any]) -> int:
    """How many calls make one timing: enough for `SHORTEST`, so that a short job is not timed cold."""
    return max(1, int(SHORTEST / _seconds(work, 1)))


def _seconds(work: Callable[[], Any], calls: int) -> float:
    """Mean wall time [s] of a call."""
    start = time.perf_counter()
    for _ in range(calls):
        work()
    return (time.perf_counter() - start) / calls
