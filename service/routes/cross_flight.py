"""Every point's design of a controller flown at every other point (seed Tables 8.4, 8.6)."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Annotated, Literal, TypeVar

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.delay.characteristic import SHORTEST
from design.specs import Spec
from schedules.cross_flight import cross_flight
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.flown_figures import MARGIN_QUANTITIES, STEP_QUANTITIES
from schedules.judging import asked
from service.answering import answer, encode
from service.designs import continuous_loop, controller_of
from service.limits import check_size
from service.openapi import problems
from service.presenters.cross_flight import cross_flight_document
from service.refusals import InvalidRequest, StudyNotPossible
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.robustness_answers import CrossFlight
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/cross-flight", tags=["controllers"])

#: Whose specs a loop must meet to be held.
WhoseSpecs = Literal["request", "spec_pack", "none"]
#: What is known of a loop away from its design.
JUDGED = ("damping_ratio", *STEP_QUANTITIES, *MARGIN_QUANTITIES)

Result = TypeVar("Result")

log = logging.getLogger("gainfield")


class Flown(BaseModel):
    """What is asked of loops that are flown away from their design."""

    model_config = PARAMETERS

    specs: WhoseSpecs = Field(
        default="request",
        description="What a loop must meet to be held, besides being stable: the specs of the controller's request, "
        "those of the design's spec pack, or none",
    )
    margins: bool = Field(default=False, description="Whether margins are wanted too", examples=[True])


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


def carried_controller(envelope: DesignedEnvelope, name: str) -> DesignedController:
    """The controller of this name, if its gains can be flown away from their design.

    Raises
    ------
    NotFound
    StudyNotPossible : a sampled state feedback, or one that runs a model of its own point
    """
    controller = controller_of(envelope, name)
    continuous_loop(controller)
    if controller.observer is not None:
        raise StudyNotPossible(f"the controller {name} estimates states by a model of its own point")
    return controller


def check_loops(pointer: str, what: str, loops: int, controller: DesignedController, settings: Settings) -> None:
    """Refuse to fly too many loops; of those with delays fewer are too many.

    Raises
    ------
    LimitExceeded
    """
    delayed = max(continuous_loop(controller).delay) > SHORTEST
    limit, kind = ("max_delayed_loops", ", with delays") if delayed else ("max_flown_loops", "")
    check_size(pointer, what + kind, loops, limit, settings)


def flown_specs(
    envelope: DesignedEnvelope, controller: DesignedController, whose: WhoseSpecs
) -> tuple[tuple[Spec, ...], tuple[Spec, ...]]:
    """The specs that are judged of loops away from their design, and those that cannot be."""
    specs = {"request": asked(controller.request), "spec_pack": envelope.study.spec_pack, "none": ()}[whose]
    judged = tuple(spec for spec in specs if spec.quantity in JUDGED)
    return judged, tuple(spec for spec in specs if spec.quantity not in JUDGED)


def flown(function: Callable[[], Result]) -> Result:
    """What the domain answers; what it refuses is a refused request, not a fault of the server.

    Raises
    ------
    InvalidRequest
    """
    try:
        return function()
    except (ValueError, ArithmeticError) as error:
        log.warning("loops away from their design were refused by the model", exc_info=error)
        raise InvalidRequest(f"the model cannot answer for these numbers: {error}") from error
