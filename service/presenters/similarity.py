"""Similarity on the wire."""

from __future__ import annotations

from typing import Any

from model.servo_scaling import ScaledServo
from model.similarity import PressureSchedule, ServoExponents
from service.presenters.grid import (
    air_document,
    coordinates,
    grid_document,
    grid_index,
    outcome_documents,
    warning_documents,
)
from service.presenters.hinge_moments import fit_document
from service.studies.plant import Similarity


def similarity_document(found: Similarity) -> dict[str, Any]:
    """The answer to a request about similarity."""
    plant = found.plant
    return {
        "grid": grid_document(plant.grid),
        "air": air_document(plant.grid.condition),
        **outcome_documents(plant.outcomes),
        "warnings": warning_documents(plant.warnings),
        "hinge_moment_fit": fit_document(plant.system.aerodynamics.source),
        "exponents": _exponents(found.exponents),
        "pressure_schedule": _schedule(found.schedule),
        "nondimensional": _nondimensional(found),
        "scaled": None if found.scaled is None else _scaled(found.scaled),
    }


def _exponents(powers: ServoExponents) -> dict[str, Any]:
    return {
        "omega_n": {
            "dynamic_pressure": powers.frequency_by_pressure,
            "airspeed": powers.frequency_by_airspeed,
            "density": powers.frequency_by_density,
            "density_at_airspeed": powers.frequency_by_density_at_airspeed,
        },
        "damping_ratio": {
            "dynamic_pressure": powers.damping_by_pressure,
            "airspeed": powers.damping_by_airspeed,
            "density": powers.damping_by_density,
            "density_at_airspeed": powers.damping_by_density_at_airspeed,
        },
    }


def _schedule(schedule: PressureSchedule) -> dict[str, Any]:
    return {
        "sufficient": schedule.sufficient,
        "reason": schedule.reason,
        "tolerance": schedule.tolerance,
        "reference_density_kg_m3": schedule.reference_density,
        "frequency_factor": schedule.frequency_factor,
        "damping_factor": schedule.damping_factor,
        "worst_factor": schedule.worst_factor,
        "best_factor": schedule.best_factor,
    }


def _nondimensional(found: Similarity) -> dict[str, Any]:
    model = found.nondimensional
    return {
        "states": list(model.states),
        "inputs": list(model.inputs),
        "points": [_point(found, point) for point in range(found.plant.outcomes.codes.size)],
    }


def _point(found: Similarity, point: int) -> dict[str, Any]:
    grid, outcomes = found.plant.grid, found.plant.outcomes
    index = grid_index(grid, point)
    document = {
        "index": point,
        "coordinates": coordinates(grid, index),
        "outcome": outcomes.codes[index],
        "reason": outcomes.reasons[index],
    }
    if not outcomes.ok[index]:
        return document | dict.fromkeys(("A", "B", "time_unit_s", "torque_unit_n_m"))
    model = found.nondimensional.take(index)
    return document | {
        "A": model.A,
        "B": model.B,
        "time_unit_s": model.time_unit,
        "torque_unit_n_m": model.torque_unit,
    }


def _scaled(scaled: ScaledServo) -> dict[str, Any]:
    return {
        "omega_n_rad_s": scaled.servo.natural_frequency,
        "damping_ratio": scaled.servo.damping_ratio,
        "dc_gain": scaled.servo.gain,
        "frequency_factor": scaled.frequency_factor,
        "damping_factor": scaled.damping_factor,
        "reduced_frequency": scaled.reduced_frequency,
        "assumptions": list(scaled.assumptions),
    }
