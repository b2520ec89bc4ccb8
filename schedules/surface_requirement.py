"""What one actuator of a designed controller must do over the envelope: peaks, means, samples and loads (6.3.2).

The reference a controller follows is any manoeuvre (`design.manoeuvre`). Loads that are held at rest come beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.actuator_sizing.load_cases import (
    AILERON_LOCKED,
    GUST_SPEED,
    SYSTEM_FACTOR,
    ground_gust_torque,
    system_torque,
)
from design.actuator_sizing.outer_samples import outer_samples
from design.actuator_sizing.requirement import SurfaceRequirement
from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.response.knot_peaks import largest_between_knots
from design.response.manoeuvre_demand import ManoeuvreDemand, manoeuvre_demands
from design.response.manoeuvre_response import ManoeuvreResponse, manoeuvre_response
from model.actuators import ActuatorLimits
from model.arrays import FloatArray, GridArrays
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.rotor_inertia import SURFACES, without_rotor_torque


@dataclass(frozen=True)
class GroundGust:
    """A ground gust on a surface at rest: ``H = K (rho V^2 / 2) c S``, c and S of the surface aft of its hinge.

    Attributes
    ----------
    factor : K [-]
    speed : wind V [m/s]
    """

    factor: float = AILERON_LOCKED
    speed: float = GUST_SPEED


@dataclass(frozen=True)
class LoadCases:
    """Loads that the actuator holds at rest, beside what the manoeuvre asks for; None leaves a case out.

    Attributes
    ----------
    system_factor : of the holding torque after the manoeuvre, and of the peak hinge moment during it, at least 1
    ground_gust : on the ground, the same at every point
    """

    system_factor: float | None = SYSTEM_FACTOR
    ground_gust: GroundGust | None = GroundGust()


@dataclass(frozen=True, eq=False)
class Sized:
    """What an actuator is sized for.

    Attributes
    ----------
    actuator : ``tab`` or ``aileron``
    manoeuvre : of the loop's references
    duration : how long it is followed [s]
    loads : that are held at rest
    """

    actuator: str
    manoeuvre: Manoeuvre
    duration: float
    loads: LoadCases = LoadCases()


@dataclass(frozen=True, eq=False)
class ActuatorRequirement(GridArrays):
    """What an actuator must do over the envelope, at its surface and without its rotor; nan where there is no design.

    Attributes
    ----------
    demand : of the manoeuvre
    peak_hinge_moment : (*G,) largest magnitude of the moment of the air during the manoeuvre [N m]
    surface : what candidates are judged on; its static torques are the `cases`
    cases : names of the load cases: ``holding``, ``peak_hinge_moment``, ``ground_gust``
    """

    demand: ManoeuvreDemand
    peak_hinge_moment: FloatArray
    surface: SurfaceRequirement
    cases: tuple[str, ...]


def actuator_requirement(
    plant: PlantEnvelope, designed: DesignedController, sized: Sized, rotor: float = 0.0
) -> ActuatorRequirement:
    """What a design asks of one of its actuators.

    Parameters
    ----------
    plant : that the controller was designed for
    designed : a controller with a loop in continuous time
    sized : the actuator, the manoeuvre and the loads
    rotor : inertia of a rotor that the plant has on this surface [kg m^2]; its torque is taken off again

    Raises
    ------
    ValueError : a controller that runs as code, that has no such actuator or no torque of it, or no design anywhere
    """
    loop, ok = _flown(designed, sized.actuator), designed.outcomes.ok
    model = plant.model.take(ok)
    some = loop.take(ok)
    J = model.inertia[..., SURFACES[sized.actuator], :].copy()
    if rotor > 0.0:
        some = without_rotor_torque(some, sized.actuator, rotor)
        J[..., SURFACES[sized.actuator]] -= rotor
    response = manoeuvre_response(some, sized.manoeuvre, sized.duration, samples=2)
    (demand,) = manoeuvre_demands(some, response, (sized.actuator,), (ActuatorLimits(),))
    moment = _peak_hinge_moment(response, sized.actuator, J)
    names, loads = _static_loads(plant, sized, demand.holding_torque, moment)
    scale = np.stack([demand.peak_torque, demand.peak_rate, demand.peak_acceleration], axis=-1)
    outer = outer_samples(response, sized.actuator, scale)
    surface = SurfaceRequirement(
        peak_torque=demand.peak_torque, rms_torque=demand.rms_torque, peak_rate=demand.peak_rate,
        peak_power=demand.peak_power, peak_acceleration=demand.peak_acceleration,
        rms_acceleration=demand.rms_acceleration, torque=outer.torque, rate=outer.rate,
        acceleration=outer.acceleration, static_torque=loads,
    )  # fmt: skip
    return ActuatorRequirement(demand, moment, surface, names).spread(ok)


def _flown(designed: DesignedController, actuator: str) -> Loop:
    name, loop = designed.request.name, designed.loop
    if not isinstance(loop, Loop):
        raise ValueError(f"the controller {name} runs as code: its torques are not known in continuous time")
    if actuator not in loop.inputs:
        raise ValueError(f"the controller {name} has no actuator {actuator}, only {', '.join(loop.inputs)}")
    if f"T_{actuator[0]}" not in loop.outputs:
        raise ValueError(f"the deflection of the {actuator} is ideal: its torque is not finite")
    if not np.any(designed.outcomes.ok):
        raise ValueError(f"the controller {name} has no design at any point")
    return loop


def _peak_hinge_moment(response: ManoeuvreResponse, actuator: str, inertia: FloatArray) -> FloatArray:
    """(*G,) largest magnitude of ``T - J d''``, J (*G, 2) being the surface's row of the inertia matrix."""
    torque, *rates = (response.rows[..., response.index(name), :] for name in _of(actuator))
    row = torque - sum(
        inertia[..., i, None] * (rate[..., None, :] @ response.generator)[..., 0, :] for i, rate in enumerate(rates)
    )
    with np.errstate(over="ignore", invalid="ignore"):
        peaks = largest_between_knots(response.driven.signals(row[..., None, :]), (*row.shape[:-1], 1))
    return np.asarray(peaks[..., 0])


def _of(actuator: str) -> tuple[str, str, str]:
    return f"T_{actuator[0]}", "dt_rate", "da_rate"


def _static_loads(
    plant: PlantEnvelope, sized: Sized, holding: FloatArray, moment: FloatArray
) -> tuple[tuple[str, ...], FloatArray]:
    """Names (L) and torques (*G, L) [N m] of the load cases; nothing is held where the manoeuvre does not settle."""
    loads, geometry = sized.loads, plant.system.geometry
    cases: dict[str, FloatArray] = {}
    if loads.system_factor is not None:
        cases["holding"] = system_torque(np.where(np.isnan(holding), 0.0, holding), loads.system_factor)
        cases["peak_hinge_moment"] = system_torque(moment, loads.system_factor)
    if loads.ground_gust is not None:
        chord = geometry.tab_chord if sized.actuator == "tab" else geometry.aileron_chord
        gust = loads.ground_gust
        torque = ground_gust_torque(chord, np.multiply(chord, geometry.span), gust.factor, gust.speed)
        cases["ground_gust"] = np.broadcast_to(torque, moment.shape)
    torques = np.zeros((*moment.shape, len(cases)))
    for i, case in enumerate(cases.values()):
        torques[..., i] = case
    return tuple(cases), torques
