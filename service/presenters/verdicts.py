"""Every spec at every point of the grid, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.specs import Verdict
from model.arrays import ObjectArray
from schedules.designed import DesignedController, DesignedEnvelope
from service.presenters.design import verdict_over_grid
from service.presenters.grid import grid_document, outcome_documents
from service.wire.spec_names import spec_field


def verdicts_document(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    """Limits, values, distances and verdicts as arrays over the grid, and the worst point of each spec."""
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        "verdicts": [_over_points(verdict) for verdict in controller.verdicts],
    }


def _over_points(verdict: Verdict) -> dict[str, Any]:
    field = spec_field(verdict.spec.quantity, verdict.spec.sense)
    limits = np.empty(verdict.values.shape)
    for index in np.ndindex(limits.shape):
        limits[index] = field.limit_at(verdict.spec, index)
    return verdict_over_grid(verdict) | {
        "limits": limits,
        "values": verdict.values / field.scale,
        "distances": verdict.distance / field.scale,
        "passes": _where_judged(verdict),
    }


def _where_judged(verdict: Verdict) -> ObjectArray:
    passes = np.full(verdict.passed.shape, None, dtype=object)
    passes[verdict.judged] = verdict.passed[verdict.judged]
    return passes
