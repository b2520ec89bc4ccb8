"""The loop of a controller's own gains around plants that it was not designed for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.flown import flown_loop
from design.lqr.measurement import RateFilters
from design.sampling import as_if_continuous
from model.arrays import IntArray
from model.linear_model import LinearModel
from model.servo_tab import servo_tab
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Study


def carried_loop(
    study: Study, plant: PlantEnvelope, designed: DesignedController, model: LinearModel, points: IntArray
) -> Loop:
    """Loops (N,): the gains of some design points around the plants `model`, which need not be theirs.

    Actuators, filter, integrals, feed-forward and delays are those of the design; trim values are the model's. The
    sign of a tab-only law is fixed where it is designed: a plant whose tab works the other way is flown with it all
    the same.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : the controller
    model : (N,) the plants that are flown
    points : (N,) flat indices of the points whose gains are carried

    Raises
    ------
    ValueError : a sampled state feedback, or one of estimates
    """
    request, at = designed.request, np.unravel_index(points, designed.outcomes.ok.shape)
    if isinstance(request, ClassicalController):
        # Of the servo tab's own gain the loop takes the sign only.
        servo = replace(servo_tab(model), dc_gain=plant.servo_tab.dc_gain[at])
        gains = {gain.name: gain.values[at] for gain in designed.gains}
        return as_if_continuous(tab_loop(model, servo, study.tab_actuator, request, gains), request.sampling)
    if designed.optimum is None:
        structure = request.structure(study.tab_actuator, study.aileron_actuator)
    else:
        structure = designed.optimum.structure
    if isinstance(designed.loop, CodedLoop) or designed.observer is not None:
        raise ValueError(
            f"controller {request.name} runs as code, or a model of its own point: only state feedback of measured "
            "states or filtered rates is flown away from its point"
        )
    K = designed.loop.K if designed.optimum is None else designed.optimum.K
    flown = flown_loop(model, structure, K[at], designed.loop.N[at])
    measured = request.measurement
    return with_rate_filters(flown, measured.cutoff) if isinstance(measured, RateFilters) else flown
