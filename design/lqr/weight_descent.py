"""Downhill in a few unknowns at many points at once: the least largest aim behind walls.

At every round aims and walls are judged on a stencil about the place, which gives each of them a quadratic model
(`design.lqr.weight_models`). The best steps of the problem of all the models are tried within a long and a short reach,
corrected by what they were found to miss, and tried once more; the best of all that was judged is kept. Where a
search stands decides what it does next, and nothing else: it is deterministic, and no search knows of the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.weight_models import HIGHEST_PUSH, PRICE, WALL, Judge, Models, Place, best_step, models_about
from model.arrays import FloatArray, IntArray

#: First reach of a step, the longest, and the one at which a search ends.
_REACH, _LONGEST, _SHORTEST = 0.5, 2.0, 2e-3
#: Reaches that are tried, as parts of the present one, and how often.
_PARTS = (1.0, 0.3)
_ATTEMPTS = 2
#: Price of a miss over the push of the walls.
_OVER_PUSH = 2.0
#: A step is corrected by no more than this.
_AMISS = 1.0
#: A search ends when its models promise less than this, and it has gained less.
_WORTH = 2e-4


class Descent:
    """K searches from `begin` (K, n) for the least largest aim with no wall above 0, within ``low <= z <= high``.

    Parameters
    ----------
    judge : numbers of unknowns
    role : (K, F) `design.lqr.weight_models.NOTHING`, `WALL` or `AIM`
    begin, low, high : (K, n)
    """

    def __init__(self, judge: Judge, role: IntArray, begin: FloatArray, low: FloatArray, high: FloatArray) -> None:
        self._judge, self._role, self._low, self._high = judge, role, low, high
        self._z = begin.copy()
        self._numbers = judge(begin, np.arange(len(begin))).copy()
        self._reach, self._push = np.full(len(begin), _REACH), np.zeros_like(self._numbers)

    @property
    def place(self) -> Place:
        """Where the searches are."""
        return Place.of(self._z.copy(), self._numbers.copy(), self._role)

    def keep(self, rows: IntArray) -> None:
        """Go on with the searches of these numbers only."""
        self._reach[np.setdiff1d(np.arange(len(self._z)), rows)] = 0.0

    def run(self, rounds: int, thorough: bool = True) -> Place:
        """So many rounds, or fewer where all have come to their end before.

        Parameters
        ----------
        rounds : at most
        thorough : whether the models know how two unknowns bend a number together; a round costs half without
        """
        for _ in range(rounds):
            going = np.flatnonzero(self._reach > _SHORTEST)
            if not going.size:
                break
            self._round(going, thorough)
        return self.place

    def _round(self, going: IntArray, thorough: bool) -> None:
        role, reach, low, high = self._role[going], self._reach[going], self._low[going], self._high[going]
        here, row = Place.of(self._z[going], self._numbers[going], role), np.arange(going.size)
        models, stencil = models_about(self._judge, here, going, reach, thorough)
        trial = self._trial(models, here.z, going)
        z = here.z[:, None] + np.concatenate([stencil.offsets, trial.v], axis=1)
        numbers = np.concatenate([stencil.numbers, trial.numbers], axis=1)
        # A move to a place of the stencil says nothing about how far the models can be believed.
        moved = np.concatenate([np.zeros(stencil.offsets.shape[:2]), np.abs(trial.v).max(axis=-1)], axis=1)
        inside = ((z >= low[:, None]) & (z <= high[:, None])).all(axis=-1)
        price = np.clip(_OVER_PUSH * trial.push, PRICE, HIGHEST_PUSH)
        rank = np.where(inside, Place.of(z, numbers, role[:, None]).ranked(price[:, None]), np.inf)
        best = np.argmin(rank, axis=-1)
        gain = here.ranked(price) - rank[row, best]
        better = gain > 0.0
        self._z[going] = np.where(better[:, None], z[row, best], here.z)
        self._numbers[going] = np.where(better[:, None], numbers[row, best], here.numbers)
        size = np.where(better, moved[row, best], 0.0)
        reach = np.where(size > 0.9 * reach, 2.0 * reach, np.maximum(2.0 * size, _PARTS[-1] * reach))
        ended = (here.ranked() - trial.promised < _WORTH) & (gain < _WORTH)
        self._reach[going] = np.where(ended, 0.0, np.minimum(reach, _LONGEST))

    def _trial(self, models: Models, z: FloatArray, going: IntArray) -> _Trial:
        """Steps tried from the places z (K, n) of the searches of these numbers (K,)."""
        ways, count = len(_PARTS), going.size
        rows, models = np.repeat(going, ways), models.repeated(ways)
        z, role, push = np.repeat(z, ways, axis=0), self._role[rows], self._push[rows]
        reach = np.outer(self._reach[going], _PARTS).reshape(-1, 1)
        low = np.minimum(np.maximum(self._low[rows] - z, -reach), 0.0)
        high = np.maximum(np.minimum(self._high[rows] - z, reach), 0.0)
        amiss, v, numbers, steps = np.zeros_like(models.value), [], [], []
        for _ in range(_ATTEMPTS):
            step = best_step(models.raised(amiss), role, push, low, high)
            found, push = self._judge(z + step.v, rows), step.push
            amiss = np.clip(found - models.at(step.v)[0], -_AMISS, _AMISS)
            v.append(step.v.reshape(count, ways, -1))
            numbers.append(found.reshape(count, ways, -1))
            steps.append(step)
        self._push[going] = push[::ways]
        hardest = np.where(role == WALL, steps[0].push, 0.0).sum(axis=-1)
        promised = steps[0].promised[::ways]
        return _Trial(np.concatenate(v, axis=1), np.concatenate(numbers, axis=1), hardest[::ways], promised)


@dataclass(frozen=True, eq=False)
class _Trial:
    """What was tried in K searches.

    Attributes
    ----------
    v : (K, T, n) steps
    numbers : (K, T, F) after them
    push : (K,) of all walls together on the first one of the longest reach
    promised : (K,) by the models after that one
    """

    v: FloatArray
    numbers: FloatArray
    push: FloatArray
    promised: FloatArray
