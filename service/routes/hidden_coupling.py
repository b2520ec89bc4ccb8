"""What a controller's schedule does to its own loop while the scheduling variable moves."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from schedules.hidden_coupling import hidden_coupling
from schedules.moving_loop import why_no_coupling
from schedules.rules import Interpolation, OutOfRange, ScheduleRules
from schedules.schedule_of import schedule_of
from service.designs import controller_of, point_with_gains
from service.documentation.openapi import problems
from service.presenters.hidden_coupling import hidden_coupling_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.hidden_coupling_answers import HiddenCoupling
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere
from service.wire.answering import answer, encode
from service.wire.refusals import StudyNotPossible

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/hidden-coupling", tags=["controllers"])


class Moving(BaseModel):
    """How the schedule is flown."""

    model_config = PARAMETERS

    signal_lag_s: float = Field(
        default=0.0, ge=0.0, le=1000.0, description="Time constant of the scheduling signal", examples=[0.1]
    )
    rule: Interpolation = Field(default="multilinear", description="Gains between the points")
    out_of_range: OutOfRange = Field(default="clip", description="Gains outside them")
    point: int | None = Field(
        default=None, description="Flat row-major index of a point, from 0: its linearised loops are wanted too",
        examples=[3],
    )  # fmt: skip


@router.get("", response_model=HiddenCoupling, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def hidden_coupling_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[Moving, Query()],
    designs: DesignsHere,
) -> Response:
    """The law's hidden terms, dK/dq (x - x_trim) and the moving trim, with integrators before or after the gains.

    Per unit of the scheduling variable's rate: how far the aileron gets away in a ramp, and by how much each mode of
    the loop grows or decays more than its eigenvalue at rest says.
    """
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    point = None if wanted.point is None else point_with_gains(envelope, controller, wanted.point)
    reason = why_no_coupling(envelope.study, envelope.plant, controller)
    if reason is not None:
        raise StudyNotPossible(f"the controller {name} is not taken into motion: {reason}")
    rules = ScheduleRules(wanted.rule, wanted.out_of_range)
    schedule = schedule_of(envelope, controller, designs.provenance(ident), rules)
    found = hidden_coupling(envelope.study, envelope.plant, controller, schedule, wanted.signal_lag_s)
    return answer(request, encode(hidden_coupling_document(envelope, controller, schedule, found, point)))
