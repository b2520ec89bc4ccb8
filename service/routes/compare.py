"""Two designs, or two controllers of one, side by side."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import orjson
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from model.arrays import IntArray
from schedules.analysis import PlantEnvelope
from schedules.compare import Compared, carried, common_points
from service.designs import Designs, controller_of
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.compare import Flown, compare_document
from service.routes.designs import DesignId
from service.schemas.compare_answers import Comparison
from service.schemas.wire import PARAMETERS
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.wire.answering import answer, encode
from service.wire.request_differences import differences

router = APIRouter(prefix="/v1/designs/{id}/compare", tags=["designs"])


class WantedComparison(BaseModel):
    """With which design, and of which controllers."""

    model_config = PARAMETERS

    with_: str | None = Field(
        default=None,
        alias="with",
        description="Id of the other design; without it, two controllers of this one are compared",
    )
    controller: str | None = Field(
        default=None, description="Of this design; its first one when left out", examples=["nf"]
    )
    other_controller: str | None = Field(
        default=None,
        description="Of the other design; when left out, the one of the same name, or else its first one",
        examples=["lqr"],
    )


@router.get("", response_model=Comparison, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def compare_designs(
    request: Request,
    ident: DesignId,
    wanted: Annotated[WantedComparison, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """What the requests differ in; gains, margins, damping, settling and actuator peaks at the common grid points.

    And whether each controller would hold on the other design's plant: by the poles of that loop, and by the nu-gap
    between the two plants against the generic stability margin of the loop designed.
    """
    other_ident = ident if wanted.with_ is None else wanted.with_
    this = _compared(designs, ident, wanted.controller, None)
    other = _compared(designs, other_ident, wanted.other_controller, this.controller.request.name)
    common = common_points(this.envelope.plant, other.envelope.plant)
    check_size("/with", "points that both grids have", common.one.size, "max_compared_points", settings)
    requests = (orjson.loads(designs.find(each).request) for each in (ident, other_ident))
    flown = (
        _flown(this, other.envelope.plant, common.one, common.other),
        _flown(other, this.envelope.plant, common.other, common.one),
    )
    document = compare_document((ident, other_ident), (this, other), list(differences(*requests)), common, flown)
    return answer(request, encode(document))


def _compared(designs: Designs, ident: str, name: str | None, namesake: str | None) -> Compared:
    """The controller of this name, or without one the namesake of another, or the first."""
    envelope = designs.envelope(ident)
    names = [controller.request.name for controller in envelope.controllers]
    if name is None:
        name = namesake if namesake in names and namesake is not None else names[0]
    return Compared(envelope, controller_of(envelope, name))


def _flown(mine: Compared, theirs: PlantEnvelope, points: IntArray, there: IntArray) -> Flown:
    """The controller on the other plant; what is not flown there says why."""
    if not points.size:
        return Flown(None, "the grids have no point in common")
    try:
        found = carried(mine, theirs, points, there)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Flown(None, str(error))
    return Flown(found, None if found.flown.any() else "at no common point are there both gains and a plant")
