"""Limited tabs on the wire: what the aileron's actuator must give then."""

from __future__ import annotations

from typing import Any

import numpy as np

from schedules.designed import DesignedController, DesignedEnvelope
from schedules.limited_tab import LimitedTab
from service.presenters.grid import grid_document, outcome_documents
from service.presenters.requirements import reference_document, worst


def limited_tab_document(
    envelope: DesignedEnvelope, controller: DesignedController, found: LimitedTab
) -> dict[str, Any]:
    """Curves over the limits, of every point and of the envelope."""
    reference = envelope.study.reference
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **reference_document(reference, reference.duration),
        "tab_limit_deg": np.rad2deg(found.limits),
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
        "points": {
            "aileron_peak_torque_n_m": found.aileron_peak_torque,
            "aileron_rms_torque_n_m": found.aileron_rms_torque,
            "tab_peak_deflection_deg": np.rad2deg(found.tab_peak_deflection),
            "tab_time_at_limit_s": found.tab_time_at_limit,
            "final_error_deg": np.rad2deg(found.final_error),
        },
        "envelope": [worst(found.aileron_peak_torque[..., k]) for k in range(len(found.limits))],
        "simulation": found.codes,
        "simulation_reasons": found.reasons,
    }
