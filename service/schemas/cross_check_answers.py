"""Answers of the second opinion: figures of a design beside the same by python-control."""

from __future__ import annotations

from typing import Literal

from pydantic import Field
from pydantic.config import JsonDict

from service.schemas.design import Kind, OutcomeCode
from service.schemas.point import Complex
from service.schemas.wire import Answer

_SEE_UNIT: JsonDict = {"unit": "see `unit`"}
_SEE_DIFFERENCE: JsonDict = {"unit": "see `difference_unit`"}
_NONE = "Null where there is none: the point of the design says why"


class CheckedNumber(Answer):
    """A figure and the same by python-control; where both do not exist they agree."""

    name: str
    unit: str
    value: float | None = Field(json_schema_extra=_SEE_UNIT, description=_NONE)
    python_control: float | None = Field(json_schema_extra=_SEE_UNIT)
    difference: float | None = Field(
        json_schema_extra=_SEE_DIFFERENCE, description="Of gains as a part of them; null where only one is a number"
    )
    difference_unit: str
    tolerance: float = Field(json_schema_extra=_SEE_DIFFERENCE)
    agrees: bool


class CheckedPole(Answer):
    """A closed-loop pole and the one of python-control that is its own."""

    name: str
    unit: str
    value: Complex
    python_control: Complex
    difference: float = Field(description="As a part of the pole")
    difference_unit: str
    tolerance: float
    agrees: bool


class LeftOut(Answer):
    """What is not compared, or not all of it, and why."""

    figure: str
    reason: str


class CheckedController(Answer):
    """One controller at one point; without gains there it has no figures, and `agrees` is null."""

    name: str
    kind: Kind
    outcome: OutcomeCode
    reason: str | None
    agrees: bool | None
    gains: list[CheckedNumber] = Field(description="Of state feedback: by control.lqr or control.dlqr")
    poles: list[CheckedPole]
    margins: dict[str, list[CheckedNumber]] = Field(
        description="By the actuator input that the loop is cut at: by control.stability_margins"
    )
    step: list[CheckedNumber] = Field(description="Of the reference step: by control.step_info")
    left_out: list[LeftOut]


class CheckedPoint(Answer):
    """All controllers asked for at one point."""

    point: int
    coordinates: dict[str, float]
    controllers: list[CheckedController]


class LargestDifference(Answer):
    """Of one figure over all points and controllers, with its place; null where only one of the two is a number."""

    figure: Literal["gains", "poles", "margins", "step"]
    name: str
    difference: float | None = Field(json_schema_extra=_SEE_DIFFERENCE)
    difference_unit: str
    tolerance: float = Field(json_schema_extra=_SEE_DIFFERENCE)
    agrees: bool
    controller: str
    point: int
    cut: str | None


class CrossCheck(Answer):
    """Figures of a design by python-control beside its own; differences are told, tolerances are stated."""

    python_control: str = Field(description="Its version")
    agrees: bool = Field(description="Whether everything that was compared is within its tolerance")
    points: list[CheckedPoint]
    largest_differences: list[LargestDifference]
