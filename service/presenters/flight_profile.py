"""A flight over a profile, on the wire."""

from __future__ import annotations

from dataclasses import fields
from math import degrees
from typing import Any

import numpy as np

from model.actuators import ActuatorLimits
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.profile_response import ProfileResponse
from schedules.requirements import actuator
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.wire_names import wire_name
from service.presenters.simulation import LIMITED
from service.schemas.flight_profiles import FlightProfileRequest
from service.wire.signal_units import signal_unit

_SURFACES = ("tab", "aileron")
#: Quantity of a figure -> the ending of its name, and how many of that unit make one inside.
_FIGURES = {
    "torque": ("n_m", 1.0), "rate": ("deg_s", degrees(1.0)), "acceleration": ("deg_s2", degrees(1.0)),
    "deflection": ("deg", degrees(1.0)), "power": ("w", 1.0), "energy": ("j", 1.0),
}  # fmt: skip
#: Reference -> the signal that follows it, and the surface.
_FOLLOWED = {"r_a": ("da", "aileron"), "r_t": ("dt", "tab")}


def flight_profile_document(
    envelope: DesignedEnvelope, controller: DesignedController, body: FlightProfileRequest, found: ProfileResponse
) -> dict[str, Any]:
    """Signals, gains, demands and tracking errors of a flight."""
    signals, units, errors = {}, {}, {}
    for column, name in enumerate(found.names):
        unit, size = signal_unit(name, {})
        signals[wire_name(name, unit)] = found.outputs[:, column] * size
        units[wire_name(name, unit)] = unit
        if found.error_estimate is not None:
            errors[wire_name(name, unit)] = float(found.error_estimate[column]) * size
    condition = found.condition
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "profile": body.profile.normalised(),
        "manoeuvre": body.manoeuvre.normalised(),
        "duration_s": body.duration_s,
        "trim": body.trim,
        "outcome": str(found.code),
        "reason": found.reason,
        "diverged_at_s": found.diverged_at,
        "left_data_at_s": found.left_data_at,
        "time_s": found.time,
        "condition": {
            "altitude_m": condition.air.altitude,
            "dynamic_pressure_pa": condition.dynamic_pressure,
            "airspeed_m_s": condition.airspeed,
            "mach": condition.mach,
            "density_kg_m3": condition.air.density,
        },
        "signals": signals,
        "units": units,
        "target": {
            wire_name(_FOLLOWED[name][0], "deg"): np.rad2deg(found.target[:, i])
            for i, name in enumerate(found.references)
        },
        "gains": [{"name": gain.name, "unit": gain.unit, "values": gain.values} for gain in found.gains],
        "clipped": found.clipped,
        "slowest_pole_1_s": found.slowest,
        "actuators": _demands(found),
        "limits": {name: _limits(actuator(envelope.study, name).limits) for name in found.actuators},
        "limits_reached": {
            name: {what: found.at_limit[:, _SURFACES.index(name), i] for i, what in enumerate(LIMITED)}
            for name in found.actuators
        },
        "tracking": {
            _FOLLOWED[each.reference][1]: {
                "peak_deg": _degrees(each.peak), "rms_deg": _degrees(each.rms), "last_deg": _degrees(each.last)
            }
            for each in found.tracking
        },
        "rule": INTERPOLATIONS["multilinear"],
        "out_of_range": OUTS_OF_RANGE["clip"],
        "steps": found.steps,
        "error_estimate": errors or None,
    }  # fmt: skip


def _limits(limits: ActuatorLimits) -> dict[str, float | None]:
    """Limits of an actuator; None is unlimited."""
    return {
        "deflection_deg": None if limits.deflection is None else _degrees(limits.deflection),
        "rate_deg_s": None if limits.rate is None else _degrees(limits.rate),
        "torque_n_m": limits.torque,
        "power_w": limits.power,
    }


def _demands(found: ProfileResponse) -> dict[str, Any]:
    """Figures of each actuator, with the times at limits."""
    made = {}
    for name, demand in zip(found.actuators, found.demand, strict=True):
        figures = {}
        for field in fields(demand):
            ending, size = _FIGURES[_quantity(field.name)]
            figures[f"{field.name}_{ending}"] = float(getattr(demand, field.name)) * size
        times = found.time_at_limit[_SURFACES.index(name)]
        made[name] = figures | {f"time_at_{what}_limit_s": float(times[i]) for i, what in enumerate(LIMITED)}
    return made


def _quantity(figure: str) -> str:
    """What a figure of a demand is of: ``peak_torque`` of torque."""
    return next(word for word in figure.split("_") if word in _FIGURES)


def _degrees(angle: float) -> float:
    return float(np.rad2deg(angle))
