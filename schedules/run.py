"""From a study to a designed envelope: the one function that notebooks and the service both call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.steering import StepReference
from design.classical.synthesis import (
    ClassicalDesign,
    DesignMargins,
    design_classical,
    design_margin_sweep,
    gain_values,
)
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.lqr.controller import LqrController
from design.lqr.weights import WeightsRefused
from design.outcome import Outcome, Outcomes
from schedules.analysis import PlantEnvelope, analyse
from schedules.designed import ControllerRefused, DesignedController, DesignedEnvelope
from schedules.digests import study_digest
from schedules.envelope_warnings import envelope_warnings
from schedules.joined import joined
from schedules.judging import figures_at, horizon, judged
from schedules.part import Part, blocks_of, parts, plant_at, request_at, requested
from schedules.second_try import TRIES, missed_a_little
from schedules.smoothing import smooth
from schedules.state_feedback import state_feedback
from schedules.study import Controller, Study
from schedules.synthesised import PartDesign, Refused, Synthesised


def run(study: Study, done: Sequence[Synthesised] = ()) -> DesignedEnvelope:
    """Design and judge every controller of a study over its grid.

    Parts that are not done are synthesised here, one after the other: which ones were done elsewhere, and in what
    order, makes no difference to the last bit.

    Parameters
    ----------
    study : the study
    done : parts of it that are synthesised already (`schedules.parts`), in any order

    Raises
    ------
    ValueError : the grid cannot be built; or of `done`, a part of another study, one that is not among the study's
        parts, or the same one twice
    ControllerRefused : weights that cannot work at any point
    """
    plant, kept = analyse(study), _kept(study, done)
    controllers = tuple(_over_grid(study, plant, request, kept) for request in study.controllers)
    return DesignedEnvelope(study, plant, controllers, plant.warnings + envelope_warnings(study, plant, controllers))


def _kept(study: Study, done: Sequence[Synthesised]) -> dict[Part, PartDesign]:
    """The designs of the parts that are done; ValueError where one is not this study's."""
    every, requests = set(parts(study)), {request.name: request for request in study.controllers}
    digests = {
        name: study_digest(study, requests[name]) for name in {one.part.controller for one in done} & {*requests}
    }
    kept: dict[Part, PartDesign] = {}
    for one in done:
        if one.part not in every:
            raise ValueError(f"{one.part} is not a part of the study {study.name}")
        if one.part in kept:
            raise ValueError(f"{one.part} is given twice")
        if one.study != digests[one.part.controller]:
            raise ValueError(f"{one.part} was synthesised for another study than {study.name}")
        kept[one.part] = one.design
    return kept


def _over_grid(
    study: Study, plant: PlantEnvelope, request: Controller, kept: dict[Part, PartDesign]
) -> DesignedController:
    """A controller of the study over its grid, of its pieces, where it is computed in some."""
    pieces = blocks_of(study, request)
    if not pieces:
        return design(study, plant, request)
    designs = [kept[part] if part in kept else designed_part(study, plant, part) for part in pieces]
    return _smoothed(study, plant, joined(study, request, designs))


def designed_part(study: Study, plant: PlantEnvelope, part: Part) -> PartDesign:
    """The design of a part, one of `schedules.part.parts`, on the study's plant.

    Raises
    ------
    ControllerRefused : weights that define no regulator; or, where the part is all of the grid, cannot work at any
        point
    """
    request, shape, size = requested(study, part), plant.grid.shape, plant.outcomes.codes.size
    if part.points.size == size:
        return PartDesign.of(_unsmoothed(study, plant, request))
    here, wanted = plant_at(plant, part.points), request_at(request, part.points, shape)
    try:
        return PartDesign.of(_unsmoothed(study, here, wanted))
    except ControllerRefused as error:
        return PartDesign.of(_refused_each(study, here, wanted), Refused.of(error.refused))


def _refused_each(study: Study, plant: PlantEnvelope, request: Controller) -> DesignedController:
    """The design of points (1, n) at none of which the weights can work, each with its own outcome and reason.

    Raises
    ------
    ControllerRefused : the weights define no regulator, wherever it is
    """
    outcomes = plant.outcomes
    for point in np.flatnonzero(outcomes.ok):
        where = np.zeros_like(outcomes.ok)
        where[0, point] = True
        try:
            alone = design(study, plant_at(plant, np.array([point])), request).outcomes
        except ControllerRefused as error:
            outcome, reason = Outcome.INFEASIBLE, error.refused.reason
        else:
            if alone.ok[0, 0]:
                continue
            outcome, reason = alone.codes[0, 0], str(alone.reasons[0, 0])
        outcomes = outcomes.failing(where, outcome, lambda index, reason=reason: reason)  # type: ignore[misc]
    return design(study, replace(plant, outcomes=outcomes), request)


def design(study: Study, plant: PlantEnvelope, request: Controller) -> DesignedController:
    """Design and judge one controller over the plant of a study, be it one of the study's own or not.

    Raises
    ------
    ControllerRefused : weights that cannot work at any point
    """
    return _smoothed(study, plant, _unsmoothed(study, plant, request))


def _unsmoothed(study: Study, plant: PlantEnvelope, request: Controller) -> DesignedController:
    """The controller as every point has it for itself."""
    if isinstance(request, ClassicalController):
        found, designed = _chosen(study, plant, request)
        return replace(designed, infeasibility=found.infeasibility)
    return _lqr(study, plant, request)


def _smoothed(study: Study, plant: PlantEnvelope, designed: DesignedController) -> DesignedController:
    """The controller with the smoother gains that it asks for."""
    request = designed.request
    if not isinstance(request, ClassicalController) or request.smoothness == 0.0 or request.all_gains_given:
        return designed
    smoothed = smooth(study, plant, designed)
    flown = _flown(study, plant, request, designed.outcomes, smoothed.gains)
    return replace(flown, infeasibility=designed.infeasibility, smoothed=smoothed)


def design_margins(study: Study, plant: PlantEnvelope, request: ClassicalController) -> DesignMargins:
    """By how much all specs of a classical controller could be stricter, at every point of the study's plant.

    Raises
    ------
    ValueError : there are no specs, or all gains are given
    """
    reference = _reference(study, plant, request)
    return design_margin_sweep(plant.servo_tab, study.tab_actuator, request, reference, plant.outcomes)


def _chosen(
    study: Study, plant: PlantEnvelope, request: ClassicalController
) -> tuple[ClassicalDesign, DesignedController]:
    """Gains by the specs, judged; where they just miss a spec (`schedules.second_try`) they are asked for again."""
    reference, asked = _reference(study, plant, request), request
    tightened = np.zeros((len(request.specs), *plant.grid.shape))
    for _ in range(TRIES):
        found = design_classical(plant.servo_tab, study.tab_actuator, asked, reference, plant.outcomes)
        designed = _flown(study, plant, request, found.outcomes, found.gains)
        missed = found.outcomes.ok & ~designed.outcomes.ok
        if not np.any(missed) or request.all_gains_given:
            break
        loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, gain_values(found.gains))
        figures = figures_at(study, request, loop, missed)
        if figures is None or not np.any(more := missed_a_little(request.specs, figures, missed)):
            break
        tightened += more
        specs = tuple(spec.tightened(part) for spec, part in zip(request.specs, tightened, strict=True))
        asked = replace(request, specs=specs)
    return found, designed


def _reference(study: Study, plant: PlantEnvelope, request: ClassicalController) -> StepReference:
    return StepReference(study.reference.aileron, horizon(study, request), plant.trim.state[..., 0])


def _flown(
    study: Study, plant: PlantEnvelope, request: ClassicalController, outcomes: Outcomes, gains: tuple[Gain, ...]
) -> DesignedController:
    """The loop of a classical controller with these gains, judged."""
    loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, gain_values(gains))
    return judged(study, plant, request, outcomes, gains, loop)


def _lqr(study: Study, plant: PlantEnvelope, request: LqrController) -> DesignedController:
    try:
        found = state_feedback(study, plant, request)
    except WeightsRefused as refused:
        raise ControllerRefused(request.name, refused) from refused
    designed = judged(study, plant, request, found.outcomes, found.gains, found.loop)
    return replace(designed, optimum=found.optimum, observer=found.observer)
