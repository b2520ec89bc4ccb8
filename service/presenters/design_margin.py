"""By how much all specs could be stricter, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.synthesis import DesignMargins
from schedules.designed import DesignedEnvelope
from service.presenters.gain_tables import gain_document
from service.presenters.grid import grid_document, outcome_documents
from service.wire.spec_names import spec_field


def design_margin_document(
    envelope: DesignedEnvelope, request: ClassicalController, found: DesignMargins
) -> dict[str, Any]:
    """Margins over the grid, the spec that binds at each point, and the point with the least."""
    senses = {spec.quantity: spec.sense for spec in request.specs}
    binding = np.full(found.binding.shape, None, dtype=object)
    for index, quantity in np.ndenumerate(found.binding):
        if quantity is not None:
            binding[index] = spec_field(quantity, senses[quantity]).name
    known = np.isfinite(found.margin)
    least = int(np.nanargmin(found.margin)) if known.any() else None
    worst = None if least is None else {"value": 100.0 * float(found.margin.flat[least]), "point": least}
    return {
        "name": request.name,
        "kind": request.kind,
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(found.outcomes),
        "margin_percent": 100.0 * found.margin,
        "binding": binding,
        "worst": worst,
        "gains": [gain_document(gain, envelope.plant.grid.axes) for gain in found.gains],
    }
