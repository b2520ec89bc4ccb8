"""Every point's design of a controller flown at every other point (seed Tables 8.4, 8.6)."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from schedules.cross_flight import cross_flight
from service.documentation.openapi import problems
from service.presenters.cross_flight import cross_flight_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.robustness_answers import CrossFlight
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.flown_away import Flown, carried_controller, check_loops, flown, flown_specs
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/cross-flight", tags=["controllers"])


@router.get("", response_model=CrossFlight, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def cross_flight_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[Flown, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Each point's gains flown at every point inside the model: how far they carry without a schedule.

    All that the design flies is flown: actuators, filters, integrals, delays. Stability, damping and the reference
    step of every pair of a design and a flown point; how many points each design holds; the best single design and
    the worst pair.
    """
    envelope = designs.envelope(ident)
    controller = carried_controller(envelope, name)
    pairs = int(controller.outcomes.ok.sum() * envelope.plant.outcomes.ok.sum())
    check_loops("/id", "pairs of a design and a flown point", pairs, controller, settings)
    specs, left_out = flown_specs(envelope, controller, wanted.specs)
    found = flown(lambda: cross_flight(envelope.study, envelope.plant, controller, specs, margins=wanted.margins))
    return answer(request, encode(cross_flight_document(envelope, controller, found, left_out, wanted.margins)))
