"""Specs as walls for the search: at most zero where they are met, as parts of their limits, with their derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.steering import STEERABLE
from design.specs import Spec
from model.arrays import FloatArray, GridArrays

#: Part of each limit kept in hand, because the search's figures are interpolated ones; it may use half of it.
IN_HAND = 1e-3
#: A figure that is not there is this far from its limit.
ABSENT = -1e3
#: What a stable loop is asked for in any case, so that it is not next to unstable: this damping ratio.
LEAST_DAMPING = 0.01
#: The most that the loop transfer may be where the frequency response ends, a multiple of what the drive allows: loops
#: that bear any gain have no largest bandwidth, and this bounds it.
AT_TOP = 0.5
#: How the settling's wall counts against a part of a limit.
SETTLING_SCALE = 0.25


@dataclass(frozen=True, eq=False)
class Requirement(GridArrays):
    """A spec at P points.

    Attributes
    ----------
    quantity : of `STEERABLE`
    limit : (P,) with the part in hand
    scale : (P,) what a distance from the limit is a part of
    give : (P,) by how much the limit moves, in scales, when the spec is tightened by a part of it: 1, or 0 for a limit
        of zero; 0 also for a spec that is not to be tightened
    """

    quantity: str
    limit: FloatArray
    scale: FloatArray
    give: FloatArray

    @classmethod
    def of(cls, spec: Spec, points: int, give: float = 0.0, in_hand: float = IN_HAND) -> Requirement:
        """A spec whose limit is a number or (P,), with a part of it in hand, that gives or not."""
        limit, size, scale = (
            np.broadcast_to(np.asarray(v, dtype=float), (points,))
            for v in (spec.tightened(in_hand).limit, np.abs(spec.limit), spec.scale)
        )
        return cls(spec.quantity, limit, scale, give * size / scale)

    @property
    def sign(self) -> float:
        """1 for a largest value, -1 for a smallest."""
        return 1.0 if STEERABLE[self.quantity] == "max" else -1.0

    def miss(self, achieved: FloatArray) -> FloatArray:
        """How far values (P,) miss the limit, in scales; at most 0 when met, inf where there is no value."""
        miss = self.sign * (achieved - self.limit) / self.scale
        return np.where(np.isnan(miss), np.inf, miss)
