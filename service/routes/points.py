"""One grid point of a design: the plant and every controller there."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response
from fastapi.concurrency import run_in_threadpool
from starlette.responses import StreamingResponse

from schedules.designed import DesignedEnvelope
from service.documentation.openapi import problems
from service.http.negotiation import JSON_LINES
from service.presenters.controller import controller_document
from service.presenters.grid import grid_index
from service.presenters.plant import plant_document
from service.routes.designs import DesignId
from service.schemas.point import Point
from service.state import HEAVY, DesignsHere, computing
from service.version import code_version
from service.wire.answering import answer, encode, line, unchanged
from service.wire.refusals import NotFound

router = APIRouter(prefix="/v1/designs/{id}/points", tags=["designs"])


#: Points that are computed before any of them is sent.
_BATCH = 8
_LINES: dict[int | str, dict[str, Any]] = {
    200: {"description": "Every point, one a line, as `/points/{index}` answers it", "content": {JSON_LINES: {}}}
}


@router.get("", response_class=Response, responses=_LINES | problems(404, 409, 503), dependencies=[HEAVY])
async def read_points(request: Request, ident: DesignId, designs: DesignsHere) -> Response:
    """All grid points in row-major order as JSON Lines, computed as they are sent."""
    envelope = await run_in_threadpool(designs.envelope, ident)
    headers = {"ETag": f'"{ident}.{code_version()}"', "Cache-Control": "private, no-cache"}
    if unchanged(request, headers["ETag"]):
        return Response(status_code=304, headers=headers)
    return StreamingResponse(_lines(request, envelope), media_type=JSON_LINES, headers=headers)


async def _lines(request: Request, envelope: DesignedEnvelope) -> AsyncIterator[bytes]:
    """The points, a few at a time: whoever reads slowly holds no slot while reading."""
    size = envelope.plant.outcomes.codes.size

    def batch(start: int) -> bytes:
        return b"".join(line(point_document(envelope, index)) for index in range(start, min(start + _BATCH, size)))

    for start in range(0, size, _BATCH):
        async with computing(request):
            made = await run_in_threadpool(batch, start)
        yield made


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
