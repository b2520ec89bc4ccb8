"""The requests: a design, the linear models alone, hinge moments alone."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from service.schemas.actuators import Actuators
from service.schemas.aerodynamics import Aerodynamics, ThinAerofoil
from service.schemas.controller_requests import Classical, Controller
from service.schemas.flight import Atmosphere, Grid, Reference, SurfaceAngle
from service.schemas.section import Geometry, HingeGeometry, Inertia
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


class DesignRequest(LinearModelsRequest):
    """A design: section, air, grid, actuators, the manoeuvre to be judged on, and the controllers wanted."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    actuators: Actuators
    reference: Reference
    controllers: Annotated[list[Controller], Field(min_length=1), AfterValidator(names_unique)]
    spec_pack: Literal["default", "limit_speed"] = Field(
        default="default", description="Named set of values every controller is judged on; it steers no design"
    )

    @model_validator(mode="after")
    def servo_for_deflection_commands(self) -> Self:
        """Refuse a deflection command to a tab that has no deflection servo."""
        if any(isinstance(c, Classical) for c in self.controllers):
            for field in ("servo_bandwidth_hz", "servo_damping_ratio"):
                if getattr(self.actuators.tab, field) is None:
                    raise refusal(
                        "a controller commands a tab deflection, so the tab's deflection servo must be given",
                        "a number, not null",
                        at=f"/actuators/tab/{field}",
                    )
        return self


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
