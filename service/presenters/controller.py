"""One controller at one grid point, on the wire: gains, poles, margins, step, certificate, verdicts."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.frequency.margins import Margins
from design.response.step_metrics import StepMetrics
from design.specs import Verdict
from schedules.designed import DesignedController
from service.presenters.disturbance import disturbance_documents
from service.presenters.infeasibility import infeasibility_document
from service.presenters.riccati import riccati_document
from service.spec_names import spec_field

#: Why a margin is null.
_NO_MARGIN = {
    "gain_margin_up_db": "no larger gain destabilises the loop",
    "gain_margin_down_db": "no smaller gain destabilises the loop",
    "phase_margin_deg": "the loop gain is never 1: no phase destabilises it",
    "delay_margin_s": "no delay destabilises the loop",
    "crossover_rad_s": "the loop gain is never 1",
}
_NO_METRIC = {
    "rise_time_s": "90 % of the change is not reached within the time the response is followed",
    "settling_time_s": "the response does not settle within the time it is followed",
    "overshoot_percent": "the response does not change in the end",
    "undershoot_percent": "the response does not change in the end",
    "peak_time_s": "there is no overshoot",
    "bandwidth_rad_s": "the transfer never falls 3 dB below its DC gain",
}


def controller_document(controller: DesignedController, index: tuple[int, ...]) -> dict[str, Any]:
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
        nothing = dict.fromkeys(("poles", "margins", "step", "disturbance", "riccati"))
        return document | nothing | {"verdicts": []}
    here = assessment.take(index)
    return document | {
        "poles": here.poles[np.isfinite(here.poles)],
        "margins": {name: margins_document(m) for name, m in zip(here.actuators, here.margins, strict=True)},
        "step": step_document(here.step),
        "disturbance": disturbance_documents(controller.loop.take(index)),
        "riccati": None if controller.riccati is None else riccati_document(controller.riccati, index),
        "verdicts": [verdict_at(verdict, index) for verdict in controller.verdicts],
    }


def _infeasibility(controller: DesignedController, index: tuple[int, ...]) -> dict[str, Any] | None:
    found = None if controller.infeasibility is None else controller.infeasibility[index]
    return None if found is None else infeasibility_document(found)


def margins_document(margins: Margins) -> dict[str, Any]:
    """Margins of one loop; what is null is explained under `reasons`."""
    ratio = margins.gain_ratio
    exists = np.isfinite(ratio) & (ratio > 0.0)
    gains = zip(ratio[exists].tolist(), margins.gain_omega[exists].tolist(), strict=True)
    crossed = np.isfinite(margins.phase)
    phases = zip(np.rad2deg(margins.phase[crossed]).tolist(), margins.phase_omega[crossed].tolist(), strict=True)
    figures = {
        "gain_margin_up_db": float(margins.gain_margin_up_db),
        "gain_margin_down_db": float(margins.gain_margin_down_db),
        "phase_margin_deg": float(np.rad2deg(margins.phase_margin)),
        "delay_margin_s": float(margins.delay_margin),
        "disk_margin": float(margins.disk_margin),
        "sensitivity_peak": float(margins.sensitivity_peak),
        "crossover_rad_s": float(margins.crossover),
    }
    return {
        "gain_margins": [{"ratio": k, "db": 20.0 * float(np.log10(k)), "omega_rad_s": w} for k, w in gains],
        "phase_margins": [{"deg": phase, "omega_rad_s": w} for phase, w in phases],
        **figures,
        "reasons": _reasons(figures, _NO_MARGIN),
    }


def step_document(step: StepMetrics) -> dict[str, Any]:
    """Figures of the aileron's response to the reference step; what is null is explained under `reasons`."""
    figures = {
        "rise_time_s": float(step.rise_time),
        "settling_time_s": float(step.settling_time),
        "overshoot_percent": 100.0 * float(step.overshoot),
        "undershoot_percent": 100.0 * float(step.undershoot),
        "peak_time_s": float(step.peak_time),
        "steady_state_value_deg": float(np.rad2deg(step.steady_state_value)),
        "steady_state_error_deg": float(np.rad2deg(step.steady_state_error)),
        "bandwidth_rad_s": float(step.bandwidth),
    }
    return {**figures, "reasons": _reasons(figures, _NO_METRIC)}


def _reasons(figures: dict[str, float], why: dict[str, str]) -> dict[str, str]:
    """Why each figure that does not exist does not."""
    return {
        name: why.get(name, "the closed loop does not settle")
        for name, value in figures.items()
        if not np.isfinite(value)
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
