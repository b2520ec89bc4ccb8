"""A manoeuvre flown over a profile of altitude and speed: the question, and its answer."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from service.schemas.design import Kind
from service.schemas.flight import SPEED_AXES, Airspeed, Altitude, DynamicPressure, Mach
from service.schemas.manoeuvres import Duration, Manoeuvre
from service.schemas.requirement_answers import Limits, LimitsReached
from service.schemas.wire import Answer, Request, refusal

MOST_KNOTS = 10_000
Knots = Field(min_length=1, max_length=MOST_KNOTS)
ControllerTrim = Literal["scheduled", "exact", "held"]


class Profile(Request):
    """Altitude and one measure of speed over time, straight lines between the knots, held at the end."""

    times_s: Annotated[list[Annotated[float, Field(ge=0.0, le=1e3)]], Knots] = Field(
        description="From 0, increasing", examples=[[0.0, 2.0, 5.0]]
    )
    altitude_m: Annotated[list[Altitude], Knots] = Field(
        description="Geopotential altitude", examples=[[0.0, 1000.0, 3000.0]]
    )
    dynamic_pressure_pa: Annotated[list[DynamicPressure], Knots] | None = Field(
        default=None, description="The speed as dynamic pressure; give exactly one measure of it, of the grid or not"
    )
    airspeed_m_s: Annotated[list[Airspeed], Knots] | None = Field(default=None, description="As true airspeed")
    mach: Annotated[list[Mach], Knots] | None = Field(default=None, description="As Mach number")

    @property
    def speed(self) -> tuple[str, list[float]]:
        """Wire name and values of the measure of speed."""
        for name in SPEED_AXES:
            values: list[float] | None = getattr(self, name)
            if values is not None:
                return name, values
        raise ValueError("a profile has a speed")  # unreachable after `one_speed_and_one_value_a_time`

    @model_validator(mode="after")
    def one_speed_and_one_value_a_time(self) -> Self:
        """Refuse no speed or two, series of other lengths, and times that do not increase from 0."""
        given = [name for name in SPEED_AXES if getattr(self, name) is not None]
        if len(given) != 1:
            raise refusal(f"a profile has one measure of speed, not {len(given)}", f"one of {', '.join(SPEED_AXES)}")
        count = len(self.times_s)
        for name in ("altitude_m", *given):
            size = len(getattr(self, name))
            if size != count:
                raise refusal(f"{size} values at {count} times", f"{count} numbers", at=f"/{name}")
        if self.times_s[0] != 0.0 or any(after <= before for before, after in pairwise(self.times_s)):
            raise refusal("the times do not increase from 0", "increasing from 0", at="/times_s")
        return self

    @model_serializer(mode="wrap")
    def without_the_other_speeds(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A profile names the speed it has, not the ones it does not have."""
        return {name: values for name, values in handler(self).items() if values is not None}


class FlightProfileRequest(Request):
    """A manoeuvre, flown over a profile with the gain schedule live."""

    profile: Profile
    manoeuvre: Manoeuvre
    duration_s: Duration = Field(description="How long it is followed", examples=[5.0])
    samples: Annotated[int, Field(ge=2)] = Field(
        default=501, description="Samples, both ends included; those of knots and of crossed grid lines come on top"
    )
    trim: ControllerTrim = Field(
        default="scheduled",
        description="Angles and torques that the controller works from: `scheduled` between the grid points as its "
        "gains are; `exact`, the trim of the section at each instant; `held`, that of the first instant",
    )
    tolerance: Annotated[float, Field(ge=1e-9, le=1e-2)] = Field(
        default=1e-6, description="Error that the step is chosen for, relative to the largest change"
    )
    estimate_error: bool = Field(default=False, description="Fly with half the step too, and say how far that is off")


class FlownConditions(Answer):
    """Air and speed, sample by sample."""

    altitude_m: list[float]
    dynamic_pressure_pa: list[float]
    airspeed_m_s: list[float]
    mach: list[float]
    density_kg_m3: list[float]


class GainCourse(Answer):
    """A gain of the schedule, sample by sample."""

    name: str
    unit: str
    values: list[float] = Field(json_schema_extra={"unit": "see `unit`"})


class ProfileDemand(Answer):
    """Demand on one actuator over the whole flight, trims included; null where the flight has diverged.

    Times at limits are how long each limit would be reached; 0 where there is none.
    """

    peak_torque_n_m: float | None
    rms_torque_n_m: float | None
    holding_torque_n_m: float | None
    peak_rate_deg_s: float | None
    peak_acceleration_deg_s2: float | None
    rms_acceleration_deg_s2: float | None
    peak_deflection_deg: float | None
    peak_power_w: float | None
    rms_power_w: float | None
    energy_out_j: float | None
    energy_back_j: float | None
    time_at_deflection_limit_s: float
    time_at_rate_limit_s: float
    time_at_torque_limit_s: float
    time_at_power_limit_s: float


class ProfileTracking(Answer):
    """How far a surface is from `target`: over the whole flight, and at its end."""

    peak_deg: float
    rms_deg: float
    last_deg: float


class FlownProfile(Answer):
    """A manoeuvre over a profile, from rest at its first instant; signals are totals, their names end in their unit.

    An integral is of the error itself, and the gain of the instant stands behind it. The actuators have no limits here:
    `limits_reached` says where those of the design would be. `target` is where the controller wants the surfaces: its
    trim and the reference. `slowest_pole_1_s` is of the loop frozen at each sample. Where the flight has diverged the
    samples end.
    """

    name: str
    kind: Kind
    profile: Profile
    manoeuvre: Manoeuvre
    duration_s: float
    trim: ControllerTrim
    outcome: Literal["completed", "diverged"]
    reason: str | None
    diverged_at_s: float | None
    left_data_at_s: float | None = Field(description="When the angles left what the hinge-moment data know")
    time_s: list[float]
    condition: FlownConditions
    signals: dict[str, list[float]]
    units: dict[str, str]
    target: dict[str, list[float]]
    gains: list[GainCourse]
    clipped: list[bool] = Field(description="Outside the grid, whose edge the gains are of")
    slowest_pole_1_s: list[float]
    actuators: dict[str, ProfileDemand]
    limits: dict[str, Limits]
    limits_reached: dict[str, LimitsReached]
    tracking: dict[str, ProfileTracking]
    rule: str
    out_of_range: str
    steps: int
    error_estimate: dict[str, float] | None = Field(
        description="Largest difference of each signal when the step is halved; null unless asked for"
    )
