"""Candidates as the search sees them: what is to be made largest, and the walls that the specs put up."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Aim of a candidate that is unstable, or that cannot be judged.
UNSTABLE = -1e6
#: A candidate may use so much of what is kept in hand of every limit.
MET = 5e-4


@dataclass(frozen=True, eq=False)
class Values(GridArrays):
    """Figures of K candidates.

    Attributes
    ----------
    aim : (K,) what is made largest: the logarithm of the bandwidth [rad/s]; or the part by which the specs that are
        tightened are all met more strictly than they ask
    achieved : (K, S) value of each spec's quantity; nan where it does not exist, or was not worked out
    missed : (K, S) by how much each spec is missed, as a part of its limit; at most 0 when it is met
    miss : (K,) the largest miss of the specs that are not tightened, and of what bounds the loop transfer
    stable : (K,) mask; of the others the rest means nothing
    """

    aim: FloatArray
    achieved: FloatArray
    missed: FloatArray
    miss: FloatArray
    stable: BoolArray

    @property
    def met(self) -> BoolArray:
        """(K,) mask of the stable ones that meet all specs that are not tightened."""
        return np.asarray(self.stable & (self.miss <= MET))

    def with_rows(self, rows: IntArray, other: Values) -> Values:
        """These, and in some rows the others, in their order."""
        made = {}
        for f in fields(Values):
            made[f.name] = np.array(getattr(self, f.name))
            made[f.name][rows] = getattr(other, f.name)
        return Values(**made)


@dataclass(frozen=True, eq=False)
class Slopes(GridArrays):
    """Derivatives of K candidates in their J unknowns, and walls that are at most 0 where the specs are met.

    Attributes
    ----------
    aim, aim_curvature : (K, J), (K, J, J) of the aim; nothing where specs are tightened, their walls have them
    walls, gradient, curvature : (K, M), (K, M, J), (K, M, J, J); those of specs that are tightened are at most 0 anyhow
    give : (K, M) how a wall rises with the part by which specs are tightened
    """

    aim: FloatArray
    aim_curvature: FloatArray
    walls: FloatArray
    gradient: FloatArray
    curvature: FloatArray
    give: FloatArray


@dataclass(frozen=True, eq=False)
class Judged(GridArrays):
    """Values and slopes of K candidates."""

    values: Values
    slopes: Slopes

    def replaced(self, rows: BoolArray, other: Judged) -> Judged:
        """These, and at some of the rows (K,) the other ones."""
        values = (_where(rows, getattr(self.values, f.name), getattr(other.values, f.name)) for f in fields(Values))
        slopes = (_where(rows, getattr(self.slopes, f.name), getattr(other.slopes, f.name)) for f in fields(Slopes))
        return Judged(Values(*values), Slopes(*slopes))


def _where(rows: BoolArray, one: Any, other: Any) -> Any:
    return np.where(rows.reshape(-1, *(1,) * (one.ndim - 1)), other, one)
