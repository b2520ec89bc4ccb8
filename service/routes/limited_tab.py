"""Limited tab deflection: what the aileron's actuator must give then (seed Fig 5.19)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from schedules.limited_tab import limited_tab, limited_tab_request
from service.designs import continuous_loop, controller_of
from service.documentation.openapi import problems
from service.limits import check_steps
from service.presenters.limited_tab import limited_tab_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.limited_tab_answers import LimitedTab
from service.schemas.wire import PARAMETERS
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/limited-tab", tags=["controllers"])


class WantedTabLimits(BaseModel):
    """Limits of the tab's deflection."""

    model_config = PARAMETERS

    tab_limit_deg: Annotated[list[Annotated[float, Field(gt=0.0, le=180.0)]], Field(min_length=1, max_length=50)] = (
        Field(default=[5.0, 10.0, 15.0, 20.0, 25.0], description="Limits of the tab's total deflection, each simulated")
    )


@router.get("", response_model=LimitedTab, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def limited_tab_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedTabLimits, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """The design's reference with the tab's deflection limited: what is left for the aileron's actuator.

    The response is simulated, integrals held back as far as the tab cannot follow; no other limit counts.
    """
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    loop, reference = continuous_loop(controller).take(controller.outcomes.ok), envelope.study.reference
    limits = np.deg2rad(wanted.tab_limit_deg)
    with refused_by_the_domain(name):
        manoeuvre = reference.manoeuvre(loop.references)
        asked = limited_tab_request(reference, float(limits[0]))
        check_steps("/tab_limit_deg", loop, manoeuvre, asked, settings, times=len(limits))
        found = limited_tab(envelope.plant, controller, reference, limits)
    return answer(request, encode(limited_tab_document(envelope, controller, found)))
