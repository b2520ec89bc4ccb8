"""Two controllers of one or two designs side by side: where their grids meet, and whether each would hold.

A controller is flown on the other design's plant at the same point with its own gains, actuators, filter and integrals
(`schedules.carried_loop`). Two questions are asked of that loop: is it stable, by its poles; and is its nu-gap from the
loop that was designed less than the generic stability margin of that one, which proves it for every plant so near
(`design.robustness.nu_gap`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.assess import Assessment, achieved
from design.delay.with_pade import without_delay
from design.loop import Loop
from design.robustness.nu_gap import CutLoop, NuGap, StabilityMargin, best_units, nu_gap, stability_margin
from design.specs import QUANTITIES
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from schedules.analysis import PlantEnvelope
from schedules.carried_loop import carried_loop
from schedules.designed import DesignedController, DesignedEnvelope

#: Breakpoints of two grids are the same when they differ by less than this part.
SAME_BREAKPOINT = 1e-12


@dataclass(frozen=True)
class Compared:
    """A controller and the design that it is of."""

    envelope: DesignedEnvelope
    controller: DesignedController


@dataclass(frozen=True, eq=False)
class CommonPoints:
    """Grid points that two grids share, as flat indices in each (N,), and why others are not.

    Attributes
    ----------
    one, other : (N,) flat indices, row-major in the first grid
    reason : why there is none; None where there is one
    """

    one: IntArray
    other: IntArray
    reason: str | None


@dataclass(frozen=True, eq=False)
class Carried(GridArrays):
    """A controller on the other design's plant at N common points; nan, False where it is not flown.

    Attributes
    ----------
    flown : (N,) it has gains there, and the other plant a linear model
    nu_gap : (N,) between the loop that is flown and the one that was designed
    margin : (N,) generic stability margin of the one that was designed
    stable : (N,) all poles of the loop that is flown are stable
    """

    flown: BoolArray
    nu_gap: FloatArray
    margin: FloatArray
    stable: BoolArray

    @property
    def held(self) -> BoolArray:
        """(N,) whether the margin proves it stable."""
        return np.asarray(self.flown & (self.nu_gap < self.margin))


def common_points(one: PlantEnvelope, other: PlantEnvelope) -> CommonPoints:
    """Points whose coordinates are the same in both grids, which must have the same axes."""
    names = [tuple(axis.name for axis in plant.grid.axes) for plant in (one, other)]
    none = np.zeros(0, dtype=np.int64)
    if names[0] != names[1]:
        return CommonPoints(none, none, f"the axes differ: {' by '.join(names[0])}, {' by '.join(names[1])}")
    pairs = []
    for mine, theirs in zip(one.grid.axes, other.grid.axes, strict=True):
        a, b = np.array(mine.values), np.array(theirs.values)
        same = np.abs(a[:, None] - b[None, :]) <= SAME_BREAKPOINT * np.maximum(np.abs(a)[:, None], np.abs(b)[None, :])
        pairs.append(np.nonzero(same))
    places = [np.meshgrid(*(pair[side] for pair in pairs), indexing="ij") for side in (0, 1)]
    flat = [
        np.asarray(np.ravel_multi_index([p.ravel() for p in place], plant.grid.shape), dtype=np.int64)
        for place, plant in zip(places, (one, other), strict=True)
    ]
    return CommonPoints(flat[0], flat[1], None if flat[0].size else "no point of one grid is a point of the other")


def figures(controller: DesignedController, points: IntArray) -> dict[str, FloatArray]:
    """Every figure that the controller has, by its quantity (`design.specs.QUANTITIES`), at some flat points (N,)."""
    assessment: Assessment | None = controller.assessment
    if assessment is None:
        return {}
    found = {quantity: achieved(assessment, quantity) for quantity in QUANTITIES if quantity != "noise_gain"}
    return {quantity: values.reshape(-1)[points] for quantity, values in found.items() if values is not None}


def carried(mine: Compared, theirs: PlantEnvelope, points: IntArray, there: IntArray) -> Carried:
    """A controller on another plant.

    Parameters
    ----------
    mine : the controller and its design
    theirs : the plant that it is flown on
    points, there : (N,) flat indices of the same points in both grids

    Raises
    ------
    ValueError : a sampled state feedback, or one of estimates, which is not flown away from its point; or two plants
        with lag states and without
    """
    envelope, controller = mine.envelope, mine.controller
    flown = controller.outcomes.ok.reshape(-1)[points] & theirs.outcomes.ok.reshape(-1)[there]
    if not flown.any():
        none = np.full(flown.shape, np.nan)
        return Carried(flown, none, none, flown)
    here, place = points[flown], np.unravel_index(there[flown], theirs.grid.shape)
    own = envelope.plant.model.take(np.unravel_index(here, envelope.plant.grid.shape))
    other = theirs.model.take(place)
    if own.states != other.states:
        raise ValueError("one plant has lag states and the other has none: the gains are not of the same states")
    designed, carried_there = (
        without_delay(carried_loop(envelope.study, envelope.plant, controller, model, here)) for model in (own, other)
    )
    units = best_units(_cut(designed))
    mine_there, mine_here = _cut(carried_there).in_units(units), _cut(designed).in_units(units)
    gap: NuGap = nu_gap(mine_here, mine_there)
    margin: StabilityMargin = stability_margin(mine_here)
    stable = np.asarray(np.linalg.eigvals(carried_there.closed).real.max(axis=-1) < 0.0)
    found = Carried(np.ones(here.shape, dtype=bool), gap.gap, margin.margin, stable)
    return found.spread(flown)


def _cut(loop: Loop) -> CutLoop:
    return CutLoop(loop.A, loop.B, loop.K)
