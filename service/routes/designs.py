"""Designs: made by request, listed, and read back byte for byte."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from service.designs import design_id
from service.documentation.openapi import BODY, job_answers, problems
from service.http.negotiation import JSON, JSON_LINES, accepted_by, preferred
from service.jobs.deferral import accepted
from service.jobs.kinds.design import design_job
from service.limits import check_design, check_size, fits_in_a_job, of_jobs
from service.schemas.design import Design, DesignList
from service.schemas.requests import DesignRequest
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import HEAVY, DesignsHere, SettingsHere, principal_of, read, state_of
from service.wire.answering import answer, encode, line
from service.wire.reading import JsonRoute, prefers_async
from service.wire.refusals import LimitExceeded

router = APIRouter(prefix="/v1/designs", tags=["designs"], route_class=JsonRoute)

DesignId = Annotated[str, Path(alias="id", description="Id of a design, as `POST /v1/designs` answered it")]


class Page(BaseModel):
    """Which page of the list is wanted."""

    model_config = PARAMETERS

    limit: Annotated[int, Field(ge=1)] = Field(default=50, description="Designs on the page", examples=[50])
    cursor: Annotated[str, Field(pattern="^d[0-9]{1,18}$")] | None = Field(
        default=None, description="`next_cursor` of the page before; without it, the newest designs"
    )


@router.post(
    "",
    status_code=201,
    response_model=Design,
    responses={
        200: {"model": Design, "description": "The same request was answered before: the same bytes"},
        **job_answers(),
        **problems(*BODY, 503),
    },
    dependencies=[HEAVY],
)
def create_design(request: Request, wanted: DesignRequest, designs: DesignsHere, settings: SettingsHere) -> Response:
    """Design every controller at every grid point, and keep the design.

    The id is the hash of the request, defaults filled in, and of the code: the same request is answered with the
    same bytes. A point that cannot be designed carries an outcome with its reason and does not stop the others.
    """
    if _to_be_a_job(request, wanted, settings):
        state, principal = state_of(request), principal_of(request)
        ident, jobs = design_id(wanted), state.jobs
        found = designs.known(ident)
        if found is None and jobs is not None:
            state.door.check_room(principal)
            owner = principal.owner
            return accepted(request, jobs.ask(design_job(wanted, owner), owner, again=True))
    design, new = designs.create(wanted)
    headers = {"Location": f"/v1/designs/{design.id}"}
    return answer(request, design.answer, 201 if new else 200, headers=headers)


def _to_be_a_job(request: Request, wanted: DesignRequest, settings: Settings) -> bool:
    """Whether the client prefers a job, or the work is too much in line.

    Raises
    ------
    LimitExceeded : it is too much for a job, too
    """
    try:
        check_design(wanted, settings)
    except LimitExceeded as refused:
        if not fits_in_a_job(refused, settings):
            raise
        check_design(wanted, of_jobs(settings))
        return True
    return prefers_async(request)


_LINES: dict[int | str, dict[str, Any]] = {
    200: {"model": DesignList, "description": "A page; as JSON Lines, a design a line", "content": {JSON_LINES: {}}}
}


@router.get("", response_model=DesignList, responses=_LINES | problems(422, 503))
async def list_designs(
    request: Request, page: Annotated[Page, Query()], designs: DesignsHere, settings: SettingsHere
) -> Response:
    """Designs, newest first, a page at a time."""
    check_size("/limit", "designs on a page", page.limit, "max_listed_designs", settings)
    before = None if page.cursor is None else int(page.cursor[1:])
    found = await read(request, partial(designs.page, page.limit + 1, before))
    more = len(found) > page.limit
    items = [
        {
            "id": one.id,
            "name": one.name,
            "created_at": one.created_at,
            "version": one.version,
            "link": f"/v1/designs/{one.id}",
        }
        for one in found[: page.limit]
    ]
    next_cursor = f"d{found[page.limit - 1].seq}" if more else None
    headers = {"Link": f'</v1/designs?limit={page.limit}&cursor={next_cursor}>; rel="next"'} if more else {}
    headers["Vary"] = "Accept"
    if preferred(accepted_by(request), (JSON, JSON_LINES)) == JSON_LINES:
        return answer(request, b"".join(map(line, items)), media_type=JSON_LINES, headers=headers)
    return answer(request, encode({"items": items, "next_cursor": next_cursor}), headers=headers)


@router.get("/{id}", response_model=Design, responses=problems(404, 503))
async def read_design(request: Request, ident: DesignId, designs: DesignsHere) -> Response:
    """The design, byte for byte as it was first answered."""
    return await read(request, lambda: answer(request, designs.find(ident).answer))


@router.delete("/{id}", status_code=204, responses=problems(404, 503))
async def delete_design(request: Request, ident: DesignId, designs: DesignsHere) -> Response:
    """Forget the design. It is gone when it has no other owner; its request, posted again, is designed again."""
    await read(request, lambda: designs.delete(ident))
    return Response(status_code=204)
