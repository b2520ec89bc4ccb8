"""Refined tables on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from schedules.refine.lines import Lines
from schedules.refine.result import RefinedSchedule
from schedules.wire_names import axis_name
from service.presenters.gain_tables import gain_document
from service.presenters.grid import grid_document
from service.wire.spec_names import spec_field


def refinement_document(found: RefinedSchedule) -> dict[str, Any]:
    """The table, its proof, its losses and how it came about."""
    axes = found.plant.grid.axes
    names = [axis_name(axis) for axis in axes]
    alpha = found.proof.summary.alpha
    return {
        "name": found.designed.request.name,
        "kind": found.designed.request.kind,
        "holds": found.holds,
        "why": found.why,
        "words": found.words,
        "grid": grid_document(found.plant.grid),
        "request_grid": _axes(found.lines, names),
        "points": found.points,
        "outcomes": found.designed.outcomes.codes,
        "gains": [gain_document(gain, axes) for gain in found.designed.gains],
        "proved_decay_rate_1_s": float(alpha) if np.isfinite(alpha) else None,
        "specs": [_spec(loss, names) for loss in found.specs],
        "gain_errors": [
            {
                "name": gain.name,
                "error_percent": 100.0 * gain.error,
                "coordinates": dict(zip(names, (gain.altitude, gain.speed), strict=True)),
            }
            for gain in found.gains
        ],
        "looked_at": found.looked_at,
        "history": [
            {
                "action": step.action,
                "cause": step.cause,
                "axis": None if step.axis is None else names[step.axis],
                "line": step.line,
                "points": step.lines.points,
                "words": step.words,
            }
            for step in found.history
        ],
        "uniform": None
        if found.uniform is None
        else {
            "axes": None if found.uniform.lines is None else _axes(found.uniform.lines, names),
            "points": None if found.uniform.lines is None else found.uniform.lines.points,
            "tried": found.uniform.tried,
            "words": found.uniform.words,
        },
        "remaining": [{"index": list(cell.index), "reason": cell.reason} for cell in found.remaining],
    }


def _axes(lines: Lines, names: list[str]) -> dict[str, list[float]]:
    return {name: list(lines[axis]) for axis, name in enumerate(names)}


def _spec(loss: Any, names: list[str]) -> dict[str, Any]:
    field = spec_field(loss.quantity, loss.sense)
    return {
        "spec": field.name,
        "unit": field.unit,
        "against": loss.against,
        "loss_percent": 100.0 * loss.loss,
        "value": field.value(loss.value),
        "reference": field.value(loss.reference),
        "coordinates": dict(zip(names, (loss.altitude, loss.speed), strict=True)),
    }
