"""What became of each grid point: a failed point is a value with a reason, never an exception."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from model.arrays import BoolArray, GridArrays, ObjectArray


class Outcome(StrEnum):
    """Outcome of one grid point. Only `OK` points carry gains."""

    OK = "ok"
    INFEASIBLE = "infeasible"
    NOT_CERTIFIED = "not_certified"
    OUTSIDE_MODEL = "outside_model"
    EXCLUDED = "excluded"


@dataclass(frozen=True, eq=False)
class Outcomes(GridArrays):
    """Outcomes and reasons over the grid.

    Attributes
    ----------
    codes : (*G,) object array of `Outcome`
    reasons : (*G,) object array of str, or None where the outcome is ok
    """

    codes: ObjectArray
    reasons: ObjectArray

    @classmethod
    def all_ok(cls, shape: tuple[int, ...]) -> Outcomes:
        """Every point of a grid of this shape is ok."""
        codes = np.empty(shape, dtype=object)
        codes.fill(Outcome.OK)  # not np.full, which makes plain strings of the members
        return cls(codes, np.full(shape, None, dtype=object))

    @property
    def ok(self) -> BoolArray:
        """(*G,) mask of the points that are ok."""
        return np.asarray(self.codes == Outcome.OK, dtype=bool)

    def failing(self, where: BoolArray, outcome: Outcome, reason: Callable[[tuple[int, ...]], str]) -> Outcomes:
        """Mark the points of `where` that are still ok as failed; an earlier failure keeps its reason.

        Parameters
        ----------
        where : (*G,) mask
        outcome : what the points become
        reason : called with each point's index, says why in words and numbers
        """
        failed = np.asarray(where) & self.ok
        if not np.any(failed):
            return self
        codes, reasons = self.codes.copy(), self.reasons.copy()
        for row in np.argwhere(failed):
            index = tuple(int(i) for i in row)
            codes[index], reasons[index] = outcome, reason(index)
        return Outcomes(codes, reasons)
