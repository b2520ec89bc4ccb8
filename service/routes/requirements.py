"""Manoeuvres of one controller of a design: responses, and what they ask of the actuators."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.delay.step_response import delayed_step_response
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.sampled_response import sampled_step_response
from design.manoeuvre import Manoeuvre
from design.response.manoeuvre_response import manoeuvre_response
from design.simulation.plant import NonlinearPlant
from design.simulation.request import SimulationRequest
from design.simulation.response import NonlinearResponse
from design.simulation.simulate import simulate
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.requirements import requirements, simulated
from schedules.study import Reference
from service.designs import continuous_loop, controller_of, point_with_gains
from service.documentation.openapi import BODY, problems
from service.limits import check_manoeuvre, check_size, check_steps
from service.presenters.requirements import flown_requirements_document, reference_document, requirements_document
from service.presenters.response import response_document, sampled_response_document
from service.presenters.simulation import simulation_document
from service.routes.controllers import ControllerName, Point
from service.routes.designs import DesignId
from service.schemas import requirement_answers as answers
from service.schemas.requirement_requests import Nonlinear, RequirementsRequest, ResponseRequest
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import ALWAYS_HEAVY, HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.to_domain.manoeuvre_of import manoeuvre_of, simulation_of
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute

#: Samples of the simulations that requirements are taken of.
SIMULATED_SAMPLES = 501

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}", tags=["controllers"], route_class=JsonRoute)


class WantedResponse(BaseModel):
    """Which response is wanted, and how finely."""

    model_config = PARAMETERS

    point: Point
    kind: Literal["linear", "nonlinear"] = Field(
        default="linear",
        description="Exact and linear; or simulated, with total hinge moments and the actuators' limits",
    )
    duration_s: Annotated[float, Field(ge=1e-3, le=1e3)] | None = Field(
        default=None, description="How long it is followed; without it, as long as the design's reference"
    )
    samples: Annotated[int, Field(ge=2)] = Field(default=501, description="Samples, both ends included")


@router.get("/response", response_model=answers.Response, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def response(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedResponse, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """The response to the design's reference step at one point: every signal, trim values included."""
    return answer(request, encode(response_at(designs.envelope(ident), name, wanted, settings)))


def response_at(envelope: DesignedEnvelope, name: str, wanted: WantedResponse, settings: Settings) -> dict[str, Any]:
    """The response of a controller to the design's reference at a point.

    Raises
    ------
    Refusal : there is no such controller or point, or it asks for more samples or steps than are done
    """
    check_size("/samples", "samples", wanted.samples, "max_response_samples", settings)
    controller = controller_of(envelope, name)
    index = point_with_gains(envelope, controller, wanted.point)
    reference = envelope.study.reference
    duration = wanted.duration_s or reference.duration
    loop = controller.loop.take(index)
    document = {"name": name, "point": wanted.point, "kind": wanted.kind} | reference_document(reference, duration)
    if wanted.kind == "linear":
        return document | _reference_response(loop, reference, duration, wanted.samples) | {"simulation": None}
    flown = continuous_loop(controller)
    manoeuvre = reference.manoeuvre(flown.references)
    asked = simulation_of(Nonlinear(), envelope.study, duration, wanted.samples)
    found = _simulated_at(envelope, controller, index, manoeuvre, asked, settings)
    return document | response_document(found) | {"simulation": simulation_document(found, flown.inputs)}


@router.get(
    "/actuator-requirements",
    response_model=answers.Requirements,
    responses=problems(404, 409, 503),
    dependencies=[HEAVY],
)
def actuator_requirements(request: Request, ident: DesignId, name: ControllerName, designs: DesignsHere) -> Response:
    """What the reference step asks of each actuator: torque, rate, power and energy over the grid, and the worst."""
    envelope = designs.envelope(ident)
    return answer(request, encode(requirements_document(envelope, controller_of(envelope, name))))


@router.post(
    "/response", response_model=answers.FlownResponse, responses=problems(*BODY, 404, 409, 503), dependencies=[HEAVY]
)
def response_to_manoeuvre(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    body: ResponseRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """The response to any manoeuvre at one point: every signal, trim values included."""
    check_size("/samples", "samples", body.samples, "max_response_samples", settings)
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    index = point_with_gains(envelope, controller, body.point)
    loop = continuous_loop(controller).take(index)
    manoeuvre = manoeuvre_of(body.manoeuvre, loop.references)
    document: dict[str, Any] = {"name": name, "point": body.point, "manoeuvre": body.manoeuvre.normalised()}
    if body.nonlinear is None:
        check_manoeuvre(manoeuvre, body.duration_s, 1, settings)
        linear = manoeuvre_response(loop, manoeuvre, body.duration_s, body.samples)
        said = {"kind": "linear", **response_document(linear), "simulation": None}
    else:
        asked = simulation_of(body.nonlinear, envelope.study, body.duration_s, body.samples)
        found = _simulated_at(envelope, controller, index, manoeuvre, asked, settings)
        said = {"kind": "nonlinear", **response_document(found), "simulation": simulation_document(found, loop.inputs)}
    return answer(request, encode(document | said))


@router.post(
    "/actuator-requirements",
    response_model=answers.FlownRequirements,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def requirements_of_manoeuvre(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    body: RequirementsRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """What any manoeuvre asks of each actuator over the grid, the envelope's worst, and torque and speed together."""
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    loop = continuous_loop(controller)
    manoeuvre = manoeuvre_of(body.manoeuvre, loop.references)
    check_manoeuvre(manoeuvre, body.duration_s, int(controller.outcomes.ok.sum()), settings)
    nonlinear = None
    if body.nonlinear is not None:
        asked = simulation_of(body.nonlinear, envelope.study, body.duration_s, SIMULATED_SAMPLES)
        check_steps("/duration_s", loop.take(controller.outcomes.ok), manoeuvre, asked, settings)
        with refused_by_the_domain(name):
            nonlinear = simulated(envelope.plant, controller, manoeuvre, asked)
    linear = requirements(envelope.study, controller, manoeuvre, body.duration_s)
    document = flown_requirements_document(envelope, controller, body.manoeuvre, body.duration_s, linear, nonlinear)
    return answer(request, encode(document))


def _simulated_at(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    index: tuple[int, ...],
    manoeuvre: Manoeuvre,
    asked: SimulationRequest,
    settings: Settings,
) -> NonlinearResponse:
    """The non-linear response at one point."""
    loop, plant = continuous_loop(controller).take(index), envelope.plant
    check_steps("/duration_s", loop, manoeuvre, asked, settings)
    with refused_by_the_domain(controller.request.name):
        at = NonlinearPlant.of(
            plant.system, plant.grid.condition.take(index), plant.trim.take(index), plant.model.take(index)
        )
        return simulate(at, loop, manoeuvre, asked)


def _reference_response(loop: Loop | CodedLoop, reference: Reference, duration: float, samples: int) -> dict[str, Any]:
    """The response to the design's own reference, of a loop at one point."""
    step = reference.sizes(loop.references)
    if isinstance(loop, CodedLoop):
        return sampled_response_document(sampled_step_response(loop, step, duration), samples)
    if reference.rate_limit is None:
        return response_document(delayed_step_response(loop, step, duration, samples))
    return response_document(manoeuvre_response(loop, reference.manoeuvre(loop.references), duration, samples))
