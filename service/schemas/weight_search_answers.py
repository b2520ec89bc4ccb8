"""Answers about weights that were searched: what was found at each point, beside the controller's own weights."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from design.lqr.weight_request import Minimised
from service.schemas.design import Grid, Kind, OutcomeCode
from service.schemas.lqr_requests import Lqr
from service.schemas.point import Infeasibility, PointGain
from service.schemas.weight_search_requests import WeightName
from service.schemas.weights import BrysonWeights, Weights
from service.schemas.wire import Answer


class SearchedStep(Answer):
    """The manoeuvre that weights are searched on: the design's reference at once, whatever its rate limit."""

    aileron_deg: float
    tab_deg: float
    duration_s: float


class SearchedSpec(Answer):
    """A spec at the point: with the controller's own weights, and with those that were found; null without a design."""

    spec: str
    unit: str
    source: Literal["request", "limits"]
    limit: float = Field(json_schema_extra={"unit": "see `unit`"})
    before: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    before_passed: bool | None
    after: float | None = Field(json_schema_extra={"unit": "see `unit`"})


class Least(Answer):
    """What was made least; null where there is no design.

    What is found needs more than the controller's own weights where these do not meet the specs.
    """

    before: float | None = Field(json_schema_extra={"unit": "see `unit` of `minimised`"})
    after: float | None = Field(json_schema_extra={"unit": "see `unit` of `minimised`"})
    saved_percent: float | None


class WeightsAtPoint(Answer):
    """What was found at a grid point; null where the outcome is not ok."""

    index: int
    coordinates: dict[str, float]
    outcome: OutcomeCode
    reason: str | None
    infeasibility: Infeasibility | None = Field(
        description="Why no weights of its own meet the specs at the point; null of one set for all points"
    )
    weights: BrysonWeights | None
    gains: list[PointGain]
    minimised: Least
    specs: list[SearchedSpec]


class WhatIsMinimised(Answer):
    """The figure of the reference step that was made least."""

    quantity: Minimised
    unit: str


class WeightSearch(Answer):
    """Bryson weights that meet all specs with the least of what is minimised, designed and judged anew.

    The best that was found from many starts: no proof that there is nothing better, or that what was not found does not
    exist. `before` are the controller's own weights, `weights` of the points those that were found.
    """

    name: str
    kind: Kind
    step: SearchedStep
    grid: Grid
    minimised: WhatIsMinimised
    searched: list[WeightName]
    span: float
    common: bool
    exchange: bool
    before: Weights
    points: list[WeightsAtPoint]
    controller: Lqr | None = Field(
        description="The controller with the weights that were found, to be put among the `controllers` of a design "
        "request; null unless one set of weights serves all points that were looked at"
    )


class StepCost(Answer):
    """A settling time and the peak torque of the aileron's actuator; null where there is no design."""

    settling_time_s: float | None
    peak_aileron_torque_n_m: float | None


class FrontPlace(Answer):
    """A place on the front: the settling time that was allowed, what was reached, and the weights that do."""

    allowed_s: float
    settling_time_s: float
    peak_aileron_torque_n_m: float
    weights: BrysonWeights


class FrontAtPoint(Answer):
    """What speed costs at a grid point. Along the front the settling time rises and the torque falls, both strictly."""

    index: int
    coordinates: dict[str, float]
    outcome: OutcomeCode
    reason: str | None
    before: StepCost
    front: list[FrontPlace] = Field(description="The fastest first; every place meets all other specs")


class TradeOff(Answer):
    """Settling time against the peak torque of the aileron's actuator: a Pareto front at each point.

    `before` are the controller's own weights, and what they lead to. Settling times at which nothing is saved against a
    faster place, or nothing was found, are not on the front.
    """

    name: str
    kind: Kind
    step: SearchedStep
    grid: Grid
    searched: list[WeightName]
    span: float
    before: Weights
    points: list[FrontAtPoint]
