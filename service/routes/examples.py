"""The shipped requests, ready to be posted."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response

from service.documentation.openapi import problems
from service.examples import NAMES, example
from service.schemas.requests import DesignRequest
from service.wire.answering import answer, encode
from service.wire.refusals import NotFound

router = APIRouter(prefix="/v1/examples", tags=["examples"])


@router.get("", response_model=dict[str, DesignRequest], responses=problems())
def examples(request: Request) -> Response:
    """Every shipped design request, by name: two wind-tunnel sections and a full-scale aileron."""
    return answer(request, encode({name: example(name) for name in NAMES}))


@router.get("/{name}", response_model=DesignRequest, responses=problems(404))
def one_example(
    request: Request,
    name: Annotated[str, Path(description="Name of the example", examples=["wind_tunnel"])],
) -> Response:
    """One shipped design request, as `POST /v1/designs` takes it."""
    if name not in NAMES:
        raise NotFound(f"there is no example {name[:80]!a}; there are {', '.join(NAMES)}")
    document: dict[str, Any] = example(name)
    return answer(request, encode(document))
