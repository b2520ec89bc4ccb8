"""The loop of a controller with any gains around any plants, its actuators and filters those of the design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.loop import Loop
from design.lqr.flown import flown_loop
from design.lqr.measurement import RateFilters
from model.arrays import FloatArray
from model.linear_model import INPUTS, LinearModel
from model.servo_tab import servo_tab
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Study


def flown_loop_with(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    model: LinearModel,
    gains: Mapping[str, FloatArray],
) -> Loop:
    """Loops (N,) as the product assembles them; nan in model or gains is nan in the loop.

    The sign of a tab-only law is the design's. Neither code, nor a filter that runs a model of the plant, is flown so.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : the controller
    model : (N,) plants
    gains : (N,) each, every gain of the controller by name
    """
    request = designed.request
    if isinstance(request, ClassicalController):
        # Of the servo tab's own gain the loop takes the sign only.
        sign = float(np.sign(plant.servo_tab.dc_gain[designed.outcomes.ok][0]))
        servo = servo_tab(model)
        servo = replace(servo, dc_gain=np.full_like(servo.dc_gain, sign))
        return tab_loop(model, servo, study.tab_actuator, request, dict(gains))
    structure = request.structure(study.tab_actuator, study.aileron_actuator)
    K, N = _matrix("K", structure.states(model.states), gains), _matrix("N", structure.references, gains)
    loop = flown_loop(model, structure, K, N)
    measured = request.measurement
    return with_rate_filters(loop, measured.cutoff) if isinstance(measured, RateFilters) else loop


def _matrix(symbol: str, columns: tuple[str, ...], gains: Mapping[str, FloatArray]) -> FloatArray:
    """(N, 2, number of columns) of the gains ``<symbol>_<input>_<column>``."""
    rows = [[gains[f"{symbol}_{row}_{column}"] for column in columns] for row in INPUTS]
    points = next(iter(gains.values())).shape
    return np.moveaxis(np.array(rows).reshape(len(INPUTS), len(columns), *points), (0, 1), (-2, -1))
