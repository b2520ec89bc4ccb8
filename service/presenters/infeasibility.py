"""Why a point has no gains, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.classical.infeasibility import Infeasibility
from service.wire.spec_names import spec_field


def infeasibility_document(found: Infeasibility) -> dict[str, Any]:
    """The specs whose relaxation alone is enough, the smallest first, and what the nearest design misses."""
    relaxations = []
    for relaxation in found.relaxations:
        field = spec_field(relaxation.spec.quantity, relaxation.spec.sense)
        relaxations.append(
            {
                "spec": field.name,
                "unit": field.unit,
                "limit": field.limit_at(relaxation.spec, ()),
                "reachable": field.value(relaxation.limit),
                "relaxation_percent": relaxation.percent,
            }
        )
    missed = []
    for spec, value in zip(found.missed, found.nearest, strict=True):
        field = spec_field(spec.quantity, spec.sense)
        nearest = field.value(value) if np.isfinite(value) else None
        missed.append({"spec": field.name, "unit": field.unit, "limit": field.limit_at(spec, ()), "nearest": nearest})
    return {
        "blocking": relaxations[0]["spec"] if relaxations else None,
        "relaxations": relaxations,
        "nearest_design_misses": missed,
    }
