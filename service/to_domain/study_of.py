"""From the wire to the domain: each part of a request becomes its dataclass, degrees and Hz become radians."""

from __future__ import annotations

from math import radians, tau
from typing import Literal

import numpy as np

from design.classical.controller import ClassicalController
from design.lqr.synthesis import LqrController
from design.sampling import Sampling
from design.specs import SPEC_PACKS, Spec
from model.actuators import Actuator, ActuatorLimits
from model.aerodynamics import Aerodynamics
from model.arrays import Floats
from model.flight import SpeedAxis
from model.hinge_moments.expansion import Angles
from model.section import Body, Geometry, Inertia
from model.trim_request import LARGEST_TRIM_ANGLE, HeldTorque, TrimRequest
from schedules.study import Controller, GridRequest, PlantStudy, Reference, Study
from service.schemas import actuators, aerodynamics, controller_requests, flight, lqr_requests, requests, section
from service.schemas import trim as trims
from service.schemas.any_controller import AnyController
from service.schemas.given_gains import Gains
from service.schemas.grid_values import GridAxes, OverGrid
from service.schemas.specs import SpecPack, Specs
from service.to_domain import lqr_of
from service.to_domain.source_of import hinge_moment_source, model_refuses
from service.wire.spec_names import SPEC_FIELDS

SPEED_AXIS: dict[str, SpeedAxis] = {
    "dynamic_pressure_pa": "dynamic_pressure",
    "airspeed_m_s": "airspeed",
    "mach": "mach",
}


def study(request: requests.DesignRequest) -> Study:
    """The study that a design request asks for."""
    axes = GridAxes.of(request.grid)
    return Study(
        name=request.name,
        geometry=geometry(request.geometry),
        inertia=inertia(request.inertia),
        aerodynamics=aerodynamic_model(request.aerodynamics, request.geometry, expansion_point(request.trim)),
        trim=trim(request.trim),
        grid=grid(request.grid, request.atmosphere),
        tab_actuator=tab_actuator(request.actuators.tab),
        aileron_actuator=aileron_actuator(request.actuators.aileron),
        reference=reference(request.reference),
        controllers=tuple(controller(wanted, axes, request.reference) for wanted in request.controllers),
        spec_pack=spec_pack(request.spec_pack, axes),
    )


def plant_study(request: requests.LinearModelsRequest, known: Aerodynamics | None = None) -> PlantStudy:
    """The part of a study that linear models depend on; `known` aerodynamics of the request are not made again."""
    about = expansion_point(request.trim)
    return PlantStudy(
        geometry=geometry(request.geometry),
        inertia=inertia(request.inertia),
        aerodynamics=known or aerodynamic_model(request.aerodynamics, request.geometry, about),
        trim=trim(request.trim),
        grid=grid(request.grid, request.atmosphere),
    )


def geometry(wire: section.Geometry) -> Geometry:
    """Geometry of the section; hinges stay fractions of the chord."""
    return Geometry(wire.chord_m, wire.span_m, wire.aileron_hinge, wire.tab_hinge)


def inertia(wire: section.Inertia) -> Inertia:
    """The two bodies."""
    return Inertia(aileron=body(wire.aileron), tab=body(wire.tab))


def body(wire: section.Body) -> Body:
    """One body."""
    return Body(wire.mass_kg, wire.cg_offset_m, wire.inertia_kg_m2)


def aerodynamic_model(wire: aerodynamics.Aerodynamics, hinges: section.HingeGeometry, about: Angles) -> Aerodynamics:
    """Source of hinge moments and its corrections; a table is expanded about the angles `about`.

    Raises
    ------
    InvalidRequest : a table that cannot be fitted, or corrections that do not go together
    """
    source = hinge_moment_source(wire, hinges, about)
    with model_refuses("/aerodynamics", "corrections that go together"):
        return Aerodynamics(
            source=source,
            damping=wire.damping,
            virtual_inertia=wire.virtual_inertia,
            compressibility=wire.compressibility,
        )


def expansion_point(wire: trims.Trim) -> Angles:
    """The trim's angles, as far as they are given; zero for one that is solved for."""
    tab, aileron = (radians(angle) if isinstance(angle, float) else 0.0 for angle in (wire.tab_deg, wire.aileron_deg))
    return Angles(alpha=radians(wire.alpha_deg), dt=tab, da=aileron)


def trim(wire: trims.Trim) -> TrimRequest:
    """Angles in radians; words stay."""
    aileron, tab = wire.aileron_deg, wire.tab_deg
    return TrimRequest(
        alpha=radians(wire.alpha_deg),
        aileron=aileron if isinstance(aileron, str) else trim_angle(aileron),
        tab=tab if isinstance(tab, str) else trim_angle(tab),
        tab_limit=solved_angle_limit(wire.tab_limit_deg),
        aileron_limit=solved_angle_limit(wire.aileron_limit_deg),
    )


def trim_angle(wire: float | trims.HeldTorque) -> float | HeldTorque:
    """A given angle in radians, or the torque that decides it."""
    return HeldTorque(wire.surface, wire.torque_n_m) if isinstance(wire, trims.HeldTorque) else radians(wire)


def solved_angle_limit(wire: float | None) -> float:
    """How far a solved angle is sought."""
    return LARGEST_TRIM_ANGLE if wire is None else min(radians(wire), LARGEST_TRIM_ANGLE)


def grid(wire: flight.Grid, atmosphere: flight.Atmosphere) -> GridRequest:
    """Breakpoints of both axes, ranges written out."""
    name, speed = wire.speed_axis
    return GridRequest(
        altitude=breakpoints(wire.altitude_m),
        speed_axis=SPEED_AXIS[name],
        speed=breakpoints(speed),
        temperature_offset=atmosphere.temperature_offset_k,
    )


def breakpoints(axis: flight.Axis) -> tuple[float, ...]:
    """The breakpoints of an axis; a range has both its ends exactly."""
    if not isinstance(axis, flight.Span):
        return tuple(axis)
    spaced = np.linspace if axis.spacing == "linear" else np.geomspace
    values = spaced(axis.from_, axis.to, axis.count).tolist()
    return (axis.from_, *values[1:-1], axis.to)


def tab_actuator(wire: actuators.TabActuator) -> Actuator:
    """The tab's actuator; bandwidths from Hz to rad/s."""
    return Actuator(
        servo_bandwidth=_rad_s(wire.servo_bandwidth_hz),
        servo_damping_ratio=wire.servo_damping_ratio,
        rate_loop_bandwidth=_rad_s(wire.rate_loop_bandwidth_hz),
        torque_loop_bandwidth=_rad_s(wire.torque_loop_bandwidth_hz),
        delay=wire.delay_s,
        limits=limits(wire.limits),
    )


def aileron_actuator(wire: actuators.AileronActuator) -> Actuator:
    """The aileron's actuator."""
    return Actuator(
        torque_loop_bandwidth=_rad_s(wire.torque_loop_bandwidth_hz), delay=wire.delay_s, limits=limits(wire.limits)
    )


def limits(wire: actuators.Limits) -> ActuatorLimits:
    """Limits; None stays unlimited."""
    return ActuatorLimits(
        deflection=None if wire.deflection_deg is None else radians(wire.deflection_deg),
        rate=None if wire.rate_deg_s is None else radians(wire.rate_deg_s),
        torque=wire.torque_n_m,
        power=wire.power_w,
    )


def reference(wire: flight.Reference) -> Reference:
    """The manoeuvre that actuators are judged on."""
    return Reference(
        aileron=radians(wire.aileron_deg),
        duration=wire.duration_s,
        tab=radians(wire.tab_deg),
        rate_limit=None if wire.rate_limit_deg_s is None else radians(wire.rate_limit_deg_s),
    )


def controller(wire: controller_requests.Controller, axes: GridAxes, step: flight.Reference) -> Controller:
    """A controller by its kind; `step` is the manoeuvre that its power is weighed on."""
    if isinstance(wire, lqr_requests.Lqr):
        return LqrController(
            name=wire.name,
            weights=lqr_of.lqr_weights(wire.weights, lqr_of.reference_step(step, wire)),
            tab_allocation=lqr_of.tab_allocation(wire.tab_allocation),
            reference=wire.reference,
            delay_states=wire.delay_states,
            sampling=sampling(wire),
            measurement=lqr_of.measurement(wire.measurement),
        )
    return ClassicalController(
        name=wire.name,
        kind=wire.kind,
        specs=specs(wire.specs, axes),
        rate_filter=_rad_s(wire.rate_filter_hz) if isinstance(wire, controller_requests.NegativeFeedback) else None,
        tab_command=wire.tab_command,
        gains={} if wire.gains is None else gains(wire.gains, axes),
        sampling=sampling(wire),
        smoothness=0.0 if wire.smoothing is None else wire.smoothing.bandwidth_loss_percent_max / 100.0,
    )


def specs(wire: Specs, axes: GridAxes, source: Literal["request", "spec_pack"] = "request") -> tuple[Spec, ...]:
    """The specs that were given, each in the unit of its quantity."""
    return tuple(SPEC_FIELDS[name].spec(over_grid(limit, axes), source) for name, limit in wire if limit is not None)


def spec_pack(wire: str | SpecPack, axes: GridAxes) -> tuple[Spec, ...]:
    """The specs of a shipped pack, or of the one that the request brings."""
    return SPEC_PACKS[wire] if isinstance(wire, str) else specs(wire.specs, axes, "spec_pack")


def gains(wire: Gains, axes: GridAxes) -> dict[str, Floats]:
    """The gains that were given, in SI and radians as on the wire."""
    return {name: over_grid(gain, axes) for name, gain in wire if gain is not None}


def sampling(wire: AnyController) -> Sampling | None:
    """How a digital controller runs; None for a continuous one."""
    if wire.sample_time_s is None or wire.computational_delay_s is None:
        return None
    return Sampling(wire.sample_time_s, wire.computational_delay_s)


def over_grid(wire: float | OverGrid, axes: GridAxes) -> Floats:
    """A number, or the value at every point of the grid, in the grid's shape."""
    if not isinstance(wire, OverGrid):
        return wire
    values = np.array(wire.values, dtype=float)
    along_first = wire.axis == axes.names[0]
    return np.ascontiguousarray(np.broadcast_to(values[:, None] if along_first else values, axes.counts))


def _rad_s(frequency_hz: float | None) -> float | None:
    return None if frequency_hz is None else tau * frequency_hz
