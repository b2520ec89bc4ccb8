"""What a manoeuvre asks of the actuators over the envelope: exact and linear, or simulated (seed 4.3, 6.3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.response.manoeuvre_demand import ManoeuvreDemand, TrackingErrors, manoeuvre_demands, tracking_errors
from design.response.manoeuvre_response import manoeuvre_response
from design.response.torque_speed import TorqueSpeed, torque_speed
from design.simulation.plant import NonlinearPlant
from design.simulation.request import SimulationRequest
from design.simulation.response import NonlinearResponse
from design.simulation.simulate import simulate
from model.actuators import Actuator, ActuatorLimits
from model.arrays import IntArray
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class Requirements:
    """Demands of one manoeuvre over the grid, nan where there is no design.

    Attributes
    ----------
    actuators : that the controller commands
    demands : of each, (*G)
    tracking : how far the surfaces are from the references that the controller has (*G, p)
    references : names of these, ``r_a r_t``
    torque_speed : torque and rate of each actuator together, over all points; None where no point has both
    """

    actuators: tuple[str, ...]
    demands: tuple[ManoeuvreDemand, ...]
    tracking: TrackingErrors
    references: tuple[str, ...]
    torque_speed: tuple[TorqueSpeed | None, ...]


def actuator(study: Study, name: str) -> Actuator:
    """The actuator ``tab`` or ``aileron`` of a study."""
    return {"tab": study.tab_actuator, "aileron": study.aileron_actuator}[name]


def limits_of(study: Study, actuators: tuple[str, ...]) -> tuple[ActuatorLimits, ...]:
    """Limits of the study's actuators, in this order."""
    return tuple(actuator(study, name).limits for name in actuators)


def requirements(study: Study, designed: DesignedController, manoeuvre: Manoeuvre, duration: float) -> Requirements:
    """Demands, tracking errors and torque-speed hulls of a manoeuvre, of the loop that is flown at every point.

    Parameters
    ----------
    study : of which the controller is one
    designed : a controller with a loop in continuous time
    manoeuvre : of the loop's references
    duration : how long it is followed [s]

    Raises
    ------
    ValueError : a sampled state feedback, which has no such loop
    """
    if not isinstance(designed.loop, Loop):
        raise ValueError(f"controller {designed.request.name} runs as code: it has no loop in continuous time")
    ok = designed.outcomes.ok
    loop = designed.loop.take(ok)
    response = manoeuvre_response(loop, manoeuvre, duration, samples=2)
    demands = manoeuvre_demands(loop, response, loop.inputs, limits_of(study, loop.inputs))
    together = tuple(torque_speed(response, name) if _has_torque(loop, name) else None for name in loop.inputs)
    return Requirements(
        loop.inputs,
        tuple(demand.spread(ok) for demand in demands),
        tracking_errors(loop, response).spread(ok),
        loop.references,
        tuple(None if hull is None else _on_grid(hull, np.flatnonzero(ok)) for hull in together),
    )


def simulated(
    plant: PlantEnvelope, designed: DesignedController, manoeuvre: Manoeuvre, request: SimulationRequest
) -> NonlinearResponse:
    """The non-linear response to a manoeuvre at every point that carries a design, nan elsewhere.

    Parameters
    ----------
    plant : of which the controller is one
    designed : a controller with a loop in continuous time
    manoeuvre : of the loop's references
    request : duration, limits, friction, freeplay

    Raises
    ------
    ValueError : a sampled state feedback; what `design.simulation.simulate` refuses
    """
    if not isinstance(designed.loop, Loop):
        raise ValueError(f"controller {designed.request.name} runs as code: it has no loop in continuous time")
    ok = designed.outcomes.ok
    of = NonlinearPlant.of(plant.system, plant.grid.condition.take(ok), plant.trim.take(ok), plant.model.take(ok))
    return simulate(of, designed.loop.take(ok), manoeuvre, request).spread(ok)


def limits_by_name(study: Study) -> dict[str, ActuatorLimits]:
    """Limits of both actuators."""
    return {"tab": study.tab_actuator.limits, "aileron": study.aileron_actuator.limits}


def _has_torque(loop: Loop, name: str) -> bool:
    return f"T_{name[0]}" in loop.outputs and loop.A.shape[0] > 0


def _on_grid(hull: TorqueSpeed, points: IntArray) -> TorqueSpeed:
    """The same with flat indices into the grid, of points (N,) that carry a design."""
    return TorqueSpeed(hull.hull, points[hull.hull_points], hull.cloud, points[hull.cloud_points])
