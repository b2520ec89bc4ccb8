"""One controller at one grid point, on the wire: gains, poles, margins, step, certificate, verdicts."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.loop import Loop
from design.response.step_metrics import StepMetrics
from design.specs import Verdict
from model.arrays import FloatArray
from schedules.designed import DesignedController, DesignedEnvelope
from service.presenters.disturbance import disturbance_documents
from service.presenters.estimation import estimation_document
from service.presenters.infeasibility import infeasibility_document
from service.presenters.margins import margins_document
from service.presenters.reasons import reasons
from service.presenters.riccati import riccati_document
from service.wire.spec_names import spec_field

NO_METRIC = {
    "rise_time_s": "90 % of the change is not reached within the time the response is followed",
    "settling_time_s": "the response does not settle within the time it is followed",
    "overshoot_percent": "the response does not change in the end",
    "undershoot_percent": "the response does not change in the end",
    "peak_time_s": "there is no overshoot",
    "bandwidth_rad_s": "the transfer never falls 3 dB below its DC gain",
}


def controller_document(
    envelope: DesignedEnvelope, controller: DesignedController, index: tuple[int, ...]
) -> dict[str, Any]:
    """The controller at a grid point; null figures where it carries no gains there."""
    document: dict[str, Any] = {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "outcome": controller.outcomes.codes[index],
        "reason": controller.outcomes.reasons[index],
        "infeasibility": _infeasibility(controller, index),
        "gains": [{"name": g.name, "unit": g.unit, "value": g.values[index]} for g in controller.gains],
    }
    assessment = controller.assessment
    if assessment is None or not controller.outcomes.ok[index]:
        nothing = dict.fromkeys(("poles", "margins", "step", "disturbance", "riccati", "estimation"))
        return document | nothing | {"verdicts": []}
    here, loop = assessment.take(index), controller.loop
    return document | {
        "poles": here.poles[np.isfinite(here.poles)],
        "margins": {name: margins_document(m) for name, m in zip(here.actuators, here.margins, strict=True)},
        "step": step_document(here.step),
        "disturbance": disturbance_documents(loop.take(index)) if isinstance(loop, Loop) else None,
        "riccati": None if controller.optimum is None else riccati_document(controller.optimum, here, index),
        "estimation": estimation_document(envelope, controller, index),
        "verdicts": [verdict_at(verdict, index) for verdict in controller.verdicts],
    }


def _infeasibility(controller: DesignedController, index: tuple[int, ...]) -> dict[str, Any] | None:
    found = None if controller.infeasibility is None else controller.infeasibility[index]
    return None if found is None else infeasibility_document(found)


def step_document(step: StepMetrics) -> dict[str, Any]:
    """Figures of the aileron's response to the reference step; what is null is explained under `reasons`."""
    figures = {name: float(value) for name, value in step_figures(step).items()}
    return {**figures, "reasons": reasons(figures, NO_METRIC)}


def step_figures(step: StepMetrics) -> dict[str, FloatArray]:
    """The same over the grid (*G,); not finite where a figure does not exist."""
    return {
        "rise_time_s": step.rise_time,
        "settling_time_s": step.settling_time,
        "overshoot_percent": 100.0 * step.overshoot,
        "undershoot_percent": 100.0 * step.undershoot,
        "peak_time_s": step.peak_time,
        "steady_state_value_deg": np.rad2deg(step.steady_state_value),
        "steady_state_error_deg": np.rad2deg(step.steady_state_error),
        "bandwidth_rad_s": step.bandwidth,
    }


def verdict_at(verdict: Verdict, index: tuple[int, ...]) -> dict[str, Any]:
    """A spec at one point: what is achieved there, and whether it is enough."""
    field = spec_field(verdict.spec.quantity, verdict.spec.sense)
    return {
        "spec": field.name,
        "limit": field.limit_at(verdict.spec, index),
        "unit": field.unit,
        "source": verdict.spec.source,
        "value": field.value(float(verdict.values[index])),
        "distance": field.value(float(verdict.distance[index])),
        "passed": bool(verdict.passed[index]),
    }
