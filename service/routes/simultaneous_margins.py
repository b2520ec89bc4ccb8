"""How much both actuators of a state feedback may change at once."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from design.disturbance.frequency_response import response_frequencies
from design.frequency.poles import poles
from service.designs import point_with_gains
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.simultaneous_margins import simultaneous_margins_document
from service.routes.designs import DesignId
from service.routes.frequency_response import WantedResponses, frequency_range
from service.schemas.lqr_robustness import SimultaneousMargins
from service.state import HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import LqrName, refused_by_the_domain, state_feedback
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/simultaneous-margins", tags=["controllers"])


@router.get("", response_model=SimultaneousMargins, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def simultaneous_margins_of_controller(
    request: Request,
    ident: DesignId,
    name: LqrName,
    wanted: Annotated[WantedResponses, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """What the loop stands when tab and aileron change at once, by any factors of a disk, and one at a time.

    Transport delays are in all of it exactly; then the worst frequency is searched for, not proved.
    """
    check_size("/count", "frequencies", wanted.count, "max_response_samples", settings)
    feedback = state_feedback(designs.envelope(ident), name)
    loop = feedback.loop.take(point_with_gains(feedback.envelope, feedback.controller, wanted.point))
    found = poles(loop.closed)
    low, high = frequency_range(found, wanted)
    with refused_by_the_domain(name):
        omega = response_frequencies(found, low, high, wanted.count)
        document = {"name": name, "point": wanted.point} | simultaneous_margins_document(loop, omega)
    return answer(request, encode(document))
