"""Questions about the weights of a stored design's state feedback: which ones meet specs, and what speed costs."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from design.lqr.weight_request import Minimised
from service.schemas.grid_values import OverGrid, Values, Varying
from service.schemas.specs import SettlingTime, SettlingTimes
from service.schemas.wire import Request, refusal

#: Limits that are searched against are parts of what is judged, so none of them is zero.
Damping = Annotated[float, Field(ge=0.01, le=0.99)]
Overshoot = Annotated[float, Field(ge=0.01, le=100.0)]
Deflection = Annotated[float, Field(ge=1e-3, le=180.0)]
Rate = Annotated[float, Field(ge=1e-3, le=1e6)]
Torque = Annotated[float, Field(ge=1e-9, le=1e9)]
Power = Annotated[float, Field(ge=1e-9, le=1e9)]

WeightName = Literal[
    "aileron_deg",
    "aileron_rate_deg_s",
    "tab_deg",
    "tab_rate_deg_s",
    "aileron_integral_deg_s",
    "tab_integral_deg_s",
    "tab_torque_n_m",
    "aileron_torque_n_m",
]


class SoughtDampings(OverGrid):
    """Damping ratios over the grid."""

    values: Values[Damping]


class SoughtOvershoots(OverGrid):
    """Overshoots over the grid."""

    values: Values[Overshoot] = Field(json_schema_extra={"unit": "%"})


class SoughtDeflections(OverGrid):
    """Deflections of a surface over the grid."""

    values: Values[Deflection] = Field(json_schema_extra={"unit": "deg"})


class SoughtRates(OverGrid):
    """Rates of a surface over the grid."""

    values: Values[Rate] = Field(json_schema_extra={"unit": "deg/s"})


class SoughtTorques(OverGrid):
    """Torques of an actuator over the grid."""

    values: Values[Torque] = Field(json_schema_extra={"unit": "N m"})


class SoughtPowers(OverGrid):
    """Powers of an actuator over the grid."""

    values: Values[Power] = Field(json_schema_extra={"unit": "W"})


class SoughtSpecs(Request):
    """What weights are to meet: those specs that a search can steer by, each a number or over the grid.

    What is asked of actuators is a peak of the total after the reference step. Beside the actuator's own limit the
    stricter of both counts.
    """

    settling_time_s_max: Varying[SettlingTime, SettlingTimes] | None = Field(
        default=None, description="Time after which the step response stays within 2 % of its change"
    )
    overshoot_percent_max: Varying[Overshoot, SoughtOvershoots] | None = None
    damping_ratio_min: Varying[Damping, SoughtDampings] | None = Field(
        default=None, description="Damping ratio of every closed-loop mode"
    )
    tab_deflection_deg_max: Varying[Deflection, SoughtDeflections] | None = None
    tab_rate_deg_s_max: Varying[Rate, SoughtRates] | None = None
    tab_torque_n_m_max: Varying[Torque, SoughtTorques] | None = None
    tab_power_w_max: Varying[Power, SoughtPowers] | None = None
    aileron_deflection_deg_max: Varying[Deflection, SoughtDeflections] | None = None
    aileron_rate_deg_s_max: Varying[Rate, SoughtRates] | None = None
    aileron_torque_n_m_max: Varying[Torque, SoughtTorques] | None = None
    aileron_power_w_max: Varying[Power, SoughtPowers] | None = None

    @model_validator(mode="after")
    def something_asked(self) -> Self:
        """Refuse a search that asks nothing of the response."""
        if not any(
            getattr(self, name) for name in ("settling_time_s_max", "overshoot_percent_max", "damping_ratio_min")
        ):
            raise refusal(
                "nothing is asked of the response: least power is that of no response at all",
                "settling_time_s_max, overshoot_percent_max or damping_ratio_min",
            )
        return self


class SearchRequest(Request):
    """What every search of weights is asked."""

    specs: SoughtSpecs
    actuator_limits: bool = Field(
        default=True, description="Whether the limits of the design's actuators are to be met too"
    )
    searched: Annotated[list[WeightName], Field(min_length=1, max_length=8)] | None = Field(
        default=None,
        description="The weights that are searched; the others stay those of the controller. null: all but "
        "`tab_torque_n_m`, relative to which they are sought: a cost multiplied as a whole has the same optimum",
    )
    span: Annotated[float, Field(ge=1.1, le=1e4)] = Field(
        default=100.0, description="Each weight is sought between the controller's over this and times this"
    )
    points: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1, max_length=10_000)] | None = Field(
        default=None,
        description="Flat row-major indices of the grid points that are looked at; null: every point",
        examples=[[3]],
    )


class WeightSearchRequest(SearchRequest):
    """Weights that meet specs with the least power of the actuators."""

    minimised: Minimised = Field(
        default="total_rms_power",
        description="What is made least, of the reference step, trim included: the RMS powers of both actuators "
        "together [W]; the peak of the aileron actuator's torque [N m]; the peak of both powers' magnitudes together "
        "[W]; the work that both do while they drive [J]",
    )
    common: bool = Field(
        default=False,
        description="One set of weights for all points, the worst of which needs least; else each its own",
    )
    exchange: bool = Field(
        default=True,
        description="Every point goes on from the weights of the others that suit it best: better ones are missed "
        "less often, but what a point gets depends on which others are asked for. Without effect on one set for all",
    )


class TradeOffRequest(SearchRequest):
    """What speed costs: the least peak torque of the aileron's actuator for each of some settling times."""

    settling_times_s: Annotated[list[SettlingTime], Field(min_length=2, max_length=10_000)] | None = Field(
        default=None,
        description="Settling times that are allowed, up to `settling_time_s_max`; null: `count` of them from the "
        "fastest that can be reached at the point, evenly in proportion",
    )
    count: Annotated[int, Field(ge=2)] = Field(
        default=8, description="How many settling times; without effect where they are given"
    )

    @model_validator(mode="after")
    def a_slowest(self) -> Self:
        """Refuse a trade-off without an end."""
        if self.specs.settling_time_s_max is None:
            detail = "this field is required: the slowest that is looked at"
            raise refusal(detail, ">= 0.0001 and <= 1000", at="/specs/settling_time_s_max")
        return self
