"""Requests of chapter 2: statics, eigenvalue studies and similarity, each on the plant part of a design request."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, model_validator

from service.schemas.aerodynamics import ThinAerofoil
from service.schemas.flight import (
    SPEED_AXES,
    Airspeed,
    Altitude,
    DynamicPressure,
    Mach,
    Span,
    SurfaceAngle,
    TemperatureOffset,
)
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.requests import LinearModelsRequest
from service.schemas.section import Length
from service.schemas.wire import Request, refusal


class DeflectionSpan(Span):
    """A range of deflections."""

    from_: SurfaceAngle = Field(alias="from", json_schema_extra={"unit": "deg"})
    to: SurfaceAngle = Field(json_schema_extra={"unit": "deg"})


Deflections = Annotated[list[SurfaceAngle], Field(min_length=1, max_length=10_000), Tag("array")]
DeflectionAxis = Annotated[Deflections | Annotated[DeflectionSpan, Tag("object")], BY_JSON_TYPE]
FULL_RANGE = DeflectionSpan.model_validate({"from": -20.0, "to": 20.0, "count": 17})


class DeflectionPlane(Request):
    """Deflections that a map is drawn over."""

    aileron_deg: DeflectionAxis = Field(default=FULL_RANGE, description="Aileron angles, trailing edge up")
    tab_deg: DeflectionAxis = Field(default=FULL_RANGE, description="Tab angles, relative to the aileron")


class TabLimits(Request):
    """What the tab's actuator can hold; null is unlimited."""

    deflection_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    torque_n_m: Annotated[float, Field(gt=0.0, le=1e9)] | None = None


class AileronLimits(Request):
    """How far the aileron goes; null is unlimited."""

    deflection_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None


class StaticLimits(Request):
    """Limits of what is reachable, and of the angles that are solved for."""

    tab: TabLimits = Field(default_factory=TabLimits)
    aileron: AileronLimits = Field(default_factory=AileronLimits)


class SteadyStateMapRequest(LinearModelsRequest):
    """Hinge moments and equilibria over the deflections, at every grid point (seed 2.5)."""

    deflections: DeflectionPlane = Field(default_factory=DeflectionPlane)
    limits: StaticLimits = Field(default_factory=StaticLimits)


Quantity = Literal["tab_deg", "aileron_deg", "airspeed_m_s", "density_kg_m3", "alpha_deg", "tab_chord_ratio"]
#: Range of each named quantity, ends included.
RANGES: dict[str, tuple[float, float]] = {
    "tab_deg": (-60.0, 60.0),
    "aileron_deg": (-60.0, 60.0),
    "airspeed_m_s": (0.1, 1000.0),
    "density_kg_m3": (1e-6, 100.0),
    "alpha_deg": (-30.0, 30.0),
    "tab_chord_ratio": (0.001, 0.999),
}


class ValueSpan(Span):
    """A range of values of what is varied."""

    from_: float = Field(alias="from", json_schema_extra={"unit": "that of what is varied"})
    to: float = Field(json_schema_extra={"unit": "that of what is varied"})


Values = Annotated[list[float], Field(min_length=1, max_length=10_000), Tag("array")]


class Vary(Request):
    """One quantity by name, or one numeric field of this request by its JSON pointer, and the values it takes."""

    quantity: Quantity | None = Field(
        default=None,
        description="What varies: an angle of the trim, the airspeed in the same air, the density at the same airspeed "
        "and temperature, or the tab's chord as a fraction of the aileron's",
        examples=["airspeed_m_s"],
    )
    pointer: Annotated[str, Field(pattern=r"^(/[^/]+)+$", max_length=200)] | None = Field(
        default=None,
        description="JSON pointer (RFC 6901) to the number in this request that varies, such as "
        "`/inertia/tab/inertia_kg_m2`",
    )
    values: Annotated[Values | Annotated[ValueSpan, Tag("object")], BY_JSON_TYPE] = Field(
        description="Values in the field's own unit, in the order in which eigenvalues are followed",
        json_schema_extra={"unit": "that of what is varied"},
    )

    @model_validator(mode="after")
    def one_thing(self) -> Self:
        """Refuse to vary nothing, or two things at once."""
        if (self.quantity is None) == (self.pointer is None):
            raise refusal("one thing is varied: name a quantity or give a pointer", "one of quantity, pointer")
        return self

    @model_validator(mode="after")
    def values_in_range(self) -> Self:
        """Refuse a value that the named quantity does not take."""
        if self.quantity is None:
            return self
        lowest, highest = RANGES[self.quantity]
        ends: dict[str, float] = (
            {"/values/from": self.values.from_, "/values/to": self.values.to}
            if isinstance(self.values, Span)
            else {f"/values/{place}": value for place, value in enumerate(self.values)}
        )
        for at, value in ends.items():
            if not lowest <= value <= highest:
                raise refusal(f"{self.quantity} cannot be {value:g}", f">= {lowest:g} and <= {highest:g}", at=at)
        return self


class EigenvalueSweepRequest(LinearModelsRequest):
    """Eigenvalues over one varied quantity, at every grid point (seed 2.4)."""

    vary: Vary

    @model_validator(mode="after")
    def hinges_of_the_theory(self) -> Self:
        """Refuse another tab chord for hinge moments that hold for one pair of hinges."""
        if self.vary.quantity == "tab_chord_ratio" and not isinstance(self.aerodynamics, ThinAerofoil):
            raise refusal(
                "given or tabulated hinge moments hold for one tab chord",
                "another quantity, or the source thin_aerofoil",
                at="/vary/quantity",
            )
        return self


class MeasuredServoTab(Request):
    """A servo-tab as it was identified, on what, and in what air; exactly one measure of speed."""

    omega_n_rad_s: Annotated[float, Field(gt=0.0, le=1e6)] = Field(description="Natural frequency")
    damping_ratio: Annotated[float, Field(gt=0.0, le=100.0)] = Field(description="Damping ratio")
    dc_gain: Annotated[float, Field(ge=-1e3, le=1e3)] = Field(description="Steady aileron angle per tab angle")
    chord_m: Length = Field(description="Wing chord")
    span_m: Length = Field(description="Span of aileron and tab")
    inertia_kg_m2: Annotated[float, Field(ge=1e-10, le=1e6)] = Field(
        description="Moment of inertia of aileron and tab together about the aileron's hinge"
    )
    altitude_m: Altitude = Field(default=0.0, description="Geopotential altitude")
    temperature_offset_k: TemperatureOffset = Field(default=0.0, description="Added to the standard temperature")
    dynamic_pressure_pa: DynamicPressure | None = None
    airspeed_m_s: Airspeed | None = None
    mach: Mach | None = None

    @property
    def speed(self) -> tuple[str, float]:
        """Wire name and value of the measure of speed."""
        given: dict[str, Any] = {name: getattr(self, name) for name in SPEED_AXES}
        name, value = next((name, value) for name, value in given.items() if value is not None)
        return name, float(value)

    @model_validator(mode="after")
    def one_speed(self) -> Self:
        """Refuse no speed, or two of them."""
        given = [name for name in SPEED_AXES if getattr(self, name) is not None]
        if len(given) != 1:
            raise refusal(
                f"the measurement has exactly one measure of speed, not {len(given)}", f"one of {', '.join(SPEED_AXES)}"
            )
        return self


class SimilarityRequest(LinearModelsRequest):
    """What the dynamics depend on over the grid, and a measured servo-tab scaled to this section (seed 4.4, 7.6)."""

    tolerance: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=0.1, description="Accepted relative error of the servo-tab's damping ratio and natural frequency"
    )
    time_unit: Literal["chords", "servo_period"] = Field(
        default="chords",
        description="Unit of time of the non-dimensional model: `chords` of air, c/V; or `servo_period`, 1/omega_n",
    )
    measured: MeasuredServoTab | None = Field(
        default=None, description="A servo-tab of the same shape, measured, to be scaled to this section and grid"
    )
