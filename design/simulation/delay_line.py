"""Commands under way: what arrives now is what was commanded a delay ago, between steps by cubic Hermite."""

from __future__ import annotations

import numpy as np

from design.delay.characteristic import SHORTEST
from model.arrays import FloatArray, IntArray

#: A lookup this part of a step beside a node is on the side of the node that it came from.
_SIDE = 1e-6


class DelayLine:
    """Commands u and their rates at the nodes of a simulation, and what arrives of them.

    Nodes stand in order of time; where a command jumps there are two of one time. Before the first node, at rest, the
    commands are zero. No step may be longer than the shortest delay.
    """

    def __init__(self, delay: tuple[float, ...], nodes: int, points: int) -> None:
        self._late = [d if d > SHORTEST else 0.0 for d in delay]
        self._time = np.empty(nodes)
        self._value = np.empty((nodes, len(delay), points))
        self._rate = np.empty_like(self._value)
        self._count = 0

    def push(self, time: float, u: FloatArray, rate: FloatArray) -> None:
        """Add a node: commands (m, P) and their rates."""
        k = self._count
        self._time[k], self._value[k], self._rate[k] = time, u, rate
        self._count = k + 1

    def arriving(
        self, time: FloatArray, side: float, step: float, u: FloatArray, points: IntArray | None = None
    ) -> FloatArray:
        """Commands (m, P) that arrive at times (P,) or (1,); u (m, P) those given now, for what has no delay.

        Parameters
        ----------
        side : where a time is that of a node, +1 for just after it, -1 for just before
        step : the step within which the times are [s]
        points : which of the points these are
        """
        found = np.zeros_like(u)
        for i, delay in enumerate(self._late):
            if not delay:
                found[i] = u[i]
            elif self._count:
                found[i] = self._at(i, time - delay + side * _SIDE * step, points)
        return found

    def _at(self, i: int, time: FloatArray, points: IntArray | None) -> FloatArray:
        known = self._time[: self._count]
        k = np.clip(np.searchsorted(known, time, side="right") - 1, 0, max(self._count - 2, 0))
        after = np.minimum(k + 1, self._count - 1)
        if points is None and k.size == 1:
            at: tuple[IntArray | int | slice, ...] = (int(k[0]), i)
            to: tuple[IntArray | int | slice, ...] = (int(after[0]), i)
        else:
            columns = np.arange(self._value.shape[-1]) if points is None else points
            at, to = (k, np.full_like(k, i), columns), (after, np.full_like(k, i), columns)
        width = known[after] - known[k]
        s = np.clip((time - known[k]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
        rest = 1.0 - s
        value = (
            (1.0 + 2.0 * s) * rest**2 * self._value[at] + s**2 * (3.0 - 2.0 * s) * self._value[to]
            + width * s * rest * (rest * self._rate[at] - s * self._rate[to])
        )  # fmt: skip
        return np.where(time < known[0], 0.0, value)
