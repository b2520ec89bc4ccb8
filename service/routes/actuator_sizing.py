"""The actuator of a controller: which candidate is enough, and what a given one can hold (seed 6.3.2)."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from design.actuator_sizing.selection import Candidate
from design.classical.controller import ClassicalController
from design.lqr.synthesis import LqrDesign
from schedules.actuator_selection import most_designs, select_actuator
from schedules.designed import DesignedController
from schedules.inverse_sizing import inverse_sizing
from schedules.slower_tab_only import HALVINGS
from schedules.surface_requirement import Sized
from service.designs import continuous_loop, controller_of
from service.documentation.openapi import BODY, problems
from service.limits import check_manoeuvre, check_size
from service.presenters.actuator_sizing import inverse_document, selection_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas import actuator_sizing as asked
from service.schemas.actuator_sizing_answers import ActuatorSelection, InverseSizing
from service.settings import Settings
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.to_domain import study_of
from service.to_domain.actuator_sizing_of import candidate, sized
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute
from service.wire.refusals import FieldRefusal, InvalidRequest, StudyNotPossible

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}", tags=["controllers"], route_class=JsonRoute)


@router.post(
    "/actuator-selection",
    response_model=ActuatorSelection,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def actuator_selection(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    body: asked.ActuatorSelectionRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """What a manoeuvre and static loads ask of one actuator over the envelope, and which candidates are enough.

    Each candidate is judged at the gear ratio that leaves it the largest least headroom. With `feed_back_inertia` the
    design is made again with the candidate's rotor on the surface, at every gear ratio that is compared.
    """
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    _check_actuator(controller, body.actuator)
    wanted = sized(body, envelope.study, continuous_loop(controller).references)
    candidates = [candidate(each) for each in body.candidates]
    _check_work(controller, wanted, candidates, body.feed_back_inertia, settings)
    with refused_by_the_domain(name):
        found = select_actuator(envelope.study, envelope.plant, controller, wanted, candidates, body.feed_back_inertia)
    head = {
        "actuator": body.actuator,
        "manoeuvre": None if body.manoeuvre is None else body.manoeuvre.normalised(),
        "duration_s": wanted.duration,
    }
    return answer(request, encode(selection_document(envelope, controller, found) | head))


@router.post(
    "/inverse-sizing",
    response_model=InverseSizing,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def inverse_sizing_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    body: asked.InverseSizingRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Which part of the envelope the design holds with an actuator of these limits, and the fastest design within them.

    The design's reference is what is asked of the actuator. Points that break a limit are designed again, slower; where
    nothing helps the answer is how near to the limits it comes.
    """
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    _check_actuator(controller, body.actuator)
    points = int(controller.outcomes.ok.sum())
    if isinstance(controller.request, ClassicalController):
        points *= HALVINGS
    check_size("/name", "searches for designs within the limits", points, "max_tab_only_designs", settings)
    with refused_by_the_domain(name):
        found = inverse_sizing(envelope.study, envelope.plant, controller, body.actuator, study_of.limits(body.limits))
    return answer(request, encode(inverse_document(envelope, controller, found) | {"actuator": body.actuator}))


def _check_actuator(controller: DesignedController, actuator: str) -> None:
    """Refuse an actuator that the controller does not have, and a controller without any design.

    Raises
    ------
    StudyNotPossible : a sampled state feedback, which runs as code; or no point carries a design
    InvalidRequest : no such actuator
    """
    loop, name = continuous_loop(controller), controller.request.name
    if actuator not in loop.inputs:
        detail = f"the controller {name} has no actuator {actuator}"
        refusal = FieldRefusal("/actuator", detail, None, f"one of {', '.join(loop.inputs)}")
        raise InvalidRequest(f"/actuator: {detail}", refusal)
    if not controller.outcomes.ok.any():
        raise StudyNotPossible(f"the controller {name} has no gains at any point")


def _check_work(
    controller: DesignedController,
    wanted: Sized,
    candidates: list[Candidate],
    feed_back: bool,
    settings: Settings,
) -> None:
    """Refuse too many candidates, too many designs that they take, and manoeuvres too long for as many designs.

    Raises
    ------
    LimitExceeded
    """
    points, count = int(controller.outcomes.ok.sum()), len(candidates)
    check_size("/candidates", "candidates", count, "max_actuator_candidates", settings)
    check_size("/candidates", "candidates times grid points", count * points, "max_point_designs", settings)
    designs = 0
    if feed_back and not isinstance(controller.request, ClassicalController):
        designs = sum(most_designs(each) for each in candidates)
        what = "designs: grid points times those that the candidates with a rotor may take"
        limit = "max_tab_only_designs" if _searched(controller) else "max_point_designs"
        check_size("/candidates", what, designs * points, limit, settings)
    check_manoeuvre(wanted.manoeuvre, wanted.duration, points * (1 + designs), settings)


def _searched(controller: DesignedController) -> bool:
    """Whether a design of this state feedback is a search: with delays, or for powers."""
    optimum = controller.optimum
    retuned = isinstance(optimum, LqrDesign) and optimum.retuning is not None
    return retuned or any(continuous_loop(controller).delay)
