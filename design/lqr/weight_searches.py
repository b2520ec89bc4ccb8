"""Many searches of weights at once: each at its points, with its limits, for one aim."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.lqr.weight_candidates import Candidates
from design.lqr.weight_exploration import explore, leap, settle
from design.lqr.weight_models import AIM, NOTHING, WALL, Place
from design.specs import Spec
from model.arrays import BoolArray, FloatArray, IntArray

#: Aims besides the numbers of specs: what is minimised, and the largest miss of any spec.
LEAST, EVERY = -1, -2
#: Part of every limit that is kept in hand, and the miss that still counts as none.
HAND = 1e-3
#: So many weights, its own among them, a search goes on from where weights are exchanged.
_OTHERS = 3
#: Logarithm of the shortest time by which the aileron may be sought to settle, over its limit.
_SOONEST = -7.0


@dataclass(frozen=True, eq=False)
class Searches:
    """C searches.

    Where the aim is the settling time, the time by which the aileron is to have settled is one more unknown, the last.

    Attributes
    ----------
    candidates : what is designed and judged
    points : (C, p) numbers of the points of each; its weights serve all of them
    limits : (C, p, s) of the specs, what is kept in hand left out
    aim : `LEAST`, `EVERY`, or the number of the spec whose quantity is to be the best that there is while the others
        are met
    """

    candidates: Candidates
    points: IntArray
    limits: FloatArray
    aim: int = LEAST

    @property
    def specs(self) -> tuple[Spec, ...]:
        """What is asked for."""
        return self.candidates.search.specs

    def take(self, which: BoolArray | IntArray) -> Searches:
        """Some of the searches."""
        return replace(self, points=self.points[which], limits=self.limits[which])

    def explored(self, begin: FloatArray) -> Place:
        """Best places from anywhere and from the starts (C, S, J)."""
        return explore(self._judge, self._role, self._lengthened(begin), *self._box)

    def from_leaps(self, z: FloatArray) -> Place:
        """Best places that are near z (C, J) or a leap away."""
        return leap(self._judge, self._role, self._lengthened(z), *self._box)

    def settled(self, begin: FloatArray) -> Place:
        """Best places downhill of the starts (C, S, J)."""
        return settle(self._judge, self._role, self._lengthened(begin), *self._box)

    def exchanged(self, z: FloatArray) -> Place:
        """Best places downhill of weights z (C, J), each search's own and those of the others that suit it best."""
        own = np.arange(len(z))
        all_of_them = np.broadcast_to(z, (len(z), *z.shape))
        numbers = self._judge(all_of_them.reshape(-1, z.shape[-1]), np.repeat(own, len(z)))
        rank = Place.of(all_of_them, numbers.reshape(len(z), len(z), -1), self._role[:, None]).ranked()
        rank[own, own] = -np.inf
        best = np.argsort(rank, axis=-1, kind="stable")[:, :_OTHERS]
        return self.settled(np.take_along_axis(all_of_them, best[..., None], axis=1))

    def _judge(self, z: FloatArray, rows: IntArray) -> FloatArray:
        """Numbers (M, p F) of unknowns z (M, n) in the searches of these numbers (M,)."""
        points, limits = self.points[rows], self.limits[rows]
        tightened = limits * (1.0 + HAND * np.array([1.0 if spec.sense == "min" else -1.0 for spec in self.specs]))
        each = np.repeat(z, points.shape[1], axis=0)
        numbers = self.candidates.numbers(each, points.reshape(-1), tightened.reshape(-1, len(self.specs)))
        return numbers.reshape(len(z), -1)

    @property
    def _timed(self) -> bool:
        settling = self.candidates.search.settling
        return settling is not None and self.aim == settling

    @property
    def _role(self) -> IntArray:
        """(C, p F)"""
        columns = self.candidates.columns
        spec = columns.group >= 0
        if self.aim == EVERY:
            role = np.where(spec & ~columns.time, AIM, NOTHING)
        else:
            aims = columns.time if self._timed else columns.group == self.aim
            role = np.where(aims, AIM, np.where(spec & ~columns.time, WALL, NOTHING))
        return np.broadcast_to(
            np.tile(role, self.points.shape[1]), (len(self.points), role.size * self.points.shape[1])
        )

    @property
    def _box(self) -> tuple[FloatArray, FloatArray]:
        """(C, n), (C, n) logarithms between which the unknowns are sought."""
        search = self.candidates.search
        high = np.full((len(self.points), len(search.searched)), np.log(search.span))
        low = -high
        if self._timed:
            latest = np.log(search.step.duration / self.limits[..., self.aim].min(axis=-1, keepdims=True))
            low = np.concatenate([low, np.full_like(latest, _SOONEST)], axis=-1)
            high = np.concatenate([high, np.maximum(latest, 0.0)], axis=-1)
        return low, high

    def _lengthened(self, z: FloatArray) -> FloatArray:
        """Unknowns of weights z (..., J), the time being the limit."""
        return np.concatenate([z, np.zeros((*z.shape[:-1], 1))], axis=-1) if self._timed else z
