"""Questions about manoeuvres of a stored design: what they ask of the actuators, how the surfaces answer."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from service.schemas.manoeuvres import Duration, Manoeuvre
from service.schemas.wire import Request, refusal

Torque = Annotated[float, Field(ge=0.0, le=1e9)]


class HingeFriction(Request):
    """Coulomb friction of a hinge with its drive (seed 7.4.4)."""

    static_n_m: Torque = Field(description="Break-away torque: the largest that holds the surface at rest")
    kinetic_n_m: Torque = Field(description="Torque against the motion; at most the static one")

    @model_validator(mode="after")
    def kinetic_at_most_static(self) -> Self:
        """Refuse friction that is larger in motion than at rest."""
        if self.kinetic_n_m > self.static_n_m:
            raise refusal("larger than the break-away torque", f">= 0 and <= {self.static_n_m:g}", at="/kinetic_n_m")
        return self


class Hinges(Request):
    """Friction of each hinge; null: none."""

    tab: HingeFriction | None = None
    aileron: HingeFriction | None = None


class Freeplay(Request):
    """A dead band in the link between the tab's servo and the tab, elastic beyond it."""

    gap_deg: Annotated[float, Field(ge=0.0, le=60.0)] = Field(description="Whole width of the band")
    stiffness: Annotated[float, Field(gt=0.0, le=1e9)] = Field(
        description="Of the link beyond the band", json_schema_extra={"unit": "N m/rad"}
    )
    damping: Annotated[float, Field(ge=0.0, le=1e9)] = Field(
        default=0.0, description="Of the link while it bears", json_schema_extra={"unit": "N m s/rad"}
    )


class Nonlinear(Request):
    """How the non-linear response is simulated: total hinge moments, cosines, and the limits of the actuators."""

    limits: bool = Field(default=True, description="Whether the actuators are held to the limits of the design")
    friction: Hinges = Field(default_factory=Hinges)
    freeplay: Freeplay | None = Field(default=None, description="Of controllers that command deflections or rates")
    anti_windup_1_s: Annotated[float, Field(ge=0.0, le=1e6)] | None = Field(
        default=None,
        description="Rate at which integrals follow what the actuators can do; 0: none; null: that of the slowest "
        "closed-loop mode",
    )
    tolerance: Annotated[float, Field(ge=1e-9, le=1e-2)] = Field(
        default=1e-6, description="Error that the step is chosen for, relative to the largest change"
    )


class RequirementsRequest(Request):
    """A manoeuvre, flown at every point."""

    manoeuvre: Manoeuvre
    duration_s: Duration = Field(description="How long it is followed", examples=[1.0])
    nonlinear: Nonlinear | None = Field(
        default=None, description="The non-linear response too; null: the exact linear one only"
    )


class ResponseRequest(Request):
    """A manoeuvre, flown at one point."""

    point: Annotated[int, Field(ge=0)] = Field(description="Flat row-major index of the grid point", examples=[3])
    manoeuvre: Manoeuvre
    duration_s: Duration = Field(description="How long it is followed", examples=[1.0])
    samples: Annotated[int, Field(ge=2)] = Field(
        default=501, description="Samples, both ends included; a non-linear response has those of the knots besides"
    )
    nonlinear: Nonlinear | None = Field(default=None, description="The non-linear response; null: the exact linear one")
