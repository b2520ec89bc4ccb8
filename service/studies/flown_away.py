"""Loops that are flown away from their design: which controllers have them, how many there may be, what is judged."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Literal, TypeVar

from pydantic import BaseModel, Field

from design.delay.characteristic import SHORTEST
from design.specs import Spec
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.flown_figures import MARGIN_QUANTITIES, STEP_QUANTITIES
from schedules.judging import asked
from service.designs import continuous_loop, controller_of
from service.limits import check_size
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.wire.refusals import InvalidRequest, StudyNotPossible

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
