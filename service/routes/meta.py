"""The server about itself: version and limits."""

from __future__ import annotations

import platform

from fastapi import APIRouter, Request, Response

from service.documentation.openapi import problems
from service.limits import listed
from service.schemas.meta import Limits, Version
from service.state import SettingsHere
from service.version import code_version, release, solver
from service.wire.answering import answer, encode

router = APIRouter(tags=["server"])


@router.get("/v1/version", response_model=Version, responses=problems())
async def version(request: Request) -> Response:
    """Release, digest of the sources, and the numerical libraries."""
    document = {
        "name": "Gainfield",
        "version": release(),
        "code_version": code_version(),
        "python": platform.python_version(),
        "solver": solver(),
    }
    return answer(request, encode(document))


@router.get("/v1/limits", response_model=Limits, responses=problems())
async def limits(request: Request, settings: SettingsHere) -> Response:
    """What this server takes, and the settings that say so."""
    return answer(request, encode({"limits": listed(settings)}))
