"""A design on the wire: gains, outcomes and verdicts over the grid, and links to everything else."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np

from design.specs import Verdict
from model.flight import GridAxis
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.files import FILE_FORMATS
from service.presenters.gain_tables import gain_document, smoothing_document
from service.presenters.grid import air_document, grid_document, outcome_documents, warning_documents
from service.presenters.hinge_moments import fit_document
from service.version import code_version, solver
from service.wire.spec_names import SpecField, spec_field


def design_document(ident: str, request: dict[str, Any], created_at: str, envelope: DesignedEnvelope) -> dict[str, Any]:
    """The answer to a design request."""
    return {
        "id": ident,
        "name": envelope.study.name,
        "request": request,
        "provenance": {"version": code_version(), "created_at": created_at, "solver": solver()},
        **over_the_grid(envelope),
        "links": links(ident, {one.request.name: one.request.kind for one in envelope.controllers}),
    }


def over_the_grid(envelope: DesignedEnvelope) -> dict[str, Any]:
    """What was designed, over the grid."""
    plant = envelope.plant
    return {
        "grid": grid_document(plant.grid),
        "air": air_document(plant.grid.condition),
        "outcomes": plant.outcomes.codes,
        "reasons": plant.outcomes.reasons,
        "warnings": warning_documents(envelope.warnings),
        "hinge_moment_fit": fit_document(plant.system.aerodynamics.source),
        "controllers": [_controller(controller, plant.grid.axes) for controller in envelope.controllers],
    }


def _controller(controller: DesignedController, axes: tuple[GridAxis, ...]) -> dict[str, Any]:
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **outcome_documents(controller.outcomes),
        "gains": [gain_document(gain, axes) for gain in controller.gains],
        "smoothing": smoothing_document(controller.smoothed),
        "reduced_frequency": controller.reduced_frequency,
        "verdicts": [verdict_over_grid(verdict) for verdict in controller.verdicts],
    }


def verdict_over_grid(verdict: Verdict) -> dict[str, Any]:
    """A spec, its worst value over the points that carry a design, and whether all of them meet it.

    The limit of a spec that varies over the grid is the one at the worst point.
    """
    field = spec_field(verdict.spec.quantity, verdict.spec.sense)
    worst = verdict.worst
    value = None if worst is None else _finite(field.value(float(verdict.values.flat[worst])))
    return {
        "spec": field.name,
        "limit": field.limit(verdict.spec) if worst is None else _limit_at(field, verdict, worst),
        "unit": field.unit,
        "source": verdict.spec.source,
        "worst_value": value,
        "worst_point": worst,
        "points_judged": int(verdict.judged.sum()),
        "points_passed": int(verdict.passed.sum()),
        "passed": worst is not None and bool(np.all(verdict.passed[verdict.judged])),
        "reason": _why_no_value(worst, value, verdict),
    }


def _limit_at(field: SpecField, verdict: Verdict, point: int) -> float:
    return field.limit_at(verdict.spec, tuple(int(i) for i in np.unravel_index(point, verdict.values.shape)))


def _why_no_value(worst: int | None, value: float | None, verdict: Verdict) -> str | None:
    """Why there is no worst value; None when there is one."""
    if worst is None:
        return "no point carries a design"
    if value is not None:
        return None
    if np.isinf(verdict.values.flat[worst]):
        return "unlimited at every point"
    return "the value does not exist there: the response does not reach it within the time it is followed"


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def links(ident: str, controllers: dict[str, str]) -> dict[str, Any]:
    """Addresses of what belongs to a design, by controller where there is one; `controllers` are kinds by name."""
    here = f"/v1/designs/{ident}"

    def each(what: str, kinds: Container[str] = controllers.values()) -> dict[str, str]:
        return {name: f"{here}/controllers/{name}/{what}" for name, kind in controllers.items() if kind in kinds}

    return {
        "self": here,
        "points": f"{here}/points/{{index}}",
        "root_locus": each("root-locus"),
        "response": each("response"),
        "frequency_response": each("frequency-response"),
        "actuator_requirements": each("actuator-requirements"),
        "limited_tab": each("limited-tab"),
        "figures": each("figures"),
        "verdicts": each("verdicts"),
        "design_margin": each("design-margin", ("negative_feedback", "positive_feedback")),
        "scaling": each("scaling"),
        "cross_flight": each("cross-flight"),
        "robust_performance": each("robust-performance"),
        "worst_case": each("worst-case"),
        "hidden_coupling": each("hidden-coupling"),
        "simultaneous_margins": each("simultaneous-margins", ("lqr",)),
        "norms": each("norms", ("lqr",)),
        "phase_plane": each("phase-plane", ("lqr",)),
        "power_comparison": each("power-comparison", ("lqr",)),
        "sample_time_sweep": each("sample-time-sweep", ("lqr",)),
        "weight_search": each("weight-search", ("lqr",)),
        "trade_off": each("trade-off", ("lqr",)),
        "report": f"{here}/report",
        "verification": f"{here}/verification",
        "certificate": each("certificate"),
        "gains": each("gains"),
        "actuation_comparison": f"{here}/actuation-comparison",
        "cross_check": f"{here}/cross-check",
        "compare": f"{here}/compare",
        "schedules": {
            name: {suffix: f"{here}/schedules/{name}.{suffix}" for suffix in FILE_FORMATS} for name in controllers
        },
    }
