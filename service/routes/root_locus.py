"""Root loci of one controller of a design."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.frequency.loci import root_locus
from design.frequency.locus_damping import gain_at_damping
from design.loop import Loop, SisoLoop
from schedules.designed import DesignedEnvelope
from service.designs import continuous_loop, controller_of, point_with_gains
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.root_locus import root_locus_document
from service.routes.controllers import ControllerName, Point
from service.routes.designs import DesignId
from service.schemas.controller_answers import RootLocus
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import HEAVY, DesignsHere, SettingsHere
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, InvalidRequest

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/root-locus", tags=["controllers"])


class WantedLocus(BaseModel):
    """Which root locus is wanted, and how finely."""

    model_config = PARAMETERS

    point: Point
    loop: Annotated[str, Field(max_length=64)] | None = Field(
        default=None,
        description="Gain whose locus is wanted, in the order of closure `K_d`, `K_p`, `K_i` (or `K_f`, `K_i`), or the "
        "actuator input `tab` or `aileron` at which the whole loop is opened; without it, the loop closed first",
    )
    damping_ratio: Annotated[float, Field(ge=0.01, le=0.99)] = Field(
        default=0.5, description="Damping ratio whose gains are wanted"
    )
    count: Annotated[int, Field(ge=100)] = Field(default=300, description="How many gains, 0 included")


@router.get("", response_model=RootLocus, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def root_locus_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedLocus, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Closed-loop poles at one point as one gain grows, the others as they are; the chosen gain is among the gains."""
    return answer(request, encode(root_locus_at(designs.envelope(ident), name, wanted, settings)))


def root_locus_at(envelope: DesignedEnvelope, name: str, wanted: WantedLocus, settings: Settings) -> dict[str, Any]:
    """The root locus of a controller at a point.

    Raises
    ------
    Refusal : there is no such controller, point or loop, or too many gains are wanted
    """
    check_size("/count", "gains", wanted.count, "max_locus_gains", settings)
    controller = controller_of(envelope, name)
    index = point_with_gains(envelope, controller, wanted.point)
    whole = continuous_loop(controller)
    loop = _loop(whole.take(index), wanted.loop)
    document = {"name": name, "loop": loop.name, "loops": _loop_names(whole), "point": wanted.point}
    locus, damped = root_locus(loop, count=wanted.count), gain_at_damping(loop, wanted.damping_ratio)
    return document | root_locus_document(locus, damped, wanted.damping_ratio)


def _loop_names(loop: Loop) -> list[str]:
    """Loops that have a locus: the stages in the order of their closure, then the actuator inputs."""
    return list(dict.fromkeys([stage.name for stage in loop.stages] + list(loop.inputs)))


def _loop(loop: Loop, name: str | None) -> SisoLoop:
    """The loop of this name, or the one closed first.

    Raises
    ------
    InvalidRequest : the controller has no such loop
    """
    names = _loop_names(loop)
    chosen = names[0] if name is None else name
    if chosen not in names:
        detail = f"the controller has no loop {chosen!a}"
        raise InvalidRequest(f"/loop: {detail}", FieldRefusal("/loop", detail, None, f"one of {', '.join(names)}"))
    return loop.cut(chosen) if chosen in loop.inputs else loop.stage(chosen)
