"""Poles, damping, margins and step figures of a controller at every point of the grid, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.assess import Assessment
from model.arrays import ComplexArray, FloatArray
from schedules.designed import DesignedController, DesignedEnvelope
from service.presenters.controller import NO_METRIC, step_figures
from service.presenters.grid import grid_document, outcome_documents
from service.presenters.margins import NO_MARGIN, margin_figures
from service.wire.answering import complex_numbers

#: What a null at a point that carries a design means.
_NULLS = {
    "decay_rate_1_s": "a delay leaves the rightmost pole unproved",
    "damping_ratio": "there is no pole to have one",
    **NO_MARGIN,
    **NO_METRIC,
}


def figures_document(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    """Each figure as an array over the grid; null where the controller carries no gains, or by `null_means`."""
    found, shape = controller.assessment, envelope.plant.grid.shape
    of_loops: dict[str, dict[str, FloatArray]] = {}
    of_step: dict[str, FloatArray] | None = None
    of_poles: dict[str, Any] = {"decay_rate_1_s": np.full(shape, np.nan), "damping_ratio": np.full(shape, np.nan)}
    poles: Any = np.full(shape, None, dtype=object)
    if found is not None:
        of_loops = {name: margin_figures(one) for name, one in zip(found.actuators, found.margins, strict=True)}
        of_step = step_figures(found.step)
        of_poles = {"decay_rate_1_s": -found.largest_real_part, "damping_ratio": found.damping_ratio}
        poles = _poles(found, controller)
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        **of_poles,
        "margins": of_loops,
        "step": of_step,
        "poles": poles,
        "null_means": _NULLS,
    }


def _poles(found: Assessment, controller: DesignedController) -> list[Any]:
    """The finite poles of each point; None where the controller carries no gains."""

    def of(poles: ComplexArray, ok: Any) -> Any:
        if poles.ndim > 1:
            return [of(row, here) for row, here in zip(poles, ok, strict=True)]
        return complex_numbers(poles[np.isfinite(poles)]) if ok else None

    listed: list[Any] = of(found.poles, controller.outcomes.ok)
    return listed
