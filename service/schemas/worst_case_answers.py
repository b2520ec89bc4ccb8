"""Answers about the worst that references of bounded amplitude and rate can do."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.wire import Answer


class AdmissibleReference(Answer):
    """A reference may do whatever stays within these, for ever, from trim."""

    amplitude_deg: float
    rate_limit_deg_s: float | None = Field(description="null: it may jump")


class AdmissibleReferences(Answer):
    """References are independent of each other."""

    aileron: AdmissibleReference
    tab: AdmissibleReference | None = Field(description="null unless the controller follows one")


class WorstPeak(Answer):
    """The bounds at the point where the upper one is largest."""

    upper: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    lower: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    point: int | None
    reason: str | None


class SignalPeaks(Answer):
    """Largest magnitude of a signal, trim included, over all admissible references: at most `upper`, surely `lower`.

    No admissible reference exceeds `upper`; some come as near to `lower` as one likes. The two differ by some parts in
    ten thousand. Where the loop is not stable, `lower` is the trim.
    """

    unit: str
    upper: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    lower: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    reasons: GridReasons = Field(description="Why `upper` is null")
    envelope: WorstPeak
    limit: float | None = Field(
        json_schema_extra={"unit": "see `unit`"},
        description="Of the actuator, where the controller has it; null: none, or not of this signal",
    )
    limit_outcome: Literal["kept", "exceeded", "undecided"] | None = Field(
        description="At every point: `kept` by all admissible references, `exceeded` by one at a point, or the bounds "
        "lie on both sides; null without a limit or a design"
    )


class WorstCase(Answer):
    """Guaranteed peaks of the linear loop over all references within an amplitude and a rate, at every point.

    Errors (`da_error_deg`) are the reference less the change of its angle. Transport delays are approximants of twelve
    states each; where a delayed command reaches a signal at once and the reference may jump, the approximant may double
    the bound.
    """

    name: str
    kind: Kind
    references: AdmissibleReferences
    delays: Literal["none", "approximants"]
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    signals: dict[str, SignalPeaks]


class RecordedManoeuvre(Answer):
    """A recorded series from trim, straight lines between its samples; two equal times are a jump."""

    kind: Literal["recorded"]
    times_s: list[float]
    aileron_deg: list[float]
    tab_deg: list[float] | None = Field(description="null unless the controller follows a reference of the tab")


class WorstReference(Answer):
    """A reference that makes a signal as large as any admissible one can, at a point, and what flying it reaches.

    `manoeuvre` is one that can be flown as it stands; the peak is reached as it ends. `reached` is the largest
    magnitude of the signal in the exact response of the loop that `delays` speaks of.
    """

    name: str
    point: int
    signal: str
    unit: str
    references: AdmissibleReferences
    delays: Literal["none", "approximants"]
    manoeuvre: RecordedManoeuvre
    reason: str | None = Field(description="Why the manoeuvre cannot be flown as it stands; null where it can")
    reached: float = Field(json_schema_extra={"unit": "see `unit`"})
    reached_at_s: float
    upper: float = Field(json_schema_extra={"unit": "see `unit`"})
    lower: float = Field(json_schema_extra={"unit": "see `unit`"})
