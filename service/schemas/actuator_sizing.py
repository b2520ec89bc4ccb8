"""Questions about the actuator of a controller: which candidate is enough, and what one can hold (seed 6.3.2)."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from design.actuator_sizing.load_cases import AILERON_LOCKED, GUST_SPEED, SYSTEM_FACTOR
from service.schemas.actuators import Limits
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.manoeuvres import Duration, Manoeuvre
from service.schemas.wire import Request, refusal

ActuatorName = Literal["tab", "aileron"]
Torque = Annotated[float, Field(ge=1e-9, le=1e9)]
NoLoadRate = Annotated[float, Field(ge=1e-3, le=1e9)]
Power = Annotated[float, Field(ge=1e-9, le=1e9)]
RotorInertia = Annotated[float, Field(ge=0.0, le=1e3)]
Ratio = Annotated[float, Field(ge=1e-4, le=1e6)]
Efficiency = Annotated[float, Field(ge=1e-3, le=1.0)]


class RatioRange(Request):
    """Any gear ratio between two."""

    low: Ratio
    high: Ratio

    @model_validator(mode="after")
    def in_order(self) -> Self:
        """Refuse a range that does not rise."""
        if self.high <= self.low:
            raise refusal(
                f"`high` ({self.high:g}) must be larger than `low` ({self.low:g})", f"> {self.low:g}", "/high"
            )
        return self


Ratios = Annotated[list[Ratio], Field(min_length=1, max_length=1000)]
GearRatio = Annotated[
    Annotated[Ratio, Tag("number")] | Annotated[Ratios, Tag("array")] | Annotated[RatioRange, Tag("object")],
    BY_JSON_TYPE,
]


class Candidate(Request):
    """An actuator that can be bought: a motor, by its own numbers, behind a gear. Null is unlimited."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    stall_torque_n_m: Torque = Field(description="Torque at rest")
    no_load_rate_deg_s: NoLoadRate = Field(description="Rate without torque")
    continuous_torque_n_m: Torque | None = Field(default=None, description="RMS torque that it bears for ever")
    power_w: Power | None = None
    rotor_inertia_kg_m2: RotorInertia = Field(default=0.0, description="Of the rotor, before the gear")
    gear_ratio: GearRatio = Field(
        default=1.0, description="Motor over surface: one, a list to choose from, or any between `low` and `high`"
    )
    efficiency: Efficiency = Field(default=1.0, description="Of the gear")


class GroundGust(Request):
    """A gust on the ground, `H = K (rho V^2 / 2) c S` at sea level, c and S aft of the surface's hinge."""

    factor: Annotated[float, Field(gt=0.0, ge=1e-6, le=100.0)] = Field(
        default=AILERON_LOCKED, description="K; of an aileron locked in mid-position unless given (14 CFR 25.415)"
    )
    wind_m_s: Annotated[float, Field(gt=0.0, ge=1e-3, le=300.0)] = Field(
        default=GUST_SPEED, description="V; 65 knots unless given"
    )


class LoadCases(Request):
    """Loads that the actuator holds at rest; null leaves a case out."""

    system_factor: Annotated[float, Field(ge=1.0, le=100.0)] | None = Field(
        default=SYSTEM_FACTOR,
        description="Of the torque that holds the end of the manoeuvre, and of the peak hinge moment during it "
        "(14 CFR 25.395(a))",
    )
    ground_gust: GroundGust | None = Field(default_factory=GroundGust)


class ActuatorSelectionRequest(Request):
    """Candidates for one actuator of a controller, judged on a manoeuvre and on loads."""

    actuator: ActuatorName
    candidates: Annotated[list[Candidate], Field(fail_fast=True, min_length=1, max_length=10_000)]
    manoeuvre: Manoeuvre | None = Field(default=None, description="Null: the reference of the design")
    duration_s: Duration | None = Field(
        default=None, description="How long it is followed; null: as long as the design's reference"
    )
    load_cases: LoadCases = Field(default_factory=LoadCases)
    feed_back_inertia: bool = Field(
        default=False,
        description="Whether the design is made again with the rotor of each candidate on the surface, and the "
        "candidate judged on that",
    )

    @model_validator(mode="after")
    def names_differ(self) -> Self:
        """Refuse two candidates of one name."""
        seen: set[str] = set()
        for place, candidate in enumerate(self.candidates):
            if candidate.name in seen:
                raise refusal("a candidate of this name comes before", "another name", f"/candidates/{place}/name")
            seen.add(candidate.name)
        return self


class InverseSizingRequest(Request):
    """An actuator with limits, and which of a controller's it is to be."""

    actuator: ActuatorName
    limits: Limits

    @model_validator(mode="after")
    def limits_at_all(self) -> Self:
        """Refuse an actuator that can do everything."""
        if all(limit is None for _, limit in self.limits):
            raise refusal("without a limit everything can be held", "one limit at least that is not null", "/limits")
        return self
