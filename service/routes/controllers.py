"""One controller of a design: step response, actuator requirements, verdicts, gains between the grid points."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from design.classical.controller import ClassicalController
from schedules.designed import DesignedEnvelope
from schedules.interpolate import interpolate
from schedules.run import design_margins
from schedules.schedule_of import schedule_of
from schedules.wire_names import axis_name
from service.answering import answer, encode
from service.designs import controller_of, measuring_all
from service.openapi import problems
from service.presenters.design_margin import design_margin_document
from service.presenters.gains import gains_document
from service.presenters.scaling import scaling_document
from service.presenters.verdicts import verdicts_document
from service.refusals import FieldRefusal, InvalidRequest
from service.routes.designs import DesignId
from service.schemas.controller_answers import DesignMargin, InterpolatedGains, Verdicts
from service.schemas.scaling_answers import Scaling
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere
from service.units import unit_of

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}", tags=["controllers"])

ControllerName = Annotated[str, Path(alias="name", description="Name of the controller", examples=["nf"])]
Point = Annotated[int, Field(description="Flat row-major index of the grid point, from 0", examples=[3])]


class FlightConditionWanted(BaseModel):
    """The flight condition in the grid's own axes."""

    model_config = PARAMETERS

    altitude_m: float = Field(description="Geopotential altitude", examples=[1000.0])
    dynamic_pressure_pa: float | None = Field(default=None, description="When it is the grid's axis", examples=[700.0])
    airspeed_m_s: float | None = Field(default=None, description="When it is the grid's axis")
    mach: float | None = Field(default=None, description="When it is the grid's axis")


@router.get("/verdicts", response_model=Verdicts, responses=problems(404, 409, 503), dependencies=[HEAVY])
def verdicts(request: Request, ident: DesignId, name: ControllerName, designs: DesignsHere) -> Response:
    """Every spec at every point: limit, value, distance and verdict, and where each is worst."""
    envelope = designs.envelope(ident)
    return answer(request, encode(verdicts_document(envelope, controller_of(envelope, name))))


@router.get("/design-margin", response_model=DesignMargin, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def design_margin(request: Request, ident: DesignId, name: ControllerName, designs: DesignsHere) -> Response:
    """By how much all specs of a tab-only controller could be stricter at each point: the design margin."""
    envelope = designs.envelope(ident)
    asked = controller_of(envelope, name).request
    if not isinstance(asked, ClassicalController) or not asked.specs or asked.all_gains_given:
        allowed = "a tab-only controller whose gains are chosen by specs"
        detail = f"the controller {name} has no specs that its gains are chosen by"
        raise InvalidRequest(f"/name: {detail}", FieldRefusal("/name", detail, None, allowed))
    found = design_margins(envelope.study, envelope.plant, asked)
    return answer(request, encode(design_margin_document(envelope, asked, found)))


@router.get("/scaling", response_model=Scaling, responses=problems(404, 409, 503), dependencies=[HEAVY])
def scaling(request: Request, ident: DesignId, name: ControllerName, designs: DesignsHere) -> Response:
    """The gains as powers of dynamic pressure and mass flux, what such a schedule loses, and scaled poles."""
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    measuring_all(controller)
    return answer(request, encode(scaling_document(envelope, controller)))


@router.get("/gains", response_model=InterpolatedGains, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def gains(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[FlightConditionWanted, Query()],
    designs: DesignsHere,
) -> Response:
    """Gains at a flight condition: multilinear in the grid's own axes, clipped to its edges outside."""
    envelope = designs.envelope(ident)
    schedule = schedule_of(envelope, controller_of(envelope, name), designs.provenance(ident))
    coordinates = _coordinates(envelope, wanted)
    found = interpolate(schedule, tuple(coordinates.values()))
    return answer(request, encode(gains_document(schedule, coordinates, found)))


def _coordinates(envelope: DesignedEnvelope, wanted: FlightConditionWanted) -> dict[str, float]:
    """One coordinate an axis of the grid, in the order of the axes.

    Raises
    ------
    InvalidRequest : an axis is missing, or one is given that the grid does not have
    """
    axes = [axis_name(axis) for axis in envelope.plant.grid.axes]
    given = {key: value for key, value in wanted.model_dump().items() if value is not None}
    wrong = [(key, "this axis of the grid is missing") for key in axes if key not in given]
    wrong += [(key, "the grid has no such axis") for key in given if key not in axes]
    if wrong:
        allowed = f"the grid's axes: {', '.join(axes)}"
        fields = [FieldRefusal(f"/{key}", detail, unit_of(key), allowed) for key, detail in wrong]
        raise InvalidRequest(f"{fields[0].pointer}: {fields[0].detail}", *fields)
    return {key: given[key] for key in axes}
