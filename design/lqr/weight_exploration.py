"""From many starts, and from leaps away from the best of them, to the best place of each of many searches.

Loops that need little lie far apart, behind walls: a descent from one start ends in the best of them perhaps once in
ten times. So the box is covered with places, there are descents from the best of these that lie apart, and from the
best place that they come to more of them, one from each of the places a long leap away along one unknown.
"""

from __future__ import annotations

import numpy as np

from design.lqr.weight_descent import Descent
from design.lqr.weight_models import HIGHEST_PUSH, Judge, Place
from model.arrays import BoolArray, FloatArray, IntArray

#: Places that cover the box, how many of them descents begin at, and how far these are apart, as a part of the box.
_COVERING, _STARTS, _APART = 500, 40, 0.1
#: The places cover a box this much larger and are brought back to its sides: a weight that does not count is at a side.
_BEYOND = 1.2
#: Rounds of the descents, how many of them go on, and their further rounds.
_FIRST, _LEADERS, _SECOND = 5, 10, 6
#: A leap along one unknown as a part of the box, the rounds from there, how many go on, and the rounds of the last one.
_LEAP, _AFTER_LEAP, _LANDED, _LAST = 0.27, 5, 2, 12
#: Places nearer than this part of the box are the same.
_SAME = 0.03
#: What puts a place that is too near to a better one behind all others.
_BEHIND = 1e9


def explore(judge: Judge, role: IntArray, begin: FloatArray, low: FloatArray, high: FloatArray) -> Place:
    """Best place of each of C searches.

    Parameters
    ----------
    judge : numbers of unknowns in the searches of these numbers
    role : (C, F)
    begin : (C, S, n) starts
    low, high : (C, n)
    """
    (count, n), given = low.shape, begin.shape[1]
    size = (high - low)[:, None]
    cover = np.clip(0.5 + _BEYOND * (covering_points(_COVERING, n) - 0.5), 0.0, 1.0)
    z = np.concatenate([begin, low[:, None] + size * cover], axis=1)
    tried = z.shape[1]
    numbers = judge(z.reshape(-1, n), np.repeat(np.arange(count), tried)).reshape(count, tried, -1)
    rank = Place.of(z, numbers, role[:, None]).ranked()
    rank[:, :given] -= _BEHIND
    chosen, _ = _apart(rank, z / np.maximum(size, 1e-9), given + _STARTS, _APART)
    descents = Descents(judge, role, np.take_along_axis(z, chosen[..., None], axis=1), low, high)
    descents.run(_FIRST, _LEADERS, thorough=False)
    descents.run(_SECOND, 2)
    return leap(judge, role, descents.best().z, low, high)


def leap(judge: Judge, role: IntArray, z: FloatArray, low: FloatArray, high: FloatArray) -> Place:
    """Best place of each of C searches from z (C, n) and from a leap away along each unknown; see `explore`."""
    one = np.eye(z.shape[-1])
    leaps = (_LEAP * (high - low))[:, None] * np.concatenate([0.0 * one[:1], one, -one])
    return settle(judge, role, np.clip(z[:, None] + leaps, low[:, None], high[:, None]), low, high)


def settle(judge: Judge, role: IntArray, begin: FloatArray, low: FloatArray, high: FloatArray) -> Place:
    """Best place of each of C searches that descents from the starts (C, S, n) come to; see `explore`."""
    descents = Descents(judge, role, begin, low, high)
    if begin.shape[1] > 1:
        descents.run(_AFTER_LEAP, _LANDED, thorough=False)
    descents.run(_LAST, 1)
    return descents.best()


def covering_points(count: int, n: int) -> FloatArray:
    """Points (count, n) that cover the unit box evenly, the same ones every time.

    The additive recurrence of the powers of ``1 / g``, g being the root of ``g^(n+1) = g + 1`` (Roberts 2018).
    """
    g = 1.5
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (n + 1))
    return np.asarray((0.5 + np.arange(1, count + 1)[:, None] * g ** -np.arange(1.0, n + 1.0)) % 1.0)


class Descents:
    """Several descents in each of C searches.

    Parameters
    ----------
    judge, role, low, high : as for `explore`
    begin : (C, S, n)
    """

    def __init__(self, judge: Judge, role: IntArray, begin: FloatArray, low: FloatArray, high: FloatArray) -> None:
        count, starts, n = begin.shape
        owner = np.repeat(np.arange(count), starts)
        self._shape, self._size = (count, starts), np.maximum(high - low, 1e-9)[:, None]
        self._descent = Descent(
            lambda z, rows: judge(z, owner[rows]), role[owner], begin.reshape(-1, n), low[owner], high[owner]
        )

    def run(self, rounds: int, leaders: int, thorough: bool = True) -> None:
        """So many rounds; then only the best ones of each search go on, of those at the same place only one."""
        place = self._descent.run(rounds, thorough)
        (count, starts), n = self._shape, place.z.shape[-1]
        rank, z = place.ranked().reshape(count, starts), place.z.reshape(count, starts, n)
        chosen, near = _apart(rank, z / self._size, min(leaders, starts), _SAME)
        self._descent.keep((np.arange(count)[:, None] * starts + chosen)[~near])

    def best(self) -> Place:
        """Of each search the best place."""
        place = self._descent.place
        count, starts = self._shape
        rank = place.ranked(HIGHEST_PUSH).reshape(count, starts)
        return place.take(np.arange(count) * starts + np.argmin(rank, axis=-1))


def _apart(rank: FloatArray, z: FloatArray, count: int, apart: float) -> tuple[IntArray, BoolArray]:
    """The best places of each search that lie apart; where they are too few the best others, and a mask of those.

    Parameters
    ----------
    rank : (C, S)
    z : (C, S, n)
    count : how many
    apart : least largest difference

    Returns
    -------
    numbers (C, count) and mask (C, count)
    """
    rows, left = np.arange(len(rank)), rank.copy()
    chosen, near = np.empty((len(rank), count), dtype=np.int64), np.empty((len(rank), count), dtype=bool)
    for i in range(count):
        best = np.argmin(left, axis=-1)
        chosen[:, i], near[:, i] = best, left[rows, best] > 0.5 * _BEHIND
        left[np.abs(z - z[rows, best][:, None]).max(axis=-1) <= apart] += _BEHIND
        left[rows, best] = np.inf
    return chosen, near
