"""The second opinion: the figures of a design by python-control beside its own."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from schedules.cross_check import cross_check
from schedules.designed import DesignedController, DesignedEnvelope
from service.designs import controller_of
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.cross_check import CheckedHere, cross_check_document
from service.presenters.grid import grid_index
from service.routes.designs import DesignId
from service.schemas.cross_check_answers import CrossCheck
from service.schemas.wire import PARAMETERS
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, InvalidRequest

router = APIRouter(prefix="/v1/designs/{id}/cross-check", tags=["designs"])


class WantedChecks(BaseModel):
    """Where, and of which controllers."""

    model_config = PARAMETERS

    points: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1, max_length=1000)] = Field(
        description="Flat row-major indices of grid points, from 0; give the parameter once for each", examples=[[0, 5]]
    )
    controller: Annotated[list[str], Field(max_length=100)] = Field(
        default=[], description="Names of controllers; all of them when left out"
    )


@router.get("", response_model=CrossCheck, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def cross_check_of_design(
    request: Request,
    ident: DesignId,
    wanted: Annotated[WantedChecks, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Gains, poles, margins and step of each controller at some points, by python-control and by this service.

    python-control is given the plant, the actuators and the gains (or the weights), and nothing else that was computed
    here. Differences are told and tolerances are stated; what it has no counterpart of is left out, with the reason.
    """
    envelope = designs.envelope(ident)
    points = list(dict.fromkeys(wanted.points))
    names = list(dict.fromkeys(wanted.controller))
    controllers = [controller_of(envelope, name) for name in names] or list(envelope.controllers)
    check_size("/points", "points times controllers", len(points) * len(controllers), "max_cross_checks", settings)
    _inside(envelope, wanted.points)
    found = [_checked(envelope, controller, point) for point in points for controller in controllers]
    return answer(request, encode(cross_check_document(envelope, points, found)))


def _inside(envelope: DesignedEnvelope, points: list[int]) -> None:
    """Refuse points that the grid does not have.

    Raises
    ------
    InvalidRequest
    """
    size = envelope.plant.outcomes.codes.size
    for place, point in enumerate(points):
        if point >= size:
            detail, pointer = f"the grid has no point {point}", f"/points/{place}"
            raise InvalidRequest(f"{pointer}: {detail}", FieldRefusal(pointer, detail, None, f">= 0 and <= {size - 1}"))


def _checked(envelope: DesignedEnvelope, controller: DesignedController, point: int) -> CheckedHere:
    index = grid_index(envelope.plant.grid, point)
    ok = bool(controller.outcomes.ok[index])
    return CheckedHere(point, controller, cross_check(envelope, controller, index) if ok else None)
