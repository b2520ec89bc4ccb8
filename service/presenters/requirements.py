"""Actuator requirements on the wire: over the grid, and the envelope's worst with the point that sets it."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.gains import Gain
from design.response.demand import ActuatorDemand
from design.response.torque_speed import TorqueSpeed
from design.simulation.response import NonlinearResponse
from model.actuators import Actuator
from model.arrays import FloatArray, IntArray
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.requirements import Requirements, actuator
from schedules.study import Reference
from service.presenters.grid import grid_document, outcome_documents
from service.presenters.simulation import LIMITED, anti_windup_gains
from service.schemas import manoeuvres

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


#: Figures of manoeuvres beside those.
_FLOWN_FIGURES = _FIGURES | {
    "time_at_deflection_limit_s": ("time_at_deflection_limit", False),
    "time_at_rate_limit_s": ("time_at_rate_limit", False),
    "time_at_torque_limit_s": ("time_at_torque_limit", False),
    "time_at_power_limit_s": ("time_at_power_limit", False),
    "needed_bandwidth_rad_s": ("needed_bandwidth", False),
}


def requirements_document(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    """What the reference step asks of each actuator the controller has."""
    assessment, study = controller.assessment, envelope.study
    figures: dict[str, dict[str, FloatArray]] = {}
    for name in controller.loop.inputs:
        demand = None if assessment is None else assessment.demand[assessment.actuators.index(name)]
        figures[name] = _over_grid(demand, _FIGURES, envelope.plant.grid.shape)
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **reference_document(study.reference, study.reference.duration),
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        "actuators": figures,
        "envelope": _envelope(figures),
        "limits": {name: _limits(actuator(study, name)) for name in figures},
    }


def flown_requirements_document(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    manoeuvre: manoeuvres.Manoeuvre,
    duration: float,
    linear: Requirements,
    nonlinear: NonlinearResponse | None,
) -> dict[str, Any]:
    """What a manoeuvre asks of each actuator the controller has."""
    study = envelope.study
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "manoeuvre": manoeuvre.normalised(),
        "duration_s": duration,
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        "linear": _linear(linear, envelope.plant.grid.shape),
        "nonlinear": None if nonlinear is None else _nonlinear(nonlinear, linear, envelope.plant.grid.shape),
        "limits": {name: _limits(actuator(study, name)) for name in linear.actuators},
    }


def _linear(found: Requirements, shape: tuple[int, ...]) -> dict[str, Any]:
    figures = {
        name: _over_grid(demand, _FLOWN_FIGURES, shape)
        for name, demand in zip(found.actuators, found.demands, strict=True)
    }
    surfaces = [{"r_a": "aileron", "r_t": "tab"}[name] for name in found.references]
    return {
        "actuators": figures,
        "envelope": _envelope(figures),
        "torque_speed": {
            name: None if hull is None else _torque_speed(hull)
            for name, hull in zip(found.actuators, found.torque_speed, strict=True)
        },
        "tracking": {
            surface: {
                "peak_deg": np.rad2deg(found.tracking.peak[..., i]),
                "rms_deg": np.rad2deg(found.tracking.rms[..., i]),
            }
            for i, surface in enumerate(surfaces)
        },
    }


def _nonlinear(found: NonlinearResponse, linear: Requirements, shape: tuple[int, ...]) -> dict[str, Any]:
    times = dict(zip(("tab", "aileron"), np.moveaxis(found.time_at_limit, -2, 0), strict=True))
    plain, flown = ({}, {})  # type: tuple[dict[str, dict[str, FloatArray]], dict[str, dict[str, FloatArray]]]
    for name, demand, beside in zip(linear.actuators, found.demand, linear.demands, strict=True):
        plain[name] = _over_grid(beside, _FIGURES, shape)
        flown[name] = _over_grid(demand, _FIGURES, shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = {
            name: {key: 100.0 * (values / plain[name][key] - 1.0) for key, values in figures.items()}
            for name, figures in flown.items()
        }
    timed = {
        name: figures | {f"time_at_{what}_limit_s": times[name][..., i] for i, what in enumerate(LIMITED)}
        for name, figures in flown.items()
    }
    residual = np.abs(found.energy.residual)
    return {
        "actuators": timed,
        "envelope": _envelope(timed),
        "difference_percent": difference,
        "simulation": found.codes,
        "simulation_reasons": found.reasons,
        "diverged_at_s": found.diverged_at,
        "left_data_at_s": found.left_data_at,
        "energy_residual_j": np.max(residual, axis=-1),
        "anti_windup": [gain_values(gain) for gain in anti_windup_gains(found, linear.actuators)],
        "unenforced": list(found.unenforced),
    }


def gain_values(gain: Gain) -> dict[str, Any]:
    """A gain over the grid: name, unit, values."""
    return {"name": gain.name, "unit": gain.unit, "values": gain.values}


def _torque_speed(hull: TorqueSpeed) -> dict[str, Any]:
    return {"hull": _pairs(hull.hull, hull.hull_points), "cloud": _pairs(hull.cloud, hull.cloud_points)}


def _pairs(pairs: FloatArray, points: IntArray) -> list[dict[str, Any]]:
    return [
        {"torque_n_m": float(torque), "rate_deg_s": float(np.rad2deg(rate)), "point": int(point)}
        for (torque, rate), point in zip(pairs, points, strict=True)
    ]


def _envelope(figures: dict[str, dict[str, FloatArray]]) -> dict[str, Any]:
    """Largest of each figure, and the point that sets it."""
    return {name: {key: worst(values) for key, values in over_grid.items()} for name, over_grid in figures.items()}


def reference_document(reference: Reference, duration: float) -> dict[str, Any]:
    """The manoeuvre that is followed, for how long."""
    aileron = float(np.rad2deg(reference.aileron))
    tab = float(np.rad2deg(reference.tab))
    rate = None if reference.rate_limit is None else float(np.rad2deg(reference.rate_limit))
    sizes = {"aileron_deg": aileron, "tab_deg": tab, "rate_limit_deg_s": rate}
    return {"reference": {"kind": reference.kind, **sizes, "duration_s": duration}}


def _over_grid(
    demand: ActuatorDemand | None, wanted: dict[str, tuple[str, bool]], shape: tuple[int, ...]
) -> dict[str, FloatArray]:
    """Every figure over the grid; nan everywhere when no point carries a design."""
    if demand is None:
        return {name: np.full(shape, np.nan) for name in wanted}
    return {
        name: np.rad2deg(getattr(demand, attribute)) if angular else getattr(demand, attribute)
        for name, (attribute, angular) in wanted.items()
    }


def worst(values: FloatArray) -> dict[str, Any]:
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
