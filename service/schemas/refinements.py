"""Refined tables on the wire: what they must hold between their lines, and what was found."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.design import Gain, Grid, GridOutcomes, Kind
from service.schemas.wire import Answer, Request


class RefinementRequest(Request):
    """What a table must hold between its lines. The envelope is that of the design's grid."""

    fraction: Annotated[float, Field(ge=0.0, le=0.99)] = Field(
        default=0.5, description="Of the slowest pole's decay rate at the corners of each cell: what is to be proved"
    )
    spec_tolerance_percent: Annotated[float, Field(ge=0.1, le=100.0)] = Field(
        default=5.0, description="Largest loss of a spec between the lines, as a part of its limit"
    )
    gain_error_percent: Annotated[float, Field(ge=0.1, le=100.0)] | None = Field(
        default=None,
        description="Largest difference between the gain that is read and the one that would be designed there, as a "
        "part of the gain's largest size; null: any",
    )
    altitude_lines: Annotated[int, Field(ge=2, le=64)] = Field(default=5, description="Lines of altitude at most")
    speed_lines: Annotated[int, Field(ge=2, le=64)] = Field(default=10, description="Lines of speed at most")
    start: Literal["ends", "design"] = Field(
        default="ends", description="From the ends of the envelope alone, or from the design's own lines"
    )
    uniform: bool = Field(default=True, description="Whether the smallest evenly spaced table is looked for too")


class LostSpec(Answer):
    """The largest loss of a figure between the lines, and where it is; negative where it is better everywhere."""

    spec: str
    unit: str
    against: Literal["limit", "design"] = Field(description="The spec's limit, or the point's own design")
    loss_percent: float
    value: float = Field(json_schema_extra={"unit": "see `unit`"})
    reference: float = Field(json_schema_extra={"unit": "see `unit`"})
    coordinates: dict[str, float]


class GainError(Answer):
    """The largest error of a gain between the lines, as a part of its largest size."""

    name: str
    error_percent: float
    coordinates: dict[str, float]


class Step(Answer):
    """A line that came, went or moved, and why."""

    action: Literal["start", "add", "remove", "move", "evenly"]
    cause: Literal["spec", "gain", "proof", "size"] | None
    axis: str | None
    line: float | None = Field(json_schema_extra={"unit": "that of the axis"})
    points: int = Field(description="Of the table after it")
    words: str


class UniformTable(Answer):
    """The smallest evenly spaced table that holds as much; null axes where none that was tried does."""

    axes: dict[str, list[float]] | None
    points: int | None
    tried: int
    words: str


class RemainingCell(Answer):
    """A cell that does not hold all that is wanted."""

    index: list[int]
    reason: str


class Refinement(Answer):
    """The smallest table that was found: proved in every cell, and what it keeps between its lines.

    `request_grid` is the `grid` of a design request that gives this table.
    """

    name: str
    kind: Kind
    holds: bool
    why: str | None = Field(description="Why the search stopped before everything held")
    words: str
    grid: Grid
    request_grid: dict[str, list[float]]
    points: int
    outcomes: GridOutcomes
    gains: list[Gain]
    proved_decay_rate_1_s: float | None
    specs: list[LostSpec]
    gain_errors: list[GainError]
    looked_at: int = Field(description="Points between the lines")
    history: list[Step]
    uniform: UniformTable | None
    remaining: list[RemainingCell]
