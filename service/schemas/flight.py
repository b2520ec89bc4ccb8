"""Where the section flies, on the wire: atmosphere, trim, grid and the reference it must follow."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)

from model.atmosphere import MAX_ALTITUDE, MIN_ALTITUDE
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.wire import Request, refusal

Altitude = Annotated[float, Field(ge=MIN_ALTITUDE, le=MAX_ALTITUDE)]
DynamicPressure = Annotated[float, Field(ge=0.1, le=1e6)]
Airspeed = Annotated[float, Field(ge=0.1, le=1000.0)]
Mach = Annotated[float, Field(ge=1e-3, lt=1.0)]
TemperatureOffset = Annotated[float, Field(ge=-100.0, le=100.0)]
SurfaceAngle = Annotated[float, Field(ge=-60.0, le=60.0)]


def increasing(values: list[float]) -> list[float]:
    """Breakpoints, refused unless each is larger than the one before it."""
    for place, (before, value) in enumerate(pairwise(values), start=1):
        if value <= before:
            raise refusal(
                f"breakpoints must be strictly increasing; {value:g} follows {before:g}",
                f"> {before:g}",
                at=f"/{place}",
            )
    return values


class Span(Request):
    """A range of breakpoints: `count` of them, both ends included."""

    from_: float = Field(alias="from")
    to: float
    count: Annotated[int, Field(ge=2, le=10_000)]
    spacing: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def ends_in_order(self) -> Self:
        """Refuse a range that does not rise, or a logarithmic one that does not start above zero."""
        first, last = self.from_, self.to
        if last <= first:
            raise refusal(f"`to` ({last:g}) must be larger than `from` ({first:g})", f"> {first:g}", at="/to")
        if self.spacing == "log" and first <= 0:
            raise refusal(f"a logarithmic range cannot start at {first:g}", "> 0", at="/from")
        return self


class AltitudeSpan(Span):
    """A range of geopotential altitudes."""

    from_: Altitude = Field(alias="from", json_schema_extra={"unit": "m"})
    to: Altitude = Field(json_schema_extra={"unit": "m"})


class DynamicPressureSpan(Span):
    """A range of dynamic pressures."""

    from_: DynamicPressure = Field(alias="from", json_schema_extra={"unit": "Pa"})
    to: DynamicPressure = Field(json_schema_extra={"unit": "Pa"})


class AirspeedSpan(Span):
    """A range of true airspeeds."""

    from_: Airspeed = Field(alias="from", json_schema_extra={"unit": "m/s"})
    to: Airspeed = Field(json_schema_extra={"unit": "m/s"})


class MachSpan(Span):
    """A range of Mach numbers."""

    from_: Mach = Field(alias="from")
    to: Mach


T = TypeVar("T")
Breakpoints = Annotated[list[T], Field(min_length=1, max_length=10_000), AfterValidator(increasing), Tag("array")]

AltitudeAxis = Annotated[Breakpoints[Altitude] | Annotated[AltitudeSpan, Tag("object")], BY_JSON_TYPE]
DynamicPressureAxis = Annotated[
    Breakpoints[DynamicPressure] | Annotated[DynamicPressureSpan, Tag("object")], BY_JSON_TYPE
]
AirspeedAxis = Annotated[Breakpoints[Airspeed] | Annotated[AirspeedSpan, Tag("object")], BY_JSON_TYPE]
MachAxis = Annotated[Breakpoints[Mach] | Annotated[MachSpan, Tag("object")], BY_JSON_TYPE]
Axis = list[float] | Span

SPEED_AXES = ("dynamic_pressure_pa", "airspeed_m_s", "mach")


class Grid(Request):
    """Flight conditions: altitude by one measure of speed. An axis is a list of breakpoints or a range."""

    altitude_m: AltitudeAxis = Field(description="Geopotential altitude", examples=[[0.0, 3000.0]])
    dynamic_pressure_pa: DynamicPressureAxis | None = Field(
        default=None, description="Second axis as dynamic pressure; give exactly one second axis"
    )
    airspeed_m_s: AirspeedAxis | None = Field(default=None, description="Second axis as true airspeed")
    mach: MachAxis | None = Field(default=None, description="Second axis as Mach number")

    @property
    def speed_axis(self) -> tuple[str, Axis]:
        """Wire name and breakpoints of the second axis."""
        for name in SPEED_AXES:
            axis: Axis | None = getattr(self, name)
            if axis is not None:
                return name, axis
        raise ValueError("a grid has a second axis")  # unreachable after `one_second_axis`

    @model_validator(mode="after")
    def one_second_axis(self) -> Self:
        """Refuse a grid with no second axis, or with two."""
        given = [name for name in SPEED_AXES if getattr(self, name) is not None]
        if len(given) != 1:
            raise refusal(f"a grid has exactly one second axis, not {len(given)}", f"one of {', '.join(SPEED_AXES)}")
        return self

    @model_serializer(mode="wrap")
    def without_the_other_axes(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A grid names the second axis it has, not the ones it does not have."""
        return {name: axis for name, axis in handler(self).items() if axis is not None}


class Atmosphere(Request):
    """International Standard Atmosphere with a temperature offset."""

    temperature_offset_k: TemperatureOffset = Field(
        default=0.0, description="Added to the standard temperature at every altitude; the pressure stays"
    )


class Reference(Request):
    """The manoeuvre actuators are judged on: a step from trim of what follows a reference."""

    kind: Literal["step"] = "step"
    aileron_deg: SurfaceAngle = Field(description="Size of the aileron's step; not zero", examples=[10.0])
    tab_deg: SurfaceAngle = Field(
        default=0.0,
        description="Size of the tab's step, of controllers with the reference `aileron_and_tab`; zero without one",
    )
    rate_limit_deg_s: Annotated[float, Field(ge=1e-3, le=1e6)] | None = Field(
        default=None,
        description="Rate at which the references go there, for what actuators are asked for; null: at once. Settling "
        "time, overshoot and the like are those of a step at once, and so are rates and deflections that gains are "
        "chosen by",
    )
    duration_s: Annotated[float, Field(ge=1e-3, le=1e3)] = Field(description="How long the response is followed")

    @model_validator(mode="after")
    def a_step_at_all(self) -> Self:
        """Refuse a step of nothing: no figure could be taken from its response."""
        if self.aileron_deg == 0.0:
            raise refusal("a step of zero degrees is no reference", ">= -60 and <= 60, not 0", at="/aileron_deg")
        return self
