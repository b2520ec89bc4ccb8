"""Actuator requirements on the wire: over the grid, and the envelope's worst with the point that sets it."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.response.demand import ActuatorDemand
from model.actuators import Actuator
from model.arrays import FloatArray
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.study import Reference
from service.presenters.grid import grid_document, outcome_documents

#: Field on the wire -> attribute of `ActuatorDemand`, and whether it is an angle.
_FIGURES = {
    "peak_torque_n_m": ("peak_torque", False),
    "rms_torque_n_m": ("rms_torque", False),
    "holding_torque_n_m": ("holding_torque", False),
    "peak_rate_deg_s": ("peak_rate", True),
    "peak_acceleration_deg_s2": ("peak_acceleration", True),
    "rms_acceleration_deg_s2": ("rms_acceleration", True),
    "peak_deflection_deg": ("peak_deflection", True),
    "peak_power_w": ("peak_power", False),
    "rms_power_w": ("rms_power", False),
    "energy_out_j": ("energy_out", False),
    "energy_back_j": ("energy_back", False),
}


def requirements_document(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    """What the reference step asks of each actuator the controller has."""
    assessment, study = controller.assessment, envelope.study
    actuators = {"tab": study.tab_actuator, "aileron": study.aileron_actuator}
    figures: dict[str, dict[str, FloatArray]] = {}
    for name in controller.loop.inputs:
        demand = None if assessment is None else assessment.demand[assessment.actuators.index(name)]
        figures[name] = _over_grid(demand, envelope.plant.grid.shape)
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **reference_document(study.reference, study.reference.duration),
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        "actuators": figures,
        "envelope": {
            name: {figure: _worst(values) for figure, values in over_grid.items()}
            for name, over_grid in figures.items()
        },
        "limits": {name: _limits(actuators[name]) for name in figures},
    }


def reference_document(reference: Reference, duration: float) -> dict[str, Any]:
    """The manoeuvre that is followed, for how long."""
    aileron = float(np.rad2deg(reference.aileron))
    tab = float(np.rad2deg(reference.tab))
    return {"reference": {"kind": reference.kind, "aileron_deg": aileron, "tab_deg": tab, "duration_s": duration}}


def _over_grid(demand: ActuatorDemand | None, shape: tuple[int, ...]) -> dict[str, FloatArray]:
    """Every figure over the grid; nan everywhere when no point carries a design."""
    if demand is None:
        return {name: np.full(shape, np.nan) for name in _FIGURES}
    return {
        name: np.rad2deg(getattr(demand, attribute)) if angular else getattr(demand, attribute)
        for name, (attribute, angular) in _FIGURES.items()
    }


def _worst(values: FloatArray) -> dict[str, Any]:
    """Largest value and the flat point that sets it; null when no point has one."""
    if np.all(np.isnan(values)):
        return {"value": None, "point": None}
    point = int(np.nanargmax(values))
    return {"value": float(values.flat[point]), "point": point}


def _limits(actuator: Actuator) -> dict[str, float | None]:
    """Limits of the actuator as the request gave them; null is unlimited."""
    limits = actuator.limits
    return {
        "deflection_deg": None if limits.deflection is None else float(np.rad2deg(limits.deflection)),
        "rate_deg_s": None if limits.rate is None else float(np.rad2deg(limits.rate)),
        "torque_n_m": limits.torque,
        "power_w": limits.power,
    }
