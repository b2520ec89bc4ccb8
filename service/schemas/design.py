"""Answers about designs: the design itself, and the list of them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.hinge_moments import HingeMomentFit
from service.schemas.requests import DesignRequest
from service.schemas.wire import Answer

OutcomeCode = Literal["ok", "infeasible", "not_certified", "outside_model", "excluded"]
Kind = Literal["negative_feedback", "positive_feedback", "lqr"]
#: Arrays in the grid's shape, first axis first; null where a value does not exist.
GridNumbers = list[list[float | None]]
GridOutcomes = list[list[OutcomeCode]]
GridReasons = list[list[str | None]]


class Provenance(Answer):
    """Which code made the design, when, and with which numerical libraries."""

    version: str
    created_at: str
    solver: str


class GridAxis(Answer):
    """One axis: its name, which ends in its unit, and its breakpoints."""

    name: Literal["altitude_m", "dynamic_pressure_pa", "airspeed_m_s", "mach"]
    values: list[float]


class Grid(Answer):
    """Axes, and the shape of every array over them."""

    axes: list[GridAxis]
    shape: list[int]


class GridAir(Answer):
    """Air and speed over the grid."""

    altitude_m: GridNumbers
    airspeed_m_s: GridNumbers
    dynamic_pressure_pa: GridNumbers
    mach: GridNumbers
    density_kg_m3: GridNumbers
    temperature_k: GridNumbers
    pressure_pa: GridNumbers
    speed_of_sound_m_s: GridNumbers


class EnvelopeWarning(Answer):
    """Something to know about some points, by flat row-major index."""

    code: str
    detail: str
    points: list[int]


class Roughness(Answer):
    """How far the gain is from what its neighbours give by interpolation, as a part of itself; null without neighbours.

    That is what a table without this line would be wrong by.
    """

    worst_percent: float | None
    worst_point: int | None
    rms_percent: float | None


class Gain(Answer):
    """One gain over the grid, SI and radians; null where the outcome is not ok."""

    name: str
    unit: str
    values: GridNumbers
    roughness: Roughness


class Smoothing(Answer):
    """What was given up at each point so that gains vary smoothly."""

    roughness_before: dict[str, Roughness]
    bandwidth_lost_percent: GridNumbers
    distance_before_percent: GridNumbers = Field(
        description="To the nearest of the requested specs, in per cent of its limit"
    )
    distance_after_percent: GridNumbers


class Verdict(Answer):
    """A spec over the points that carry a design: its worst value, where, and whether all meet it."""

    spec: str
    limit: float | None = Field(
        json_schema_extra={"unit": "see `unit`"},
        description="Of a spec that varies over the grid, the one at the worst point; null when no point is judged",
    )
    unit: str
    source: Literal["request", "spec_pack", "limits"]
    worst_value: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    worst_point: int | None
    points_judged: int
    points_passed: int
    passed: bool
    reason: str | None


class Controller(Answer):
    """One controller over the grid."""

    name: str
    kind: Kind
    outcomes: GridOutcomes
    reasons: GridReasons
    gains: list[Gain]
    smoothing: Smoothing | None = Field(description="null where no smoothing is asked for")
    reduced_frequency: GridNumbers = Field(
        description="k = |s| c / (2 V) of the fastest closed-loop mode of the surfaces; null where there are no gains"
    )
    verdicts: list[Verdict]


class Links(Answer):
    """Addresses of what belongs to the design, by controller where there is one."""

    self: str
    points: str
    root_locus: dict[str, str]
    response: dict[str, str]
    frequency_response: dict[str, str]
    actuator_requirements: dict[str, str]
    limited_tab: dict[str, str]
    figures: dict[str, str]
    verdicts: dict[str, str]
    design_margin: dict[str, str]
    scaling: dict[str, str]
    cross_flight: dict[str, str]
    robust_performance: dict[str, str]
    worst_case: dict[str, str]
    hidden_coupling: dict[str, str]
    simultaneous_margins: dict[str, str] = Field(description="This and the six below: of state feedback")
    norms: dict[str, str]
    phase_plane: dict[str, str]
    power_comparison: dict[str, str]
    sample_time_sweep: dict[str, str]
    weight_search: dict[str, str] = Field(description="This and the one below: to be posted to")
    trade_off: dict[str, str]
    report: str
    verification: str
    certificate: dict[str, str]
    gains: dict[str, str]
    actuation_comparison: str
    cross_check: str
    compare: str
    schedules: dict[str, dict[str, str]]


class OverTheGrid(Answer):
    """What was designed: gains, outcomes and verdicts over the grid."""

    grid: Grid
    air: GridAir
    outcomes: GridOutcomes
    reasons: GridReasons
    warnings: list[EnvelopeWarning]
    hinge_moment_fit: HingeMomentFit | None
    controllers: list[Controller]


class Design(OverTheGrid):
    """A design: gains, outcomes and verdicts over the grid, the request behind them, and links to all that is known."""

    id: str
    name: str
    request: DesignRequest
    provenance: Provenance
    links: Links


class ListedDesign(Answer):
    """A design in the list."""

    id: str
    name: str
    created_at: str
    version: str
    link: str


class DesignList(Answer):
    """One page of designs, newest first; null when there is no next page."""

    items: list[ListedDesign]
    next_cursor: str | None
