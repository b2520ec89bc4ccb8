"""The loop of a controller that is flown with any gains around any plants: what a proof takes apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.lqr.flown import flown_loop
from design.lqr.measurement import RateFilters
from model.arrays import FloatArray
from model.linear_model import INPUTS, LinearModel
from model.servo_tab import servo_tab
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Study


@dataclass(frozen=True)
class NotProvable:
    """A closed loop that is not of the form that can be proved.

    Attributes
    ----------
    reason : in words
    known : whether `closed_with` makes the loop that is flown, so that it can be sampled
    """

    reason: str
    known: bool


def unprovable(study: Study, plant: PlantEnvelope, designed: DesignedController) -> NotProvable | None:
    """Why the closed loop is none of those a proof can take apart; None where it may be one."""
    request = designed.request
    if request.sampling is not None:
        every = f"every {request.sampling.time:g} s"
        return NotProvable(f"the controller runs on a computer, {every}: its loop is not a continuous one", False)
    late = [
        f"{name} {delay:g} s" for name, delay in zip(designed.loop.inputs, designed.loop.delay, strict=True) if delay
    ]
    if late:
        return NotProvable(
            f"the loop has a transport delay ({', '.join(late)}), which no finite number of states has", False
        )
    if designed.observer is not None:
        return NotProvable("the controller runs a model of the plant, whose products with gains multiply", False)
    if isinstance(request, ClassicalController):
        if request.tab_command == "deflection" and study.tab_actuator.servo_bandwidth is None:
            return NotProvable(
                "an ideal tab deflection moves the aileron's rate at once, by an amount that changes with the flight "
                "point",
                True,
            )
        if np.unique(np.sign(plant.servo_tab.dc_gain[designed.outcomes.ok])).size > 1:
            return NotProvable("the tab's effect on the aileron changes its sign within the grid", False)
    if plant.system.aerodynamics.virtual_inertia:
        return NotProvable("the air's virtual inertia makes the mass matrix depend on the density", True)
    return None


def closed_with(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    model: LinearModel,
    gains: Mapping[str, FloatArray],
) -> FloatArray:
    """Closed-loop matrices (N, n, n) as the product assembles them, feed-forward left out.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : one that `unprovable` says nothing against
    model : (N,) plants
    gains : (N,) each, every gain of the controller by name
    """
    request = designed.request
    if isinstance(request, ClassicalController):
        servo = servo_tab(model)
        # Of the servo tab's own gain the loop takes the sign only, which is one of the design.
        sign = float(np.sign(plant.servo_tab.dc_gain[designed.outcomes.ok][0]))
        servo = replace(servo, dc_gain=np.full_like(servo.dc_gain, sign))
        return tab_loop(model, servo, study.tab_actuator, request, dict(gains)).closed
    structure = request.structure(study.tab_actuator, study.aileron_actuator)
    states = structure.states(model.states)
    K = np.stack([np.stack([gains[f"K_{u}_{x}"] for x in states], axis=-1) for u in INPUTS], axis=-2)
    loop = flown_loop(model, structure, K, np.zeros((*K.shape[:-1], len(structure.references))))
    if isinstance(request.measurement, RateFilters):
        return with_rate_filters(loop, request.measurement.cutoff).closed
    return loop.closed


def feedback_gains(designed: DesignedController) -> dict[str, FloatArray]:
    """The gains (*G,) that close the loop, by name: all but the feed-forward."""
    classical = isinstance(designed.request, ClassicalController)
    return {gain.name: gain.values for gain in designed.gains if classical or gain.name.startswith("K_")}
