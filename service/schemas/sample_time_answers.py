"""Answers about sample times: how slowly the code of a state feedback may run."""

from __future__ import annotations

from pydantic import Field

from service.schemas.design import Grid, Kind
from service.schemas.requirement_answers import ReferenceStep
from service.schemas.wire import Answer

#: One value for each of the answer's points, in their order; null where it does not exist.
OverPoints = list[float | None]


class JudgedSpec(Answer):
    """A spec that a sample time must meet to pass; its limit at each of the points."""

    spec: str
    unit: str
    limits: list[float] = Field(json_schema_extra={"unit": "see `unit`"})


class SampleTimeTrial(Answer):
    """One sample time: what the loop comes to at each of the points.

    `figures` are null where there is no stable loop or the time was not tried, but for `spectral_radius`; each name
    ends in its unit. `return_difference` is the smallest ``|1 + L|`` of the loops cut at one actuator; margins are the
    worst of these, and overshoot and settling include what is between the samples.
    """

    sample_time_s: float
    tried: list[bool]
    passed: list[bool]
    reasons: list[str | None] = Field(description="Why it did not pass")
    figures: dict[str, OverPoints]


class SampleTimeWay(Answer):
    """Sample times with gains that come about in one way.

    `slowest_s` passes, and where `limited` the next slower time tried does not. `unbroken_s` passes with all faster
    times tried. The same `together`: at all points at once; null where no time does. Nothing is claimed of times
    that were not tried.
    """

    slowest_s: OverPoints
    unbroken_s: OverPoints
    limited: list[bool]
    slowest_together_s: float | None
    unbroken_together_s: float | None
    trials: list[SampleTimeTrial] = Field(description="The fastest first")


class SampleTimeSweep(Answer):
    """Sample times of a state feedback (seed 6.4.2), with gains designed for each, or the continuous ones run as code.

    Arrays are over `points`, flat indices into the grid: those whose controller has gains. A time passes where the loop
    is stable and meets every one of `specs`; steps from passing to failing are halved `halvings` times.
    """

    name: str
    kind: Kind
    grid: Grid
    points: list[int]
    reference: ReferenceStep
    computation_samples: float = Field(description="From a measurement to its command, in samples")
    halvings: int
    specs: list[JudgedSpec]
    not_judged: list[str] = Field(description="Specs of the pack that a coded torque loop has no figure for")
    redesigned: SampleTimeWay
    emulated: SampleTimeWay
