"""Answers about schedules whose scheduling variable moves."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridOutcomes, GridReasons, Kind
from service.schemas.point import Complex
from service.schemas.requirement_answers import ReferenceStep
from service.schemas.wire import Answer

Side = Literal["below", "above"]
Placement = Literal["before_gain", "after_gain"]
#: ``[..grid][side]``
SidedNumbers = list[list[list[float | None]]]


class WorstSide(Answer):
    """The grid point and the side of it where the aileron gets away furthest."""

    point: int
    side: Side
    peak: float = Field(json_schema_extra={"unit": "see `units`"})


class Coupling(Answer):
    """One placement of the integrators, ``[..grid][side]``; null where there is no design or no gain on that side.

    `growth`, ``[..grid][side][eigenvalue]``: what each mode grows by, seen in the aileron, per unit of the scheduling
    variable's rate, in first order.
    """

    growth: list[list[list[list[Complex | None]]]] = Field(json_schema_extra={"unit": "see `units`"})
    settled: SidedNumbers = Field(
        json_schema_extra={"unit": "see `units`"},
        description="The aileron's deviation in a ramp of the scheduling variable that has lasted, per unit of rate",
    )
    peak: SidedNumbers = Field(json_schema_extra={"unit": "see `units`"}, description="Its largest size since it began")
    worst: WorstSide | None


class CouplingUnits(Answer):
    """Units of what is said per unit of the scheduling variable's rate."""

    growth: str
    deviation: str


class PlacementComparison(Answer):
    """What an integrator after its gain makes of the aileron's peak deviation, as a part of what one before it does."""

    peak_ratio: SidedNumbers
    smaller_after_gain: int = Field(description="Sides of points where it is smaller")
    smaller_before_gain: int
    alike: int = Field(description="Within one per cent, or both below what rounding leaves")


class LinearisedCoupling(Answer):
    """``z' = A z + B dq`` of total states, dq the scheduling variable in the unit of its axis; SI and radians.

    A state `scheduling_signal` follows where the signal lags. Null where a neighbouring point has no gains.
    """

    placement: Placement
    side: Side
    states: list[str]
    A: list[list[float | None]] = Field(json_schema_extra={"unit": "SI, by `states`"})
    B: list[float | None] = Field(json_schema_extra={"unit": "SI, by `states`"})


class HiddenCoupling(Answer):
    """What a moving scheduling variable does to a controller's loops, with its integrators before or after the gains.

    The eigenvalues are those at rest. The loop rests at the design's reference; the trim is scheduled without error.
    """

    name: str
    kind: Kind
    reference: ReferenceStep
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    scheduling_variable: str
    signal_lag_s: float
    rule: str
    out_of_range: str
    sides: list[Side]
    states: list[str]
    eigenvalues: list[list[list[Complex | None]]] = Field(json_schema_extra={"unit": "1/s"})
    units: CouplingUnits
    before_gain: Coupling
    after_gain: Coupling
    comparison: PlacementComparison
    linearised: list[LinearisedCoupling] | None = Field(description="At `point`; null where no point is asked for")
