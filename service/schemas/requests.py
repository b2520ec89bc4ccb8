"""The requests: a design, the linear models alone, hinge moments alone."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, model_validator

from service.schemas.actuators import Actuators, TabActuator
from service.schemas.aerodynamics import Aerodynamics, ThinAerofoil
from service.schemas.controller_requests import Classical, Controller, Lqr, NegativeFeedback, PositiveFeedback
from service.schemas.flight import Atmosphere, Grid, Reference, SurfaceAngle
from service.schemas.grid_values import GridAxes, fields_on_grid
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


def no_delay_of_torques(tab: TabActuator) -> None:
    """Refuse state feedback through a tab actuator with a delay."""
    if tab.delay_s > 0.0:
        raise refusal(
            "this version designs state feedback (lqr) without delay",
            "0 with an lqr controller, >= 0 and <= 1 without one",
            at="/actuators/tab/delay_s",
        )


class DesignRequest(LinearModelsRequest):
    """A design: section, air, grid, actuators, the manoeuvre to be judged on, and the controllers wanted."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    actuators: Actuators
    reference: Reference
    controllers: Annotated[list[Controller], Field(min_length=1), AfterValidator(names_unique)]
    spec_pack: AnySpecPack = Field(
        default="default",
        description="Values every controller is judged on, by the name of a shipped pack (`GET /v1/spec-packs`) or as "
        "a pack of one's own; it steers no design",
    )

    @model_validator(mode="after")
    def tab_that_takes_the_commands(self) -> Self:
        """Refuse an ideal tab actuator where gains that are chosen would have no bound, and a delay of torques."""
        for controller in self.controllers:
            if isinstance(controller, Lqr):
                no_delay_of_torques(self.actuators.tab)
            elif controller.tab_command == "rate":
                rate_loop_for(controller, self.actuators.tab)
            else:
                servo_for(controller, self.actuators.tab)
        return self

    @model_validator(mode="after")
    def values_on_the_grid(self) -> Self:
        """Every value that varies over the grid in its simplest form; refused unless it fits the grid."""
        axes = GridAxes.of(self.grid)
        changed: dict[str, Any] = {
            "controllers": [
                wanted.on_grid(axes, f"/controllers/{place}/{wanted.kind}") if isinstance(wanted, Classical) else wanted
                for place, wanted in enumerate(self.controllers)
            ]
        }
        if isinstance(self.spec_pack, SpecPack):
            specs = fields_on_grid(self.spec_pack.specs, axes, "/spec_pack/object/specs")
            changed["spec_pack"] = self.spec_pack.model_copy(update={"specs": specs})
        return self.model_copy(update=changed)


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
