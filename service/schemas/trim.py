"""Trim on the wire: angles to hold, or torques from which angles follow."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, Tag, model_serializer, model_validator

from service.schemas.flight import SurfaceAngle
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.wire import Request, refusal


class HeldTorque(Request):
    """Instead of an angle: the angle follows from the torque that an actuator holds."""

    surface: Literal["tab", "aileron"] = Field(description="Whose actuator")
    torque_n_m: Annotated[float, Field(ge=-1e9, le=1e9)] = Field(description="Its torque, trailing edge up positive")


AngleGiven = Annotated[SurfaceAngle, Tag("number")]
TorqueHeld = Annotated[HeldTorque, Tag("object")]
TabRule = Annotated[Literal["zero_aileron_torque", "zero_tab_torque", "least_torque"], Tag("string")]
AileronRule = Annotated[Literal["zero_aileron_torque"], Tag("string")]
SolvedAngleLimit = Annotated[float, Field(gt=0.0, le=90.0)]


class Trim(Request):
    """Steady angles that the linear models are about."""

    alpha_deg: Annotated[float, Field(ge=-30.0, le=30.0)] = Field(default=0.0, description="Angle of attack")
    aileron_deg: Annotated[AngleGiven | AileronRule | TorqueHeld, BY_JSON_TYPE] = Field(
        default=0.0,
        description="Aileron deflection, trailing edge up; or `zero_aileron_torque`: the angle at which it floats; "
        "or the torque that is held",
    )
    tab_deg: Annotated[AngleGiven | TabRule | TorqueHeld, BY_JSON_TYPE] = Field(
        default=0.0,
        description="Tab deflection relative to the aileron, trailing edge up; or `zero_aileron_torque`: the tab "
        "angle at which the aileron holds itself; or `zero_tab_torque`: at which the tab does; or `least_torque`: at "
        "which the sum of the squares of both torques is least; or the torque that is held",
    )
    aileron_limit_deg: SolvedAngleLimit | None = Field(
        default=None, description="A solved aileron angle is sought within plus and minus this; without it, 90"
    )
    tab_limit_deg: SolvedAngleLimit | None = Field(
        default=None, description="A solved tab angle is sought within plus and minus this; without it, 90"
    )

    @model_validator(mode="after")
    def an_equation_for_each_angle(self) -> Self:
        """Refuse two angles to be found from the torque of one surface, and a least torque with a free aileron."""
        aileron = decided_by(self.aileron_deg)
        if aileron is None:
            return self
        if self.tab_deg == "least_torque":
            raise refusal("least torque is sought at a given aileron angle", "another trim of the tab", at="/tab_deg")
        if decided_by(self.tab_deg) == aileron:
            raise refusal(
                f"the torque of the {aileron} cannot decide both the tab's and the aileron's angle",
                "an angle, or the torque of the other surface",
                at="/tab_deg",
            )
        return self

    @model_serializer(mode="wrap")
    def without_limits_not_given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A trim names the limits it was given."""
        return {name: value for name, value in handler(self).items() if value is not None}


def decided_by(wanted: float | str | HeldTorque) -> str | None:
    """Surface whose torque decides an angle; None where the angle is given or least torque decides."""
    if isinstance(wanted, HeldTorque):
        return wanted.surface
    return {"zero_aileron_torque": "aileron", "zero_tab_torque": "tab"}.get(str(wanted))
