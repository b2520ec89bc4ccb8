"""One controller of a design: step response, actuator requirements, verdicts, gains between the grid points."""

from __future__ import annotations

from typing import Annotated, NoReturn

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from design.classical.controller import ClassicalController
from schedules.designed import DesignedEnvelope
from schedules.interpolate import interpolate
from schedules.rules import Interpolation, OutOfRange, ScheduleRules
from schedules.run import design_margins
from schedules.schedule import GainSchedule
from schedules.schedule_of import schedule_of
from schedules.wire_names import axis_name
from service.designs import controller_of, measuring_all
from service.documentation.openapi import problems
from service.presenters.design_margin import design_margin_document
from service.presenters.figures import figures_document
from service.presenters.gains import gains_document
from service.presenters.scaling import scaling_document
from service.presenters.verdicts import verdicts_document
from service.routes.designs import DesignId
from service.schemas.controller_answers import DesignMargin, Figures, InterpolatedGains, Verdicts
from service.schemas.scaling_answers import Scaling
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, InvalidRequest
from service.wire.units import unit_of

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
    rule: Interpolation = Field(default="multilinear", description="Between the points")
    out_of_range: OutOfRange = Field(
        default="clip",
        description="Outside them: the nearest edge's gains; the same, marked, of a controller that holds its last "
        "ones; or none (422)",
    )


@router.get("/verdicts", response_model=Verdicts, responses=problems(404, 409, 503), dependencies=[HEAVY])
def verdicts(request: Request, ident: DesignId, name: ControllerName, designs: DesignsHere) -> Response:
    """Every spec at every point: limit, value, distance and verdict, and where each is worst."""
    envelope = designs.envelope(ident)
    return answer(request, encode(verdicts_document(envelope, controller_of(envelope, name))))


@router.get("/figures", response_model=Figures, responses=problems(404, 409, 503), dependencies=[HEAVY])
def figures(request: Request, ident: DesignId, name: ControllerName, designs: DesignsHere) -> Response:
    """Closed-loop poles, damping, margins and figures of the step at every grid point."""
    envelope = designs.envelope(ident)
    return answer(request, encode(figures_document(envelope, controller_of(envelope, name))))


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
    """Gains at a flight condition, by a rule between the grid's points and one outside them."""
    envelope = designs.envelope(ident)
    rules = ScheduleRules(wanted.rule, wanted.out_of_range)
    schedule = schedule_of(envelope, controller_of(envelope, name), designs.provenance(ident), rules)
    coordinates = _coordinates(envelope, wanted)
    found = interpolate(schedule, tuple(coordinates.values()))
    if found.refused:
        _refuse_outside(schedule, coordinates)
    return answer(request, encode(gains_document(schedule, coordinates, found)))


def _coordinates(envelope: DesignedEnvelope, wanted: FlightConditionWanted) -> dict[str, float]:
    """One coordinate an axis of the grid, in the order of the axes.

    Raises
    ------
    InvalidRequest : an axis is missing, or one is given that the grid does not have
    """
    axes = [axis_name(axis) for axis in envelope.plant.grid.axes]
    asked = wanted.model_dump(exclude={"rule", "out_of_range"})
    given = {key: value for key, value in asked.items() if value is not None}
    wrong = [(key, "this axis of the grid is missing") for key in axes if key not in given]
    wrong += [(key, "the grid has no such axis") for key in given if key not in axes]
    if wrong:
        allowed = f"the grid's axes: {', '.join(axes)}"
        fields = [FieldRefusal(f"/{key}", detail, unit_of(key), allowed) for key, detail in wrong]
        raise InvalidRequest(f"{fields[0].pointer}: {fields[0].detail}", *fields)
    return {key: given[key] for key in axes}


def _refuse_outside(schedule: GainSchedule, coordinates: dict[str, float]) -> NoReturn:
    """Refuse coordinates beyond the breakpoints, each by its name.

    Raises
    ------
    InvalidRequest
    """
    fields = []
    for axis, (key, value) in zip(schedule.axes, coordinates.items(), strict=True):
        low, high = axis.values[0], axis.values[-1]
        if not low <= value <= high:
            detail = f"{value:g} is outside the grid, and there the schedule has no gains"
            fields.append(FieldRefusal(f"/{key}", detail, axis.unit, f">= {low!r} and <= {high!r}"))
    raise InvalidRequest(f"{fields[0].pointer}: {fields[0].detail}", *fields)
