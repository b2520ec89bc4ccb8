"""Studies of the plant over its grid: statics and similarity, each point inside the model."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import radians

import numpy as np

from model.actuators import ActuatorLimits
from model.arrays import BoolArray
from model.flight import FlightGrid, flight_condition, flight_grid
from model.nondimensional import NondimensionalModel, aerodynamic_time, nondimensional, servo_time
from model.servo_scaling import MeasuredServo, ScaledServo, SectionSize, scale_servo
from model.similarity import PressureSchedule, ServoExponents, pressure_schedule, servo_exponents
from model.steady_state import SteadyStateMap, TabOnlyEquilibrium, steady_state_map, tab_only_equilibrium
from model.system import TabAileron
from schedules.analysis import PlantEnvelope
from schedules.study import PlantStudy
from service.designs import analysed
from service.schemas import studies
from service.to_domain.study_of import SPEED_AXIS, breakpoints, trim
from service.wire.refusals import FieldRefusal, InvalidRequest

log = logging.getLogger("gainfield")


@contextmanager
def asked_of_model() -> Iterator[None]:
    """What the model refuses within is a refused request, not a fault of the server.

    Raises
    ------
    InvalidRequest
    """
    try:
        yield
    except (ValueError, ArithmeticError) as error:
        log.warning("a study was refused by the model", exc_info=error)
        raise InvalidRequest(f"the model cannot answer for these numbers: {error}") from error


def flight_grid_of(study: PlantStudy) -> FlightGrid:
    """The flight grid of a study."""
    asked = study.grid
    return flight_grid(np.array(asked.altitude), asked.speed_axis, np.array(asked.speed), asked.temperature_offset)


def system_of(study: PlantStudy) -> TabAileron:
    """The section of a study."""
    return TabAileron(study.geometry, study.inertia, study.aerodynamics)


@dataclass(frozen=True, eq=False)
class SteadyStates:
    """The plant, and its statics (*G, ...) at the points of `covered` (*G,); nan at the others.

    `tab_only` holds the aileron angles of the map by the tab alone.
    """

    plant: PlantEnvelope
    covered: BoolArray
    found: SteadyStateMap
    tab_only: TabOnlyEquilibrium


def steady_states(wanted: studies.SteadyStateMapRequest) -> SteadyStates:
    """Statics over the deflections that were asked for.

    Raises
    ------
    InvalidRequest : no point of the grid lies inside the model, or the model refuses the numbers
    """
    plant = analysed(wanted)
    system, covered = plant.system, plant.system.aerodynamics.covers(plant.grid.condition.mach)
    condition, alpha = plant.grid.condition.take(covered), radians(wanted.trim.alpha_deg)
    plane, limits = wanted.deflections, wanted.limits
    aileron, tab = (np.deg2rad(breakpoints(axis)) for axis in (plane.aileron_deg, plane.tab_deg))
    tab_limits = _limits(limits.tab.deflection_deg, limits.tab.torque_n_m)
    aileron_limits = _limits(limits.aileron.deflection_deg, None)
    with asked_of_model():
        found = steady_state_map(system, condition, alpha, aileron, tab, tab_limits, aileron_limits)
        tab_only = tab_only_equilibrium(system, condition, alpha, aileron, tab_limits)
    return SteadyStates(plant, covered, found.spread(covered), tab_only.spread(covered))


def _limits(deflection_deg: float | None, torque: float | None) -> ActuatorLimits:
    return ActuatorLimits(deflection=None if deflection_deg is None else radians(deflection_deg), torque=torque)


@dataclass(frozen=True, eq=False)
class Similarity:
    """What the plant's dynamics depend on, over the grid (*G,); nan where the plant's outcome is not ok."""

    plant: PlantEnvelope
    exponents: ServoExponents
    schedule: PressureSchedule
    nondimensional: NondimensionalModel
    scaled: ScaledServo | None


def similarity(wanted: studies.SimilarityRequest) -> Similarity:
    """Exponents, the verdict on a schedule in dynamic pressure alone, non-dimensional models, a scaled measurement.

    Raises
    ------
    InvalidRequest : no point of the grid has a linear model, or the model refuses the numbers
    """
    plant = analysed(wanted)
    ok = plant.outcomes.ok
    if not ok.any():
        reason = next(text for text in plant.outcomes.reasons.flat if text)
        detail = f"no grid point has a linear model: {reason}"
        raise InvalidRequest(f"/grid: {detail}", FieldRefusal("/grid", detail, None, "a trim that can be reached"))
    system, condition, request = plant.system, plant.grid.condition.take(ok), trim(wanted.trim)
    with asked_of_model():
        exponents = servo_exponents(system, condition, request)
        schedule = pressure_schedule(system, condition, request, wanted.tolerance)
    return Similarity(
        plant, exponents.spread(ok), schedule.spread(ok), _nondimensional(wanted, plant), _scaled(wanted, plant)
    )


def _nondimensional(wanted: studies.SimilarityRequest, plant: PlantEnvelope) -> NondimensionalModel:
    condition = plant.grid.condition
    in_chords = wanted.time_unit == "chords"
    time = aerodynamic_time(plant.system, condition) if in_chords else servo_time(plant.servo_tab)
    return nondimensional(plant.model, time, plant.system.hinge_load(condition))


def _scaled(wanted: studies.SimilarityRequest, plant: PlantEnvelope) -> ScaledServo | None:
    """The measured servo-tab on this section, at the points with a linear model."""
    measured = wanted.measured
    if measured is None:
        return None
    ok, (axis, speed) = plant.outcomes.ok, measured.speed
    geometry, inertia = plant.system.geometry, plant.system.inertia_matrix[..., 1, 1]
    with asked_of_model():
        scaled = scale_servo(
            MeasuredServo(
                np.array(measured.omega_n_rad_s), np.array(measured.damping_ratio), np.array(measured.dc_gain)
            ),
            SectionSize(measured.chord_m, measured.span_m, measured.inertia_kg_m2),
            flight_condition(measured.altitude_m, SPEED_AXIS[axis], speed, measured.temperature_offset_k),
            SectionSize(geometry.chord, geometry.span, inertia),
            plant.grid.condition.take(ok),
            compressible=wanted.aerodynamics.compressibility == "prandtl_glauert",
        )
    return scaled.spread(ok)
