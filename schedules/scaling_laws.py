"""A controller whose gains follow scaling laws, and what it loses against the per-point design (seed 4.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.assess import Assessment, achieved
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.loop import Loop
from design.lqr.synthesis import LqrDesign
from design.lqr.torque_loop import lqr_loop
from design.outcome import Outcomes
from design.specs import Spec
from model.arrays import BoolArray, FloatArray, GridArrays
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.judging import judged
from schedules.power_laws import GainLaw, fit_laws
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class SpecLoss(GridArrays):
    """How a spec fares under the law and under the per-point design.

    Attributes
    ----------
    spec : the spec
    by_law : (*G,) distance inside it under the law, as a part of its limit [-]; negative outside, nan without a value
    by_design : (*G,) the same of the per-point design
    failed : (*G,) where the law is flown and does not meet the spec, or has no such value
    """

    spec: Spec
    by_law: FloatArray
    by_design: FloatArray
    failed: BoolArray

    @property
    def worst(self) -> int | None:
        """Flat index of the worst failure (a missing value is worst of all); None when nothing fails."""
        if not np.any(self.failed):
            return None
        distance = np.where(np.isnan(self.by_law), -np.inf, self.by_law)
        return int(np.argmin(np.where(self.failed, distance, np.inf)))


@dataclass(frozen=True, eq=False)
class ScalingLoss(GridArrays):
    """What a law loses against the per-point design.

    Attributes
    ----------
    flown : (*G,) where the law is flown: inside the model, and where every gain exists
    stable : (*G,) where it is flown and its closed loop is stable
    bandwidth_ratio : (*G,) bandwidth with the law over that of the design [-]; nan where either has none
    specs : one for each spec that the design has a verdict on
    """

    flown: BoolArray
    stable: BoolArray
    bandwidth_ratio: FloatArray
    specs: tuple[SpecLoss, ...]

    @property
    def slowest(self) -> int | None:
        """Flat index of the smallest bandwidth ratio; None when there is none."""
        return int(np.nanargmin(self.bandwidth_ratio)) if np.any(np.isfinite(self.bandwidth_ratio)) else None


@dataclass(frozen=True, eq=False)
class ScalingLaw:
    """Scaling laws of a controller, the schedule they make, and its loss.

    Attributes
    ----------
    laws : one for each gain, in the order of the design's gains
    gains : each (*G,), by the laws at every point that is flown; a gain without a law keeps its per-point values
    flown : the controller of these gains, judged as any other: a point whose loop is not stable says so in its
        outcome and has lost its gains there
    loss : against the per-point design
    """

    laws: tuple[GainLaw, ...]
    gains: tuple[Gain, ...]
    flown: DesignedController
    loss: ScalingLoss


def scaling_law(study: Study, plant: PlantEnvelope, designed: DesignedController) -> ScalingLaw:
    """Fit a scaling law to every gain of a design, fly the laws over the grid and judge the loss.

    Where every gain has a law they are flown at all points inside the model, be there a design or not; otherwise, as
    gains without a law keep the design's values, where the design is ok.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : its per-point design

    Raises
    ------
    ValueError : a state feedback that runs as code, or does not measure all its states
    """
    condition = plant.grid.condition
    laws = fit_laws(condition, designed.gains, designed.outcomes.ok)
    outcomes = plant.outcomes if all(law.law for law in laws) else designed.outcomes
    gains = []
    for gain, law in zip(designed.gains, laws, strict=True):
        values = gain.values if law.law is None else law.law.at(condition)
        gains.append(Gain(gain.name, gain.unit, np.where(outcomes.ok, values, np.nan)))
    flown = _flown(study, plant, designed, tuple(gains), outcomes)
    return ScalingLaw(laws, tuple(gains), flown, _loss(designed, flown, outcomes.ok))


def _flown(
    study: Study, plant: PlantEnvelope, designed: DesignedController, gains: tuple[Gain, ...], outcomes: Outcomes
) -> DesignedController:
    """The design's controller with other gains, judged."""
    values, request = {gain.name: gain.values for gain in gains}, designed.request
    if isinstance(request, ClassicalController):
        request = replace(request, gains=values, smoothness=0.0)
        loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, values)
        return judged(study, plant, request, outcomes, gains, loop)
    if not isinstance(designed.optimum, LqrDesign) or not isinstance(designed.loop, Loop) or request.measurement:
        raise ValueError(
            f"controller {request.name} is no continuous feedback of measured states, whose gains could be replaced"
        )
    K = _matrix("K", plant.model.inputs, designed.loop.states, values)
    N = _matrix("N", plant.model.inputs, designed.loop.references, values)
    loop = lqr_loop(plant.model, replace(designed.optimum, K=K, N=N, outcomes=outcomes))
    return judged(study, plant, request, outcomes, gains, loop)


def _matrix(symbol: str, rows: Sequence[str], columns: Sequence[str], values: dict[str, FloatArray]) -> FloatArray:
    """Matrix (*G, m, n) of the gains ``<symbol>_<row>_<column>``."""
    if not columns:  # a regulator has no feed-forward
        (some, *_) = values.values()
        return np.zeros((*some.shape, len(rows), 0))
    return np.stack([np.stack([values[f"{symbol}_{u}_{x}"] for x in columns], axis=-1) for u in rows], axis=-2)


def _loss(designed: DesignedController, flown: DesignedController, where: BoolArray) -> ScalingLoss:
    ratio = _bandwidth(flown) / _bandwidth(designed)
    specs = (verdict.spec for verdict in designed.verdicts)
    losses = tuple(_spec_loss(spec, designed.assessment, flown.assessment, where) for spec in specs)
    return ScalingLoss(where, flown.outcomes.ok, ratio, losses)


def _bandwidth(controller: DesignedController) -> FloatArray:
    found = controller.assessment
    return np.full(controller.outcomes.ok.shape, np.nan) if found is None else found.step.bandwidth


def _spec_loss(spec: Spec, designed: Assessment | None, flown: Assessment | None, where: BoolArray) -> SpecLoss:
    law, design = (_achieved(found, spec, where.shape) for found in (flown, designed))
    by_law, by_design = (np.asarray(spec.distance(values) / spec.scale) for values in (law, design))
    return SpecLoss(spec, by_law, by_design, np.asarray(where & ~spec.met(law)))


def _achieved(found: Assessment | None, spec: Spec, shape: tuple[int, ...]) -> FloatArray:
    """Values (*G,) of a spec's quantity; nan where there are none."""
    values = None if found is None else achieved(found, spec.quantity)
    return np.full(shape, np.nan) if values is None else values
