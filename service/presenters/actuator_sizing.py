"""The actuator of a controller on the wire: its requirement, candidates judged on it, and designs within limits."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from design.actuator_sizing.selection import Fit, Headroom, at_surface
from model.arrays import BoolArray, FloatArray, ObjectArray
from schedules.actuator_limits import Limited
from schedules.actuator_selection import Choice, FedBack, Selection
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.inverse_sizing import Held, InverseSizing
from schedules.slower import Slower
from schedules.surface_requirement import ActuatorRequirement
from service.presenters.gain_tables import gain_document
from service.presenters.grid import grid_document, outcome_documents

#: Figure on the wire -> attribute of `ManoeuvreDemand`, and whether it is an angle.
_FIGURES = {
    "peak_torque_n_m": ("peak_torque", False),
    "rms_torque_n_m": ("rms_torque", False),
    "holding_torque_n_m": ("holding_torque", False),
    "peak_rate_deg_s": ("peak_rate", True),
    "peak_acceleration_deg_s2": ("peak_acceleration", True),
    "rms_acceleration_deg_s2": ("rms_acceleration", True),
    "peak_power_w": ("peak_power", False),
    "rms_power_w": ("rms_power", False),
}

#: What can be limited -> its field on the wire.
_LIMITS = {"deflection": "deflection_deg", "rate": "rate_deg_s", "torque": "torque_n_m", "power": "power_w"}


def selection_document(envelope: DesignedEnvelope, controller: DesignedController, found: Selection) -> dict[str, Any]:
    """What an actuator must do, and every candidate judged on it."""
    figures = _figures(found.required)
    loads = found.required.surface.static_torque
    return {
        **_head(envelope, controller),
        "requirement": figures,
        "envelope": {name: _extreme(values, np.nanargmax) for name, values in figures.items()},
        "static_loads": [{"case": case, "torque_n_m": loads[..., i]} for i, case in enumerate(found.required.cases)],
        "candidates": [_candidate(choice) for choice in found.choices],
    }


def inverse_document(
    envelope: DesignedEnvelope, controller: DesignedController, found: InverseSizing
) -> dict[str, Any]:
    """What an actuator with limits makes of a design."""
    return {
        **_head(envelope, controller),
        "limits": _limits(found.before.limited),
        "held": _held(found.before, controller.outcomes.ok),
        "before": _quickness(controller),
        "within_limits": _slower(envelope, found.slower, found.after),
        "reason": found.reason,
    }


def _head(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
    }


def _figures(required: ActuatorRequirement) -> dict[str, FloatArray]:
    figures = {"peak_hinge_moment_n_m": required.peak_hinge_moment}
    for name, (attribute, angular) in _FIGURES.items():
        values = getattr(required.demand, attribute)
        figures[name] = np.rad2deg(values) if angular else values
    return figures


def _candidate(choice: Choice) -> dict[str, Any]:
    fed_back = choice.fed_back
    return {
        "name": choice.fit.candidate.name,
        **_fit(choice.fit, choice.fit.enough),
        "fed_back": None if fed_back is None else _fed_back(fed_back),
    }


def _fed_back(found: FedBack) -> dict[str, Any]:
    return {
        **_fit(found.fit, found.enough),
        "designs": found.designs,
        "converged": found.converged,
        "lost_points": list(found.lost),
        "requirement": _figures(found.required),
        **_quickness(found.designed),
    }


def _fit(found: Fit, enough: bool) -> dict[str, Any]:
    seen = at_surface(found.candidate, found.ratio)
    return {
        "gear_ratio": found.ratio,
        "at_surface": {
            "stall_torque_n_m": seen.stall_torque,
            "continuous_torque_n_m": seen.continuous_torque,
            "no_load_rate_deg_s": float(np.rad2deg(seen.no_load_rate)),
            "rotor_inertia_kg_m2": seen.inertia,
        },
        "enough": bool(enough),
        "least_headroom": found.least,
        "capability": found.capability,
        "point": found.point,
        "headroom": {
            field.name: _extreme(getattr(found.headroom, field.name), np.nanargmin) for field in fields(Headroom)
        },
        "least_headroom_over_grid": found.headroom.least,
    }


def _extreme(values: FloatArray, which: Any) -> dict[str, Any]:
    """The value that `which` picks, and its flat point; null when no point has one."""
    if np.all(np.isnan(values)):
        return {"value": None, "point": None}
    point = int(which(values))
    return {"value": float(values.flat[point]), "point": point}


def _limits(limited: Limited) -> dict[str, float | None]:
    given = dict(zip(limited.names, limited.values.tolist(), strict=True))
    return {
        field: _as_asked(float(_wire(name, np.asarray(given[name])))) if name in given else None
        for name, field in _LIMITS.items()
    }


def _as_asked(value: float) -> float:
    """Turning 30 degrees to radians and back must not leave 30.000000000000004."""
    return float(f"{value:.12g}")


def _wire(name: str, values: FloatArray) -> FloatArray:
    return np.asarray(np.rad2deg(values)) if name in ("deflection", "rate") else values


def _peaks(limited: Limited, peaks: FloatArray) -> dict[str, FloatArray | None]:
    given = dict(zip(limited.names, np.moveaxis(peaks, -1, 0), strict=True))
    return {f"peak_{field}": _wire(name, given[name]) if name in given else None for name, field in _LIMITS.items()}


def _held(found: Held, ok: BoolArray) -> dict[str, Any]:
    held, breaks = np.full(ok.shape, None, dtype=object), np.full(ok.shape, None, dtype=object)
    held[ok] = found.held[ok]
    for index in map(tuple, np.argwhere(ok)):
        breaks[index] = [name for name, broken in zip(found.limited.names, found.breaks[index], strict=True) if broken]
    return {
        "held": held,
        "points_held": int(found.held.sum()),
        "breaks": breaks,
        "peaks": _peaks(found.limited, found.peaks),
    }


def _quickness(controller: DesignedController) -> dict[str, FloatArray]:
    if controller.assessment is None:
        nothing = np.full(controller.outcomes.ok.shape, np.nan)
        return {"settling_time_s": nothing, "bandwidth_rad_s": nothing}
    step = controller.assessment.step
    return {"settling_time_s": step.settling_time, "bandwidth_rad_s": step.bandwidth}


def _slower(envelope: DesignedEnvelope, slower: Slower | None, after: Held | None) -> dict[str, Any] | None:
    if slower is None or after is None:
        return None
    steered: ObjectArray = slower.steered_by
    return {
        **outcome_documents(slower.designed.outcomes),
        "steered_by": steered,
        "factor": slower.factor,
        **_quickness(slower.designed),
        "held": _held(after, slower.designed.outcomes.ok),
        "least_peaks": _peaks(after.limited, slower.least),
        "gains": [gain_document(gain, envelope.plant.grid.axes) for gain in slower.designed.gains],
    }
