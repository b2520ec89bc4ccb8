"""Side-by-side timing: ours and the peer in turn, in one run, and the ratio pair by pair."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


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
    """

    job: str
    peer: str
    goal: float
    ours: Callable[[], Any]
    theirs: Callable[[], Any]
    agree: Callable[[Any, Any], None]


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
    ours, theirs = [], []
    for _ in range(repeats):
        ours.append(_seconds(row.ours))
        theirs.append(_seconds(row.theirs))
    return Measured(row, ours, theirs)


def _seconds(work: Callable[[], Any]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
