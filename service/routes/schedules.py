"""Gain schedules as files to download."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response

from schedules.files import FILE_FORMATS, write_schedule
from schedules.schedule_of import schedule_of
from service.answering import answer, download_headers
from service.designs import controller_of
from service.openapi import problems
from service.refusals import NotFound
from service.routes.designs import DesignId
from service.state import HEAVY, DesignsHere

router = APIRouter(prefix="/v1/designs/{id}/schedules", tags=["schedules"])

_FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file, as an attachment",
        "content": {f.media_type.partition(";")[0]: {} for f in FILE_FORMATS.values()},
    }
}


@router.get(
    "/{controller}.{suffix}",
    response_class=Response,
    responses=_FILE | problems(404, 409, 503),
    dependencies=[HEAVY],
)
def download_schedule(
    request: Request,
    ident: DesignId,
    controller: Annotated[str, Path(description="Name of the controller", examples=["nf"])],
    suffix: Annotated[str, Path(description="Format: json, csv or mat", examples=["csv"])],
    designs: DesignsHere,
) -> Response:
    """The gain schedule of one controller, with its outcomes, units, law and rule between the points."""
    if suffix not in FILE_FORMATS:
        raise NotFound(f"there is no schedule file {suffix[:80]!a}; there are {', '.join(FILE_FORMATS)}")
    envelope = designs.envelope(ident)
    schedule = schedule_of(envelope, controller_of(envelope, controller), designs.provenance(ident))
    headers = download_headers(envelope.study.name, controller, suffix=suffix)
    content = write_schedule(schedule, suffix)
    return answer(request, content, media_type=FILE_FORMATS[suffix].media_type, headers=headers)
