"""Answers that set two controllers, of one design or of two, side by side."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, JsonValue
from pydantic.config import JsonDict

from service.schemas.design import Kind, OutcomeCode
from service.schemas.wire import Answer

_SEE_UNIT: JsonDict = {"unit": "see `unit`"}


class ComparedDesign(Answer):
    """A design and its controller."""

    id: str
    name: str
    controller: str
    kind: Kind
    points: int = Field(description="Points of its grid")


class RequestDifference(Answer):
    """One place where the requests differ; a value that one request does not have is null."""

    pointer: str
    value: JsonValue
    other: JsonValue
    only_in: Literal["this", "other"] | None


class SideBySide(Answer):
    """A gain or a figure of both; null where it does not exist, or is unlimited."""

    name: str
    unit: str
    value: float | None = Field(json_schema_extra=_SEE_UNIT)
    other: float | None = Field(json_schema_extra=_SEE_UNIT)
    difference: float | None = Field(json_schema_extra=_SEE_UNIT, description="`other` less `value`")


class CarriedPoint(Answer):
    """A controller with its own actuators on the other design's plant; null where one of them has nothing there."""

    nu_gap: float | None = Field(
        description="Between the loop designed and the same gains on the other plant, the plants weighed with the "
        "controller: 0 to 1, 1 also where no controller could tell that both are stable"
    )
    stability_margin: float | None = Field(description="Generic margin b of the loop designed, at most 0.7071")
    held_by_margin: bool | None = Field(
        description="Whether the nu-gap is less than the margin, which proves it stable"
    )
    stable: bool | None = Field(description="Whether the poles of that very loop are stable")


class ComparedPoint(Answer):
    """A point of both grids."""

    coordinates: dict[str, float]
    point: int
    other_point: int
    outcome: OutcomeCode
    other_outcome: OutcomeCode
    gains: list[SideBySide]
    figures: list[SideBySide]
    on_other_plant: CarriedPoint = Field(description="This controller on the plant of the other design")
    other_on_this_plant: CarriedPoint = Field(description="The other controller on the plant of this design")


class CarriedSummary(Answer):
    """A controller on the plant of the other design over the common points; with a `reason`, it is not flown there."""

    reason: str | None
    points_flown: int
    points_stable: int
    points_held_by_margin: int
    largest_nu_gap: float | None
    largest_nu_gap_point: int | None = Field(description="Of this design's grid")


class Comparison(Answer):
    """Two controllers side by side at the points that their grids have in common."""

    this: ComparedDesign
    other: ComparedDesign
    request_differences: list[RequestDifference]
    request_differences_in_all: int = Field(description="More than are listed, where there are very many")
    reason: str | None = Field(description="Why there are no common points; null where there are")
    on_other_plant: CarriedSummary
    other_on_this_plant: CarriedSummary
    points: list[ComparedPoint]
