"""Gains of classical controllers that a request gives, instead of leaving them to be chosen."""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import AfterValidator, Field

from service.schemas.grid_values import OverGrid, Values, Varying
from service.schemas.wire import Request

#: Every gain is at least zero: the law holds the signs.
GivenGain = Annotated[float, Field(ge=0.0, le=1e6)]


class Factors(OverGrid):
    """Gains without a unit over the grid."""

    values: Values[GivenGain]


class RateGains(OverGrid):
    """Gains on a rate over the grid."""

    values: Values[GivenGain] = Field(json_schema_extra={"unit": "s"})


class IntegralGains(OverGrid):
    """Gains that make a rate of an angle, over the grid."""

    values: Values[GivenGain] = Field(json_schema_extra={"unit": "1/s"})


class Gains(Request):
    """Gains that are given, each a number or a value that varies over the grid; those that are null are chosen."""

    K_theta: Varying[GivenGain, IntegralGains] | None = Field(
        default=None,
        description="Gain of the inner tab loop, of controllers that command a tab rate",
        json_schema_extra={"unit": "1/s"},
    )


class NegativeFeedbackGains(Gains):
    """Gains of negative feedback that are given, each a number or a value that varies over the grid."""

    K_d: Varying[GivenGain, RateGains] | None = Field(
        default=None, description="Gain on the aileron's rate", json_schema_extra={"unit": "s"}
    )
    K_p: Varying[GivenGain, Factors] | None = Field(default=None, description="Gain on the aileron's angle")
    K_i: Varying[GivenGain, IntegralGains] | None = Field(
        default=None, description="Gain on the integral of the aileron's error", json_schema_extra={"unit": "1/s"}
    )


class PositiveFeedbackGains(Gains):
    """Gains of positive feedback that are given, each a number or a value that varies over the grid."""

    K_f: Varying[GivenGain, Factors] | None = Field(
        default=None, description="Regenerative gain on the aileron's angle"
    )
    K_i: Varying[GivenGain, IntegralGains] | None = Field(
        default=None, description="Gain on the integral of the aileron's error", json_schema_extra={"unit": "1/s"}
    )


Given = TypeVar("Given", bound=Gains)


def null_when_none_is_given(gains: Given | None) -> Given | None:
    """The gains, or None when all of them are to be chosen: both are the same request."""
    return gains if gains is not None and any(value is not None for _, value in gains) else None


NoneGivenIsNull = AfterValidator(null_when_none_is_given)
