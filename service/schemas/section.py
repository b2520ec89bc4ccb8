"""The section on the wire: geometry and the two bodies."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from service.schemas.wire import Request, refusal

Length = Annotated[float, Field(ge=1e-3, le=100.0)]
HingePosition = Annotated[float, Field(gt=0.0, lt=1.0)]


class HingeGeometry(Request):
    """The two hinges, as fractions of the wing chord; the tab hinge lies behind the aileron hinge."""

    aileron_hinge: HingePosition = Field(description="Aileron hinge, fraction of the wing chord", examples=[0.72])
    tab_hinge: HingePosition = Field(description="Tab hinge, fraction of the wing chord", examples=[0.96])

    @model_validator(mode="after")
    def tab_hinge_behind_aileron_hinge(self) -> Self:
        """Refuse a tab that would not be hinged on the aileron."""
        if self.tab_hinge <= self.aileron_hinge:
            raise refusal(
                f"the tab hinge ({self.tab_hinge:g}) must lie behind the aileron hinge ({self.aileron_hinge:g})",
                f"> {self.aileron_hinge:g} and < 1",
                at="/tab_hinge",
            )
        return self


class Geometry(HingeGeometry):
    """Wing section with an aileron and, hinged on the aileron, a trailing-edge tab."""

    chord_m: Length = Field(description="Wing chord", examples=[0.6])
    span_m: Length = Field(description="Span of aileron and tab", examples=[0.8])


class Body(Request):
    """A rigid surface: the aileron without its tab, or the tab."""

    mass_kg: Annotated[float, Field(ge=1e-6, le=1e5)] = Field(description="Mass")
    cg_offset_m: Annotated[float, Field(ge=-10.0, le=10.0)] = Field(
        description="Centre of mass aft of the body's own hinge; negative when mass-balanced ahead of it"
    )
    inertia_kg_m2: Annotated[float, Field(ge=1e-10, le=1e6)] = Field(
        description="Moment of inertia about the body's own centre of mass"
    )


class Inertia(Request):
    """The two bodies of the section."""

    aileron: Body
    tab: Body
