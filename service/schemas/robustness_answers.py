"""Answers about gains that are flown away from their design: at other points, and on plants that are off."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.requirement_answers import ReferenceStep
from service.schemas.wire import Answer

FlownOutcome = Literal["ok", "unstable", "unproved", "no_step", "not_settled", "no_design", "outside_model"]
#: ``[design][flown]``, both flat row-major points.
PairNumbers = list[list[float | None]]
PairFlags = list[list[bool | None]]
GridCounts = list[list[int | None]]


class FlownSpec(Answer):
    """A spec that held loops must meet; one that is known of a loop at its design only is left out and says so."""

    spec: str
    limit: float | None = Field(
        json_schema_extra={"unit": "see `unit`"}, description="Null where it varies over the grid: that of the point"
    )
    unit: str
    source: Literal["request", "spec_pack", "limits"]
    judged: bool
    reason: str | None


class PairMargins(Answer):
    """Margins of the worst input ``[design][flown]``; null where not stable, and where nothing uses a margin up."""

    gain_margin_db: PairNumbers = Field(description="The smaller of the two, raising and lowering")
    phase_margin_deg: PairNumbers
    delay_margin_s: PairNumbers
    disk_margin: PairNumbers


class Pairs(Answer):
    """Each point's design flown at every point, ``[design][flown]``, both flat row-major points.

    `outcomes` says why a figure is null: `unstable` has no step, `not_settled` no settling time within the reference's
    duration, `no_step` follows no reference; of `unproved` loops stability or damping could not be proved with
    their delay, or their numbers cannot be judged; `no_design` and `outside_model` are not flown.
    """

    outcomes: list[list[FlownOutcome]]
    stable: PairFlags
    held: PairFlags = Field(description="Stable, and all judged specs met")
    damping_ratio: PairNumbers
    largest_real_part: PairNumbers = Field(json_schema_extra={"unit": "1/s"})
    settling_time_s: PairNumbers
    overshoot_percent: PairNumbers
    margins: PairMargins | None = Field(description="Null where they were not asked for")


class BestDesign(Answer):
    """The design that serves best alone: holds the most points; of those, has the best of the least damping ratios."""

    point: int
    points_held: int
    points_flown: int
    worst_damping_ratio: float | None = Field(description="Null where a loop is unproved")


class WorstPair(Answer):
    """The design and the flown point with the least damping ratio of all; an unproved loop is worst of all."""

    design: int
    flown: int
    outcome: FlownOutcome
    damping_ratio: float | None
    largest_real_part: float | None = Field(json_schema_extra={"unit": "1/s"})
    settling_time_s: float | None
    overshoot_percent: float | None


class CrossFlight(Answer):
    """How far gains carry without a schedule; grid arrays by the point that was designed at, null without a design."""

    name: str
    kind: Kind
    reference: ReferenceStep
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    plant_outcomes: GridOutcomes
    plant_reasons: GridReasons
    specs: list[FlownSpec]
    points_flown: GridCounts
    points_held: GridCounts
    worst_damping_ratio: GridNumbers = Field(description="Over the flown points; null where one of them is unproved")
    best: BestDesign | None
    worst_pair: WorstPair | None
    reason: str | None = Field(description="Why there is no best design and no worst pair")
    pairs: Pairs


class UncertainParameter(Answer):
    """A parameter that is off: its factor lies within ``1 +- change_percent / 100``."""

    parameter: str
    change_percent: float
    deviation_percent: float | None = Field(description="Standard deviation of a normal distribution that is cut off")


class Fractions(Answer):
    """Part of the cases over the grid, and what it says of all plants that could be drawn.

    `at_least` is the one-sided limit of Clopper and Pearson with the answer's `confidence`; corners have none.
    """

    part: GridNumbers
    at_least: GridNumbers | None


class FractionEverywhere(Answer):
    """Part of the cases in which one plant does at every point that carries a design; null where none does."""

    part: float | None
    at_least: float | None


class Everywhere(Answer):
    """One plant over the whole envelope."""

    stable: FractionEverywhere
    held: FractionEverywhere


class Influence(Answer):
    """How a figure depends on each parameter: its linear fit over the cases in which it exists.

    Null, with a reason, where it does not change, too few cases have it, or these do not tell the parameters apart.
    """

    most_influential: list[list[str | None]]
    explained: GridNumbers = Field(description="Part of the figure's variance that the fit accounts for")
    standardised: dict[str, GridNumbers] = Field(
        description="Standard deviations of the figure for one of the parameter; the largest is the most influential"
    )
    change_per_percent: dict[str, GridNumbers] = Field(
        json_schema_extra={"unit": "see `unit`"}, description="Change of the figure for 1 % of the parameter"
    )
    reasons: GridReasons


class WorstCase(Answer):
    """The worst of a figure over grid and cases, and the plant that gives it; a value that does not exist is worst."""

    point: int
    case: int
    value: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    factors: dict[str, float] = Field(json_schema_extra={"unit": "1"})


class FigureOverCases(Answer):
    """A figure over its cases, at each point.

    A case in which it does not exist counts as worse than all others: `worst` and percentiles are null where they fall
    on such a case, and `reasons` says how many there are.
    """

    unit: str
    nominal: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"}, description="Of the plant as modelled")
    worst: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    worst_case: GridCounts = Field(description="Number of that case, from 0")
    worst_factors: dict[str, GridNumbers] = Field(
        json_schema_extra={"unit": "1"}, description="What each parameter is multiplied by in it"
    )
    p05: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    p50: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    p95: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    reasons: GridReasons
    influence: Influence
    worst_of_all: WorstCase | None = Field(description="Null where no point carries a design")


class RobustPerformance(Answer):
    """Gains as designed for the nominal plant, flown on plants that are off, the same cases at every point."""

    name: str
    kind: Kind
    reference: ReferenceStep
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    specs: list[FlownSpec]
    method: Literal["corners", "monte_carlo"]
    cases: int
    seed: int | None
    distribution: Literal["uniform", "normal"] | None
    confidence: float | None
    parameters: list[UncertainParameter]
    stable: Fractions
    held: Fractions
    everywhere: Everywhere
    figures: dict[str, FigureOverCases]
