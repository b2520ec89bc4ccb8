"""What a search has found at each point, and the closer look that is taken at it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from design.classical.ascent import Climb
from design.classical.open_gains import OpenGains
from design.classical.pole_figures import Poles
from design.classical.problem import Problem
from design.classical.steering import StepReference
from design.specs import Spec
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: How many times as many samples a closer look has.
FINER = 2
#: A settling time is on a knife-edge when less than this part of its limit, or of its band, is left.
EDGE = 0.02


@dataclass(frozen=True, eq=False)
class Found(GridArrays):
    """Best unknowns of each of P points.

    Attributes
    ----------
    z : (P, J)
    aim : (P,) what was made largest
    met : (P,) whether all specs, or those that were not tightened, are met
    achieved : (P, S) value of each spec's quantity, nan where it does not exist or was not worked out
    arrived : (P,) whether an optimum was reached
    """

    z: FloatArray
    aim: FloatArray
    met: BoolArray
    achieved: FloatArray
    arrived: BoolArray

    def replaced(self, rows: BoolArray | IntArray, other: Found) -> Found:
        """These, and at some of the points the other ones, which are of those points only."""
        made = {}
        for f in fields(Found):
            made[f.name] = np.array(getattr(self, f.name))
            made[f.name][rows] = getattr(other, f.name)
        return Found(**made)


def best_of(climb: Climb, at: IntArray, points: int) -> Found:
    """The best search of each point, `at` (K,) being the points of the searches, each of them there at least once.

    Of those that meet the specs it is the one with the largest aim, else the one that misses least.
    """
    values = climb.values
    met = values.met
    if at.size == points:
        return Found(climb.z, values.aim, met, values.achieved, climb.arrived)
    worst = np.clip(np.nan_to_num(values.miss, nan=np.inf), 0.0, 1e6)
    rank = np.where(met, np.arctan(values.aim), np.where(values.stable, -10.0 - worst, -1e9))
    order = np.lexsort((-rank, at))
    pick = order[np.searchsorted(at[order], np.arange(points))]
    return Found(climb.z[pick], values.aim[pick], met[pick], values.achieved[pick], climb.arrived[pick])


def closer_look(
    family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], z: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """Masks (P,) of the candidates z (P, J) that meet the specs on finer samples, without anything in hand; and of
    those that settle just in time: as an extreme of the error enters its band, others may be far faster.
    """
    problem = Problem.of(family, reference, specs, fineness=FINER, modes=modes_of(family, z), in_hand=0.0)
    values = problem.look(z, passes=2)
    edge = np.zeros(z.shape[0], dtype=bool)
    for s, spec in enumerate(specs):
        if spec.quantity == "settling_time":
            edge |= values.missed[:, s] > -EDGE
    return values.stable & (values.miss <= 0.0), edge


def modes_of(family: OpenGains, z: FloatArray) -> ComplexArray:
    """Closed-loop poles (P, m) of the candidates z (P, J)."""
    return Poles.of(family.characteristic, family.form.delay, z).s


def taken(
    family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], index: Any
) -> tuple[OpenGains, StepReference, tuple[Spec, ...]]:
    """Loops, reference and specs at some of the points."""
    return family.take(index), reference.take(index), tuple(spec.take(index) for spec in specs)


def places(mask: BoolArray, count: int) -> list[IntArray]:
    """Places of a mask (P,), at most `count` at a time."""
    every = np.flatnonzero(mask)
    return [every[i : i + count] for i in range(0, every.size, count)]


def joined(parts: list[Found]) -> Found:
    """Points of several searches, one after the other."""
    return Found(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Found)))
