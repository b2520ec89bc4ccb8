"""The smallest table of a controller that is proved everywhere and keeps its specs between its lines."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from schedules.designed import ControllerRefused
from schedules.refine.refine import refine
from schedules.refine.request import RefineRequest
from service.designs import controller_of
from service.documentation.openapi import BODY, problems
from service.limits import check_size
from service.presenters.refinement import refinement_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.refinements import Refinement, RefinementRequest
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute
from service.wire.refusals import StudyNotPossible

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/refinement", tags=["controllers"], route_class=JsonRoute)


@router.post("", response_model=Refinement, responses=problems(*BODY, 404, 409, 503), dependencies=[ALWAYS_HEAVY])
def refinement_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    body: RefinementRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Lines of altitude and speed that the controller's table needs, and no more; and what a uniform grid would need.

    Every cell is proved; every spec is kept between the lines within the tolerance, and the gains where asked for.
    """
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    points = body.altitude_lines * body.speed_lines
    check_size("/speed_lines", "lines of altitude times lines of speed", points, "max_refined_points", settings)
    wanted = RefineRequest(
        fraction=body.fraction,
        spec_tolerance=body.spec_tolerance_percent / 100.0,
        gain_error=None if body.gain_error_percent is None else body.gain_error_percent / 100.0,
        most_lines=(body.altitude_lines, body.speed_lines),
        start="ends" if body.start == "ends" else "study",
        uniform=body.uniform,
    )
    with refused_by_the_domain(name):
        try:
            found = refine(envelope.study, controller.request, wanted)
        except ControllerRefused as refused:
            raise StudyNotPossible(f"the weights of the controller {name} do not work here: {refused}") from refused
    return answer(request, encode(refinement_document(found)))
