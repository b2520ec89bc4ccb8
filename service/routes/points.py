"""One grid point of a design: the plant and every controller there."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response

from schedules.designed import DesignedEnvelope
from service.answering import answer, encode
from service.openapi import problems
from service.presenters.controller import controller_document
from service.presenters.grid import grid_index
from service.presenters.plant import plant_document
from service.refusals import NotFound
from service.routes.designs import DesignId
from service.schemas.point import Point
from service.state import HEAVY, DesignsHere

router = APIRouter(prefix="/v1/designs/{id}/points", tags=["designs"])


@router.get("/{index}", response_model=Point, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def read_point(
    request: Request,
    ident: DesignId,
    index: Annotated[int, Path(description="Flat row-major index of the grid point, from 0", examples=[3])],
    designs: DesignsHere,
) -> Response:
    """Air, trim, hinge moments, linear model, poles and servo-tab of the plant, and each controller at the point."""
    return answer(request, encode(point_document(designs.envelope(ident), index)))


def point_document(envelope: DesignedEnvelope, index: int) -> dict[str, Any]:
    """The plant and every controller at a flat point.

    Raises
    ------
    NotFound : the grid has no such point
    """
    size = envelope.plant.outcomes.codes.size
    if not 0 <= index < size:
        raise NotFound(f"there is no point {index}; the grid has points 0 to {size - 1}")
    here = grid_index(envelope.plant.grid, index)
    controllers = [controller_document(envelope, controller, here) for controller in envelope.controllers]
    return plant_document(envelope.plant, index) | {"controllers": controllers}
