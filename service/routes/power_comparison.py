"""The reference step of a state feedback before and after power is weighed."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.lqr.controller import LqrController
from design.lqr.power_comparison import PowerComparison, power_comparison
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, ReferenceStep
from service.designs import point_with_gains
from service.documentation.openapi import problems, shown_with
from service.limits import check_size
from service.presenters.grid import grid_document
from service.presenters.power_comparison import comparison_document, traces_document
from service.presenters.requirements import reference_document
from service.routes.designs import DesignId
from service.schemas import lqr_studies
from service.schemas.wire import PARAMETERS
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import PowerName, StateFeedback, refused_by_the_domain, state_feedback
from service.wire.answering import answer, encode
from service.wire.refusals import NoDesignAtPoint, StudyNotPossible

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/power-comparison", tags=["controllers"])


class WantedComparison(BaseModel):
    """Where the two steps are wanted over time, and how finely."""

    model_config = PARAMETERS

    point: int | None = Field(
        default=None,
        description="Flat row-major index of a grid point, from 0, whose steps are answered over time",
        examples=[3],
    )
    samples: Annotated[int, Field(ge=2)] = Field(default=501, description="Samples of these, both ends included")


@router.get(
    "",
    response_model=lqr_studies.PowerComparison,
    responses=problems(404, 409, 422, 503),
    dependencies=[ALWAYS_HEAVY],
    openapi_extra=shown_with("lqr_power"),
)
def power_comparison_of_controller(
    request: Request,
    ident: DesignId,
    name: PowerName,
    wanted: Annotated[WantedComparison, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Peak powers and settling with the weights that power is weighed on top of, and with it, at equal settling time.

    Of controllers whose weights follow the rule `power`.
    """
    check_size("/samples", "samples", wanted.samples, "max_response_samples", settings)
    feedback = state_feedback(designs.envelope(ident), name)
    compared = _at_equal_settling(feedback)
    envelope, points = feedback.envelope, int(feedback.envelope.plant.outcomes.ok.sum())
    check_size("/name", "searches: grid points of the comparison", points, "max_tab_only_designs", settings)
    index = None if wanted.point is None else point_with_gains(envelope, feedback.controller, wanted.point)
    with refused_by_the_domain(name):
        found = _compared(feedback, compared, (), 2)
        factors = found.retuning
    traces = None
    if wanted.point is not None and index is not None:
        if not found.outcomes.ok[index]:
            outcome, reason = found.outcomes.codes[index], found.outcomes.reasons[index]
            raise NoDesignAtPoint(
                f"the controller {name}, to settle as without regard to power, has no gains at point {wanted.point}: "
                f"{outcome}; {reason}"
            )
        with refused_by_the_domain(name):
            traces = traces_document(_compared(feedback, compared, index, wanted.samples), wanted.point)
    document = {
        "name": name,
        "kind": feedback.request.kind,
        "form": "balanced" if isinstance(compared.weights, PowerBalancedWeights) else "net_work",
        **reference_document(envelope.study.reference, envelope.study.reference.duration),
        "grid": grid_document(envelope.plant.grid),
        "after_is_flown": compared is feedback.request,
        "weights": _weights(designs.find(ident).request, name),
        **comparison_document(found, factors),
        "traces": traces,
    }
    return answer(request, encode(document))


def _at_equal_settling(feedback: StateFeedback) -> LqrController:
    """The controller itself where its weights keep the settling time, or else the one whose weights do.

    Raises
    ------
    StudyNotPossible : its weights do not weigh power, or it follows no reference
    """
    asked, study = feedback.request, feedback.envelope.study
    weights = asked.weights
    if not isinstance(weights, NetWorkWeights | PowerBalancedWeights):
        raise StudyNotPossible(
            f"the weights of the controller {asked.name} have no regard to power: there is no before and after. "
            "The rule power weighs it"
        )
    if asked.reference == "none":
        raise StudyNotPossible(f"the controller {asked.name} follows no reference: there is no step to compare")
    if isinstance(weights, PowerBalancedWeights):
        return asked if weights.keep_settling else replace(asked, weights=replace(weights, keep_settling=True))
    if weights.retuned_on is not None:
        return asked
    tab = study.reference.tab if asked.reference == "aileron_and_tab" else 0.0
    step = ReferenceStep(study.reference.aileron, study.reference.duration, tab)
    return replace(asked, weights=replace(weights, retuned_on=step))


def _compared(
    feedback: StateFeedback, controller: LqrController, index: tuple[int, ...], samples: int
) -> PowerComparison:
    """Both designs over the grid, or at one point of it."""
    study, plant = feedback.envelope.study, feedback.envelope.plant
    model, outcomes = plant.model.take(index), plant.outcomes.take(index)
    return power_comparison(model, controller, outcomes, study.tab_actuator, study.aileron_actuator, samples)


def _weights(stored: bytes, name: str) -> dict[str, Any]:
    """The weights of the controller of this name in a stored request, without regard to power and with it."""
    (after,) = [wanted["weights"] for wanted in orjson.loads(stored)["controllers"] if wanted["name"] == name]
    return {"before": after["base"], "after": after}
