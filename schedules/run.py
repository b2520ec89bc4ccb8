"""From a study to a designed envelope: the one function that notebooks and the service both call."""

from __future__ import annotations

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
from design.outcome import Outcomes
from schedules.analysis import PlantEnvelope, analyse
from schedules.designed import ControllerRefused, DesignedController, DesignedEnvelope
from schedules.envelope_warnings import envelope_warnings
from schedules.judging import figures_at, horizon, judged
from schedules.second_try import TRIES, missed_a_little
from schedules.smoothing import smooth
from schedules.state_feedback import state_feedback
from schedules.study import Controller, Study


def run(study: Study) -> DesignedEnvelope:
    """Design and judge every controller of a study over its grid.

    Raises
    ------
    ValueError : the grid cannot be built
    ControllerRefused : weights that cannot work at any point
    """
    plant = analyse(study)
    controllers = tuple(design(study, plant, request) for request in study.controllers)
    return DesignedEnvelope(study, plant, controllers, plant.warnings + envelope_warnings(study, plant, controllers))


def design(study: Study, plant: PlantEnvelope, request: Controller) -> DesignedController:
    """Design and judge one controller over the plant of a study, be it one of the study's own or not.

    Raises
    ------
    ControllerRefused : weights that cannot work at any point
    """
    if isinstance(request, ClassicalController):
        return _classical(study, plant, request)
    return _lqr(study, plant, request)


def design_margins(study: Study, plant: PlantEnvelope, request: ClassicalController) -> DesignMargins:
    """By how much all specs of a classical controller could be stricter, at every point of the study's plant.

    Raises
    ------
    ValueError : there are no specs, or all gains are given
    """
    reference = _reference(study, plant, request)
    return design_margin_sweep(plant.servo_tab, study.tab_actuator, request, reference, plant.outcomes)


def _classical(study: Study, plant: PlantEnvelope, request: ClassicalController) -> DesignedController:
    found, designed = _chosen(study, plant, request)
    if request.smoothness > 0.0 and not request.all_gains_given:
        smoothed = smooth(study, plant, designed)
        designed = replace(_flown(study, plant, request, designed.outcomes, smoothed.gains), smoothed=smoothed)
    return replace(designed, infeasibility=found.infeasibility)


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
