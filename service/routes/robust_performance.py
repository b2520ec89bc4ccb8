"""Gains of a controller flown on plants that are off: corners and random draws (seed Tables 8.4, 8.6)."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from schedules.perturbations import MOST_CORNER_PARAMETERS, MOST_DRAWS, Parameter, Uncertainty
from schedules.perturbations import PARAMETERS as UNCERTAIN
from schedules.robust_performance import corners, monte_carlo
from service.answering import answer, encode
from service.openapi import problems
from service.presenters.robust_performance import Drawn, robust_performance_document
from service.refusals import FieldRefusal, InvalidRequest
from service.routes.controllers import ControllerName
from service.routes.cross_flight import Flown, carried_controller, check_loops, flown, flown_specs
from service.routes.designs import DesignId
from service.schemas.robustness_answers import RobustPerformance
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/robust-performance", tags=["controllers"])

#: Largest relative change of a parameter; 0 leaves it as it is.
Change = Annotated[float, Field(ge=0.0, le=99.0)]


class WantedPerformance(Flown):
    """Which parameters are off, how far, and how plants are made of them."""

    method: Literal["corners", "monte_carlo"] = Field(
        default="corners",
        description=f"All combinations of the largest changes, of at most {MOST_CORNER_PARAMETERS} parameters; or "
        "random draws",
        examples=["monte_carlo"],
    )
    hinge_moment_percent: Change = Field(
        default=20.0,
        description="Largest change of each of the four hinge-moment derivatives by the deflections, at the trim",
        examples=[20.0],
    )
    inertia_percent: Change = Field(
        default=10.0, description="Of each surface's inertia about its own centre of mass", examples=[10.0]
    )
    mass_percent: Change = Field(default=0.0, description="Of each surface's mass")
    cg_offset_percent: Change = Field(default=0.0, description="Of how far each centre of mass is behind its hinge")
    C_Ha_da_percent: Change | None = Field(default=None, description="Of this one, instead of that of all derivatives")
    C_Ha_dt_percent: Change | None = Field(default=None, description="Of this one, instead of that of all derivatives")
    C_Ht_da_percent: Change | None = Field(default=None, description="Of this one, instead of that of all derivatives")
    C_Ht_dt_percent: Change | None = Field(default=None, description="Of this one, instead of that of all derivatives")
    aileron_inertia_percent: Change | None = Field(default=None, description="Of this one, instead of that of both")
    tab_inertia_percent: Change | None = Field(default=None, description="Of this one, instead of that of both")
    aileron_mass_percent: Change | None = Field(default=None, description="Of this one, instead of that of both")
    tab_mass_percent: Change | None = Field(default=None, description="Of this one, instead of that of both")
    aileron_cg_offset_percent: Change | None = Field(default=None, description="Of this one, instead of that of both")
    tab_cg_offset_percent: Change | None = Field(default=None, description="Of this one, instead of that of both")
    draws: Annotated[int, Field(ge=1, le=MOST_DRAWS)] = Field(
        default=200, description="How many plants are drawn, the same ones at every point", examples=[100]
    )
    seed: Annotated[int, Field(ge=0, le=2**53 - 1)] = Field(
        default=0,
        description="Of the draws: the same seed draws the same plants, and fewer draws are the first of more",
    )
    distribution: Literal["uniform", "normal"] = Field(
        default="uniform", description="Within the largest change: uniform, or normal about the model and cut off there"
    )
    deviation_ratio: Annotated[float, Field(ge=0.01, le=10.0)] = Field(
        default=0.5, description="Standard deviation of the normal distribution over the largest change"
    )
    confidence: Annotated[float, Field(ge=0.5, le=0.9999)] = Field(
        default=0.95, description="How sure `at_least` is of what the draws say about all plants that could be drawn"
    )


@router.get("", response_model=RobustPerformance, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def robust_performance_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedPerformance, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Gains as designed for the nominal plant, flown on plants whose derivatives and inertias are off.

    Each plant is linearised afresh about the nominal trim, and is the same at every point. Of each figure: its worst
    over the cases with the plant that gives it, percentiles, and the parameter that it depends on most.
    """
    _check_method(wanted)
    envelope = designs.envelope(ident)
    controller = carried_controller(envelope, name)
    uncertainties = _uncertainties(wanted)
    drawn = wanted.method == "monte_carlo"
    cases = wanted.draws if drawn else 2 ** len(uncertainties)
    points = int(controller.outcomes.ok.sum())
    check_loops("/draws" if drawn else "/method", "grid points times plants", points * cases, controller, settings)
    specs, left_out = flown_specs(envelope, controller, wanted.specs)
    of = (envelope.study, envelope.plant, controller, uncertainties)
    if drawn:
        found = flown(lambda: monte_carlo(*of, wanted.draws, wanted.seed, specs, margins=wanted.margins))
    else:
        found = flown(lambda: corners(*of, specs, margins=wanted.margins))
    how = Drawn(wanted.seed, wanted.distribution, wanted.confidence) if drawn else None
    document = robust_performance_document(envelope, controller, found, uncertainties, how, left_out, wanted.margins)
    return answer(request, encode(document))


def _check_method(wanted: WantedPerformance) -> None:
    """Refuse what would be ignored: how corners are drawn, and how wide a uniform distribution deviates.

    Raises
    ------
    InvalidRequest
    """
    given, of_draws = wanted.model_fields_set, ("draws", "seed", "distribution", "deviation_ratio", "confidence")
    idle: dict[str, str] = {}
    if wanted.method == "corners":
        idle = dict.fromkeys(of_draws, "corners are not drawn")
    elif wanted.distribution == "uniform":
        idle = {"deviation_ratio": "a uniform distribution has no other width than the largest change"}
    allowed = dict.fromkeys(of_draws, "method=monte_carlo") | {"deviation_ratio": "distribution=normal"}
    fields = [FieldRefusal(f"/{name}", why, None, allowed[name]) for name, why in idle.items() if name in given]
    if fields:
        raise InvalidRequest(f"{fields[0].pointer}: {fields[0].detail}", *fields)


def _uncertainties(wanted: WantedPerformance) -> tuple[Uncertainty, ...]:
    """The parameters that are off.

    Raises
    ------
    InvalidRequest : there is none, or corners have too many
    """
    normal = wanted.method == "monte_carlo" and wanted.distribution == "normal"
    found = tuple(
        Uncertainty(parameter, change, wanted.deviation_ratio * change if normal else None)
        for parameter in UNCERTAIN
        if (change := _change(wanted, parameter)) > 0.0
    )
    if not found:
        detail = "no parameter is off"
        allowed = "a change above 0 of one parameter at least"
        raise InvalidRequest(detail, FieldRefusal("/hinge_moment_percent", detail, "%", allowed))
    if wanted.method == "corners" and len(found) > MOST_CORNER_PARAMETERS:
        detail = f"{len(found)} parameters have too many corners"
        allowed = f"monte_carlo, or at most {MOST_CORNER_PARAMETERS} parameters with a change above 0"
        raise InvalidRequest(f"/method: {detail}", FieldRefusal("/method", detail, None, allowed))
    return found


def _change(wanted: WantedPerformance, parameter: Parameter) -> float:
    """Largest relative change of a parameter: its own, or that of its group."""
    own: float | None = getattr(wanted, f"{parameter}_percent")
    group = "hinge_moment" if parameter.startswith("C_") else parameter.partition("_")[2]
    of_group: float = getattr(wanted, f"{group}_percent")
    return (of_group if own is None else own) / 100.0
