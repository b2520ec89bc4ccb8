"""Norms of the closed loop of a state feedback."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel

from service.designs import point_with_gains
from service.documentation.openapi import problems
from service.presenters.norms import norms_document
from service.routes.controllers import Point
from service.routes.designs import DesignId
from service.schemas.lqr_robustness import Norms
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere
from service.studies.state_feedback import LqrName, refused_by_the_domain, state_feedback
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/norms", tags=["controllers"])


class WantedNorms(BaseModel):
    """At which point."""

    model_config = PARAMETERS

    point: Point


@router.get("", response_model=Norms, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def norms_of_controller(
    request: Request,
    ident: DesignId,
    name: LqrName,
    wanted: Annotated[WantedNorms, Query()],
    designs: DesignsHere,
) -> Response:
    """H2 and H-infinity norms from torque disturbances and from sensor noise to angles and to commands."""
    feedback = state_feedback(designs.envelope(ident), name)
    loop = feedback.loop.take(point_with_gains(feedback.envelope, feedback.controller, wanted.point))
    with refused_by_the_domain(name):
        document = {"name": name, "point": wanted.point} | norms_document(loop)
    return answer(request, encode(document))
