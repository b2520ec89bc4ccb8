"""The requests: a design, the linear models alone, hinge moments alone."""

from __future__ import annotations

from math import ceil
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, model_validator

from design.sampling import Sampling
from service.schemas.actuators import Actuators, TabActuator
from service.schemas.aerodynamics import Aerodynamics, ThinAerofoil
from service.schemas.controller_requests import Classical, Controller, NegativeFeedback, PositiveFeedback
from service.schemas.flight import Atmosphere, Grid, Reference, SurfaceAngle
from service.schemas.grid_values import GridAxes, fields_on_grid
from service.schemas.lqr_requests import Lqr
from service.schemas.section import Geometry, HingeGeometry, Inertia
from service.schemas.specs import AnySpecPack, SpecPack
from service.schemas.trim import Trim
from service.schemas.wire import Request, refusal


def names_unique(controllers: list[Controller]) -> list[Controller]:
    """Controllers, refused when two have one name."""
    seen: set[str] = set()
    for place, controller in enumerate(controllers):
        if controller.name in seen:
            raise refusal(f"the name {controller.name} is taken by a controller before", "a new name", f"/{place}/name")
        seen.add(controller.name)
    return controllers


class LinearModelsRequest(Request):
    """The grid part of a design: what the section is and where it flies."""

    geometry: Geometry
    inertia: Inertia
    aerodynamics: Aerodynamics
    atmosphere: Atmosphere = Field(default_factory=Atmosphere)
    trim: Trim = Field(default_factory=Trim)
    grid: Grid


def servo_for(controller: NegativeFeedback | PositiveFeedback, tab: TabActuator) -> None:
    """Refuse a deflection command to an ideal servo, but for gains that are given and a rate that is filtered."""
    if tab.servo_bandwidth_hz is not None:
        return
    why = None
    if not controller.all_gains_given:
        why = (
            "gains are chosen against the servo's lag, so the servo must have a bandwidth unless all the gains "
            f"{', '.join(controller.gain_names)} are given"
        )
    elif isinstance(controller, NegativeFeedback) and controller.rate_filter_hz is None:
        why = "with an ideal servo the tab's rate moves a measured aileron rate at once, so the rate must be filtered"
    if why is not None:
        raise refusal(
            f"controller {controller.name} commands a tab deflection: {why}",
            "a number; or null where all gains are given and, for negative_feedback, a rate_filter_hz",
            at="/actuators/tab/servo_bandwidth_hz",
        )


def rate_loop_for(controller: Classical, tab: TabActuator) -> None:
    """Refuse an ideal rate loop without delay where the gain around it is to be chosen: it would have no bound."""
    given = controller.gains is not None and controller.gains.K_theta is not None
    if tab.rate_loop_bandwidth_hz is None and tab.delay_s == 0.0 and not given:
        raise refusal(
            f"controller {controller.name} commands a tab rate: around an ideal rate loop without delay nothing bounds "
            "K_theta, so it cannot be chosen",
            "a number; or null where K_theta is given or delay_s is above 0",
            at="/actuators/tab/rate_loop_bandwidth_hz",
        )


def step_longer_than_delays(controller: Lqr, actuators: Actuators, step: Reference) -> None:
    """Refuse a response that would end before the surfaces hear of the step."""
    delay = max(actuators.tab.delay_s, actuators.aileron.delay_s)
    if controller.sample_time_s is not None and controller.computational_delay_s is not None:
        delay += Sampling(controller.sample_time_s, controller.computational_delay_s).mean_delay
    if 0.0 < delay >= step.duration_s:
        raise refusal(
            f"controller {controller.name} answers {delay:g} s late: the response would be over by then",
            f"> {delay:g} and <= 1000",
            at="/reference/duration_s",
        )


def step_at_once_for_samples(controller: Lqr, step: Reference) -> None:
    """Refuse a limited rate of the reference where a sampled state feedback is to follow it."""
    if controller.sample_time_s is not None and step.rate_limit_deg_s is not None:
        raise refusal(
            f"controller {controller.name} is a sampled state feedback, which is followed through a step at once",
            "null; or no state feedback with a sample time",
            at="/reference/rate_limit_deg_s",
        )


#: Most states that commands on their way from a digital controller to the surfaces may take.
MOST_UNDER_WAY = 48
#: Most samples of a step that is followed from sample to sample.
MOST_SAMPLES = 20_000


def samples_within_reach(controller: Controller, actuators: Actuators, step: Reference, at: str) -> None:
    """Refuse a sample time so short that delays or the step have more samples than can be followed."""
    sample, computation = controller.sample_time_s, controller.computational_delay_s
    if sample is None or computation is None:
        return
    moved = (actuators.tab, actuators.aileron) if isinstance(controller, Lqr) else (actuators.tab,)
    # A command is under way for whole samples; a state feedback remembers it besides.
    under_way = sum(ceil((actuator.delay_s + computation) / sample - 1e-9) for actuator in moved)
    most = MOST_UNDER_WAY // len(moved)
    if under_way > most:
        raise refusal(
            f"{under_way} commands of {controller.name} would be on their way at a time",
            f"a sample time at which at most {most} commands are: delay and computation of each actuator, in samples",
            at=f"{at}/sample_time_s",
        )
    if isinstance(controller, Lqr) and step.duration_s / sample > MOST_SAMPLES:
        raise refusal(
            f"the step is followed for {step.duration_s:g} s, {step.duration_s / sample:.0f} samples",
            f">= {step.duration_s / MOST_SAMPLES:g} and <= 1, or null",
            at=f"{at}/sample_time_s",
        )


class DesignRequest(LinearModelsRequest):
    """A design: section, air, grid, actuators, the manoeuvre to be judged on, and the controllers wanted."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    actuators: Actuators
    reference: Reference
    controllers: Annotated[list[Controller], Field(fail_fast=True, min_length=1), AfterValidator(names_unique)]
    spec_pack: AnySpecPack = Field(
        default="default",
        description="Values every controller is judged on, by the name of a shipped pack (`GET /v1/spec-packs`) or as "
        "a pack of one's own; it steers no design",
    )

    @model_validator(mode="after")
    def actuators_that_take_the_commands(self) -> Self:
        """Refuse an ideal tab actuator where gains that are chosen would have no bound, and delays beyond the step."""
        for place, controller in enumerate(self.controllers):
            at = f"/controllers/{place}/{controller.kind}"
            samples_within_reach(controller, self.actuators, self.reference, at)
            if isinstance(controller, Lqr):
                step_longer_than_delays(controller, self.actuators, self.reference)
                step_at_once_for_samples(controller, self.reference)
            elif controller.tab_command == "rate":
                rate_loop_for(controller, self.actuators.tab)
            else:
                servo_for(controller, self.actuators.tab)
        return self

    @model_validator(mode="after")
    def a_tab_step_that_is_followed(self) -> Self:
        """Refuse a step of the tab that no controller would follow."""
        follows = any(isinstance(wanted, Lqr) and wanted.reference == "aileron_and_tab" for wanted in self.controllers)
        if self.reference.tab_deg != 0.0 and not follows:
            raise refusal(
                "no controller follows a tab reference",
                "0 unless a controller has the reference aileron_and_tab",
                at="/reference/tab_deg",
            )
        return self

    @model_validator(mode="after")
    def in_simplest_form(self) -> Self:
        """Values over the grid and weights of regulators in their simplest form; refused unless they fit."""
        axes = GridAxes.of(self.grid)
        controllers = [
            self._in_place(wanted, axes, f"/controllers/{place}/{wanted.kind}")
            for place, wanted in enumerate(self.controllers)
        ]
        changed: dict[str, Any] = {"controllers": controllers}
        if isinstance(self.spec_pack, SpecPack):
            specs = fields_on_grid(self.spec_pack.specs, axes, "/spec_pack/object/specs")
            changed["spec_pack"] = self.spec_pack.model_copy(update={"specs": specs})
        return self.model_copy(update=changed)

    def _in_place(self, wanted: Controller, axes: GridAxes, at: str) -> Controller:
        if isinstance(wanted, Lqr):
            return wanted.on_plant(self.actuators, self.aerodynamics.damping, at)
        return wanted.on_grid(axes, at)


#: How near to the leading edge and a hinge, where it is infinite, the pressure may be asked for: fraction of the chord.
HINGE_CLEARANCE = 1e-9
ChordPlace = Annotated[float, Field(ge=HINGE_CLEARANCE, le=1.0)]


class HingeState(Request):
    """Angles at which hinge moments are wanted."""

    alpha_deg: Annotated[float, Field(ge=-30.0, le=30.0)]
    aileron_deg: SurfaceAngle
    tab_deg: SurfaceAngle


class About(Request):
    """Angles about which derivatives are wanted, and a table is expanded."""

    alpha_deg: Annotated[float, Field(ge=-30.0, le=30.0)] = 0.0
    aileron_deg: SurfaceAngle = 0.0
    tab_deg: SurfaceAngle = 0.0


class HingeMomentsRequest(Request):
    """Hinge-moment coefficients of a section, no air and no grid."""

    geometry: HingeGeometry
    aerodynamics: Aerodynamics
    states: Annotated[list[HingeState], Field(min_length=1, max_length=1000)]
    chordwise: Annotated[list[ChordPlace], Field(min_length=1, max_length=1000)] | None = Field(
        default=None,
        description="Places along the chord, as fractions, where the pressure difference is wanted; only "
        "thin-aerofoil theory knows it",
    )
    about: About = Field(default_factory=About, description="Where the derivatives are wanted")

    @model_validator(mode="after")
    def no_mach_number(self) -> Self:
        """Refuse a correction that needs a Mach number, which this request does not have."""
        if self.aerodynamics.compressibility != "none":
            raise refusal(
                "hinge moments alone are incompressible: there is no Mach number to correct them for",
                "only none",
                at="/aerodynamics/compressibility",
            )
        return self

    @model_validator(mode="after")
    def pressure_away_from_hinges(self) -> Self:
        """Refuse the pressure at a hinge, where thin-aerofoil theory makes it infinite; other sources have none."""
        if self.chordwise is not None and not isinstance(self.aerodynamics, ThinAerofoil):
            raise refusal("only thin-aerofoil theory knows the pressure along the chord", "null", at="/chordwise")
        hinges = (self.geometry.aileron_hinge, self.geometry.tab_hinge)
        for place, x in enumerate(self.chordwise or ()):
            if any(abs(x - hinge) < HINGE_CLEARANCE for hinge in hinges):
                raise refusal(
                    f"the pressure difference is infinite at the hinge at {x:g}",
                    f"<= 1, at least {HINGE_CLEARANCE:g} away from the leading edge and both hinges",
                    at=f"/chordwise/{place}",
                )
        return self
