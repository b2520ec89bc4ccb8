"""All controllers of a design side by side: what each asks of both actuators (seed 5.7)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from model.arrays import FloatArray
from schedules.actuation_comparison import (
    rate_limited_actuation,
    samples_needed,
    step_actuation,
    usual_rates,
    why_not_compared,
)
from schedules.designed import DesignedEnvelope
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.actuation_comparison import compared_document, comparison_document, left_out_document
from service.routes.designs import DesignId
from service.schemas.actuation_answers import ActuationComparison
from service.schemas.manoeuvres import RateLimit
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/actuation-comparison", tags=["designs"])


class WantedRates(BaseModel):
    """At which rates the reference is followed, beside the step."""

    model_config = PARAMETERS

    rate_limit_deg_s: Annotated[list[RateLimit], Field(max_length=100)] = Field(
        default=[],
        description="Rates of the references; without one, six at which the aileron's takes from a half to a 64th of "
        "the time that the design's step is followed",
    )


@router.get("", response_model=ActuationComparison, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def actuation_comparison_of_design(
    request: Request,
    ident: DesignId,
    wanted: Annotated[WantedRates, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Torque of the aileron as flown and with the tab held, what the tab saves, what its actuator does, and how fast.

    On the design's reference step, and as curves over the rate of the reference. A controller that cannot be compared
    is listed with the reason.
    """
    envelope = designs.envelope(ident)
    reference = envelope.study.reference
    rates = np.deg2rad(wanted.rate_limit_deg_s) if wanted.rate_limit_deg_s else usual_rates(reference)
    _check_work(envelope, rates, settings)
    controllers = []
    for controller in envelope.controllers:
        reason = why_not_compared(controller)
        if reason is not None:
            controllers.append(left_out_document(controller, reason))
            continue
        with refused_by_the_domain(controller.request.name):
            step = step_actuation(envelope.plant, controller, reference)
            curves = rate_limited_actuation(envelope.plant, controller, reference, rates)
        controllers.append(compared_document(controller, step, curves, rates))
    return answer(request, encode(comparison_document(envelope, rates, controllers)))


def _check_work(envelope: DesignedEnvelope, rates: FloatArray, settings: Settings) -> None:
    """Refuse to look at more samples than this server does.

    Raises
    ------
    LimitExceeded
    """
    reference = envelope.study.reference
    samples = sum(samples_needed(controller, reference, rates) for controller in envelope.controllers)
    what = "samples of the step and its rate-limited forms, of all controllers at all points"
    check_size("/rate_limit_deg_s", what, samples, "max_compared_samples", settings)
