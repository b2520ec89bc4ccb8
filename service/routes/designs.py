"""Designs: made by request, listed, and read back byte for byte."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from service.answering import answer, encode
from service.limits import check_design, check_size
from service.openapi import BODY, problems
from service.reading import JsonRoute
from service.refusals import FieldRefusal, InvalidRequest
from service.schemas.design import Design, DesignList
from service.schemas.requests import DesignRequest
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere, SettingsHere

router = APIRouter(prefix="/v1/designs", tags=["designs"], route_class=JsonRoute)

DesignId = Annotated[str, Path(alias="id", description="Id of a design, as `POST /v1/designs` answered it")]


class Page(BaseModel):
    """Which page of the list is wanted."""

    model_config = PARAMETERS

    limit: Annotated[int, Field(ge=1)] = Field(default=50, description="Designs on the page", examples=[50])
    cursor: Annotated[str, Field(max_length=40)] | None = Field(
        default=None, description="`next_cursor` of the page before; without it, the newest designs"
    )


@router.post(
    "",
    status_code=201,
    response_model=Design,
    responses={
        200: {"model": Design, "description": "The same request was answered before: the same bytes"},
        **problems(*BODY, 503),
    },
    dependencies=[HEAVY],
)
def create_design(request: Request, wanted: DesignRequest, designs: DesignsHere, settings: SettingsHere) -> Response:
    """Design every controller at every grid point, and keep the design.

    The id is the hash of the request, defaults filled in, and of the code: the same request is answered with the
    same bytes. A point that cannot be designed carries an outcome with its reason and does not stop the others.
    """
    check_design(wanted, settings)
    design, new = designs.create(wanted)
    headers = {"Location": f"/v1/designs/{design.id}"}
    return answer(request, design.answer, 201 if new else 200, headers=headers)


@router.get("", response_model=DesignList, responses=problems(422, 503))
def list_designs(
    request: Request, page: Annotated[Page, Query()], designs: DesignsHere, settings: SettingsHere
) -> Response:
    """Designs, newest first, a page at a time."""
    check_size("/limit", "designs on a page", page.limit, "max_listed_designs", settings)
    found = designs.page(page.limit + 1, _before(page.cursor))
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
    headers = {"Link": f'</v1/designs?limit={page.limit}&cursor={next_cursor}>; rel="next"'} if more else None
    return answer(request, encode({"items": items, "next_cursor": next_cursor}), headers=headers)


def _before(cursor: str | None) -> int | None:
    """Place in the list that a cursor stands for.

    Raises
    ------
    InvalidRequest : it is not one of ours
    """
    if cursor is None:
        return None
    place = cursor.removeprefix("d")
    if not (place.isascii() and place.isdecimal() and cursor == f"d{place}" and len(place) < 19):
        detail = "not a cursor of this list"
        field = FieldRefusal("/cursor", detail, None, "the next_cursor of a page")
        raise InvalidRequest(f"/cursor: {detail}", field)
    return int(place)


@router.get("/{id}", response_model=Design, responses=problems(404, 503))
def read_design(request: Request, ident: DesignId, designs: DesignsHere) -> Response:
    """The design, byte for byte as it was first answered."""
    return answer(request, designs.find(ident).answer)


@router.delete("/{id}", status_code=204, responses=problems(404, 503))
def delete_design(ident: DesignId, designs: DesignsHere) -> Response:
    """Forget the design. It is gone when it has no other owner; its request, posted again, is designed again."""
    designs.delete(ident)
    return Response(status_code=204)
