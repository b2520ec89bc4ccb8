"""Frequency responses of one controller of a design."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.disturbance.frequency_response import response_frequencies
from design.frequency.poles import poles
from design.frequency.sampled import sampled_poles
from design.lqr.coded_loop import CodedLoop
from model.arrays import ComplexArray
from schedules.designed import DesignedEnvelope
from service.designs import controller_of, point_with_gains
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.frequency_response import coded_responses_document, frequency_response_document
from service.routes.controllers import ControllerName, Point
from service.routes.designs import DesignId
from service.schemas.frequency_answers import FrequencyResponses
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import HEAVY, DesignsHere, SettingsHere
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, InvalidRequest

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/frequency-response", tags=["controllers"])

#: Frequencies that may be asked for [rad/s].
Frequency = Annotated[float, Field(ge=1e-6, le=1e8, json_schema_extra={"unit": "rad/s"})]


class WantedResponses(BaseModel):
    """At which point, and over which frequencies."""

    model_config = PARAMETERS

    point: Point
    from_: Frequency | None = Field(
        default=None, alias="from", description="First frequency; without it, a decade below the slowest pole"
    )
    to: Frequency | None = Field(
        default=None, description="Last frequency; without it, the decade above the fastest pole"
    )
    count: Annotated[int, Field(ge=2)] = Field(
        default=400, description="How many frequencies; those of resonances are among them"
    )


@router.get("", response_model=FrequencyResponses, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def frequency_response_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedResponses, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Loop, S, T and KS at the actuators' commands, and the transfers of reference, disturbances and noise.

    Transport delays are in them exactly. The loop is the one that is opened at all commands at once. Those of a sampled
    state feedback are from sample to sample, up to half the sampling rate; disturbances and noise are left out.
    """
    return answer(request, encode(frequency_responses_at(designs.envelope(ident), name, wanted, settings)))


def frequency_responses_at(
    envelope: DesignedEnvelope, name: str, wanted: WantedResponses, settings: Settings
) -> dict[str, Any]:
    """The frequency responses of a controller at a point.

    Raises
    ------
    Refusal : there is no such controller or point, or the frequencies cannot be had
    """
    check_size("/count", "frequencies", wanted.count, "max_response_samples", settings)
    controller = controller_of(envelope, name)
    loop = controller.loop.take(point_with_gains(envelope, controller, wanted.point))
    document: dict[str, Any] = {"name": name, "point": wanted.point}
    if isinstance(loop, CodedLoop):
        found = sampled_poles(loop.closed, loop.sampling.time, max(loop.waiting, default=0)).equivalent
        found = found[np.isfinite(found)]
        low, high = frequency_range(found, wanted, fastest=float(np.pi / loop.sampling.time))
        responses = coded_responses_document(loop, response_frequencies(found, low, high, wanted.count))
    else:
        found = poles(loop.closed)
        low, high = frequency_range(found, wanted)
        responses = frequency_response_document(loop, response_frequencies(found, low, high, wanted.count))
    return document | responses


def frequency_range(found: ComplexArray, wanted: WantedResponses, fastest: float = np.inf) -> tuple[float, float]:
    """First and last frequency [rad/s]; where neither is given, none above `fastest`.

    Raises
    ------
    InvalidRequest : the first is not below the last, or the last is above `fastest`
    """
    size = np.abs(found)[np.abs(found) > 0.0]
    slowest, quickest = (float(size.min()), float(size.max())) if size.size else (1.0, 1.0)
    low = wanted.from_ or 10.0 ** np.floor(np.log10(slowest) - 1.0)
    high = wanted.to or min(10.0 ** np.ceil(np.log10(quickest) + 0.5), fastest)
    if high > fastest:
        detail = f"the last frequency, {high:g} rad/s, is above half the sampling rate"
        raise InvalidRequest(f"/to: {detail}", FieldRefusal("/to", detail, "rad/s", f"<= {fastest:.9g}"))
    if not low < high:
        detail = f"the first frequency, {low:g} rad/s, is not below the last, {high:g} rad/s"
        raise InvalidRequest(f"/from: {detail}", FieldRefusal("/from", detail, "rad/s", f"< {high:g}"))
    return low, high
