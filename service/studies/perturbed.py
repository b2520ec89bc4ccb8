"""Perturbed plants: which parameters are off and how far, and the cases that follow, flown some at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from design.specs import Spec
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.flown_figures import Flight
from schedules.perturbations import (
    MOST_CORNER_PARAMETERS,
    MOST_DRAWS,
    Cases,
    Parameter,
    Uncertainty,
    corner_cases,
    drawn_cases,
)
from schedules.perturbations import PARAMETERS as UNCERTAIN
from schedules.perturbed_cases import FlownCases, case_blocks, fly_cases
from schedules.robust_performance import assemble, flight_of
from service.presenters.robust_performance import Drawn, robust_performance_document
from service.settings import Settings
from service.studies.flown_away import Flown, carried_controller, check_loops, flown, flown_specs
from service.wire.refusals import FieldRefusal, InvalidRequest

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


@dataclass(frozen=True, eq=False)
class Perturbed:
    """The cases that are wanted of a controller.

    Attributes
    ----------
    specs, left_out : what is judged, and what cannot be
    """

    wanted: WantedPerformance
    envelope: DesignedEnvelope
    controller: DesignedController
    uncertainties: tuple[Uncertainty, ...]
    cases: Cases
    specs: tuple[Spec, ...]
    left_out: tuple[Spec, ...]
    flight: Flight

    @property
    def blocks(self) -> tuple[tuple[int, int], ...]:
        """Cases that are best flown together: the first, and the one behind the last."""
        return case_blocks(self.controller, self.cases)

    def fly(self, start: int, stop: int) -> FlownCases:
        """Some of the cases.

        Raises
        ------
        InvalidRequest : the model refuses the numbers
        """
        study, plant = self.envelope.study, self.envelope.plant
        return flown(lambda: fly_cases(study, plant, self.controller, self.cases, self.flight, start, stop))

    def document(self, done: Sequence[FlownCases]) -> dict[str, Any]:
        """The answer, from pieces that are all the cases together.

        Raises
        ------
        InvalidRequest : the model refuses the numbers
        """
        study, plant, wanted = self.envelope.study, self.envelope.plant, self.wanted
        found = flown(lambda: assemble(study, plant, self.controller, self.cases, self.specs, self.flight, done))
        drawn = wanted.method == "monte_carlo"
        how = Drawn(wanted.seed, wanted.distribution, wanted.confidence) if drawn else None
        of = (self.envelope, self.controller, found, self.uncertainties, how, self.left_out)
        return robust_performance_document(*of, wanted.margins)


def perturbed(envelope: DesignedEnvelope, name: str, wanted: WantedPerformance, settings: Settings) -> Perturbed:
    """The cases that a question about the controller of this name asks for.

    Raises
    ------
    NotFound, StudyNotPossible : there is no such controller, or it cannot be flown away from its design
    InvalidRequest : a parameter of the question would be ignored, none is off, or corners have too many
    LimitExceeded
    """
    _check_method(wanted)
    controller = carried_controller(envelope, name)
    uncertainties = _uncertainties(wanted)
    drawn = wanted.method == "monte_carlo"
    count = wanted.draws if drawn else 2 ** len(uncertainties)
    points = int(controller.outcomes.ok.sum())
    check_loops("/draws" if drawn else "/method", "grid points times plants", points * count, controller, settings)
    specs, left_out = flown_specs(envelope, controller, wanted.specs)
    cases = flown(lambda: drawn_cases(uncertainties, count, wanted.seed) if drawn else corner_cases(uncertainties))
    flight = flown(lambda: flight_of(envelope.study, controller, specs, margins=wanted.margins))
    return Perturbed(wanted, envelope, controller, uncertainties, cases, specs, left_out, flight)


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
