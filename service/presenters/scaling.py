"""Scaling laws of a controller, their loss, and its poles made non-dimensional, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from schedules.designed import DesignedController, DesignedEnvelope
from schedules.pole_scaling import PoleScaling, ScaledPoles, pole_scaling
from schedules.power_laws import VARIABLE_UNITS, GainLaw
from schedules.scaling_laws import ScalingLoss, SpecLoss, scaling_law
from service.presenters.gain_tables import gain_document
from service.presenters.grid import grid_document, outcome_documents
from service.wire.spec_names import spec_field


def scaling_document(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    """Laws of the gains, the schedule they make, what it loses, and the scaled poles of both."""
    law = scaling_law(envelope.study, envelope.plant, controller)
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "grid": grid_document(envelope.plant.grid),
        "laws": [_law(one) for one in law.laws],
        "gains": [gain_document(gain, envelope.plant.grid.axes) for gain in law.gains],
        **outcome_documents(law.flown.outcomes),
        "loss": _loss(law.loss),
        "poles": {
            "design": _poles(pole_scaling(envelope.plant, controller)),
            "law": _poles(pole_scaling(envelope.plant, law.flown)),
        },
    }


def _law(one: GainLaw) -> dict[str, Any]:
    law = one.law
    return {
        "gain": one.gain,
        "unit": one.unit,
        "variable": one.variable,
        "variable_unit": VARIABLE_UNITS[one.variable],
        "reference": None if law is None else law.reference,
        "coefficient": None if law is None else law.coefficient,
        "exponent": None if law is None else law.exponent,
        "predicted_exponent": one.predicted,
        "misfit_percent": None if one.misfit is None else 100.0 * one.misfit,
        "points": one.points,
        "reason": one.reason,
    }


def _loss(loss: ScalingLoss) -> dict[str, Any]:
    slowest = loss.slowest
    return {
        "flown": loss.flown,
        "stable": loss.stable,
        "bandwidth_ratio": loss.bandwidth_ratio,
        "slowest": None if slowest is None else {"value": loss.bandwidth_ratio.flat[slowest], "point": slowest},
        "specs": [_spec(spec) for spec in loss.specs],
    }


def _spec(loss: SpecLoss) -> dict[str, Any]:
    field = spec_field(loss.spec.quantity, loss.spec.sense)
    return {
        "spec": field.name,
        "source": loss.spec.source,
        "distance_by_law_percent": 100.0 * loss.by_law,
        "distance_by_design_percent": 100.0 * loss.by_design,
        "failed": loss.failed,
        "points_failed": int(loss.failed.sum()),
        "worst_point": loss.worst,
    }


def _poles(scaling: PoleScaling) -> dict[str, Any]:
    return {
        "omega_n_rad_s": scaling.frequency,
        "reference_pressure_pa": scaling.reference_pressure,
        "closed_by_omega_n": _scaled(scaling.closed_by_frequency),
        "open_by_omega_n": _scaled(scaling.open_by_frequency),
        "closed_by_root_pressure_rad_s": _scaled(scaling.closed_by_pressure),
        "open_by_root_pressure_rad_s": _scaled(scaling.open_by_pressure),
    }


def _scaled(scaled: ScaledPoles) -> dict[str, Any]:
    collapse = scaled.collapse
    return {
        "branches": np.moveaxis(scaled.poles, -1, 0),
        "centre": collapse.centre,
        "spread_percent": 100.0 * collapse.spread,
        "rms_spread_percent": 100.0 * collapse.rms_spread,
    }
