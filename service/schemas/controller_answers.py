"""Answers about one controller of a design: root locus, response, requirements, interpolated gains."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Gain, Grid, GridNumbers, GridOutcomes, GridReasons, Kind, Verdict
from service.schemas.point import Complex
from service.schemas.requirement_answers import Worst
from service.schemas.wire import Answer


class Crossing(Answer):
    """A gain at which a branch meets the imaginary axis, and the frequency there."""

    gain: float
    omega_rad_s: float


class Breakaway(Answer):
    """A gain at which branches meet, and where."""

    gain: float
    at: Complex


class Asymptotes(Answer):
    """Where branches go for large gains: from the centroid, under these angles."""

    centroid: float | None = Field(json_schema_extra={"unit": "1/s"})
    angles_deg: list[float]


class BranchAngle(Answer):
    """Direction in which a branch leaves a pole, or reaches a zero."""

    at: Complex
    angle_deg: float


class DampingGain(Answer):
    """A gain at which a pole has the damping ratio, and the distance of that pole from the origin."""

    gain: float
    omega_n_rad_s: float


class ConstantDamping(Answer):
    """Gains at which a pole lies on the ray of a damping ratio, and the interval about the chosen gain that has it.

    The interval holds the gains about the chosen one at which all poles have the damping ratio at least; null where the
    chosen one has not, or where there is no end.
    """

    damping_ratio: float
    gains: list[DampingGain]
    least_damping_ratio: float | None = Field(description="At the chosen gain")
    lowest_gain: float | None
    largest_gain: float | None


class RootLocus(Answer):
    """The roots of ``1 + sign k L(s)`` as the gain k grows; each branch is continuous in k."""

    name: str
    loop: str
    loops: list[str]
    point: int
    sign: Literal[1, -1]
    gains: list[float]
    branches: list[list[Complex]]
    chosen_gain: float
    crossings: list[Crossing]
    breakaways: list[Breakaway]
    asymptotes: Asymptotes
    departures: list[BranchAngle] = Field(description="From the open loop's poles")
    arrivals: list[BranchAngle] = Field(description="At the finite zeros")
    constant_damping: ConstantDamping


class SpecVerdict(Verdict):
    """A spec at every point of the grid: arrays in its shape, null where the point carries no design."""

    limits: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    values: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})
    distances: GridNumbers = Field(
        json_schema_extra={"unit": "see `unit`"}, description="How far inside the limit; negative outside"
    )
    passes: list[list[bool | None]]


class Verdicts(Answer):
    """Every spec of the request, of the spec pack and of the actuators' limits, at every point."""

    name: str
    kind: Kind
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    verdicts: list[SpecVerdict]


class DesignMargin(Answer):
    """By how many per cent of its limit each spec can be stricter, all together, and still be met; or must be laxer."""

    name: str
    kind: Kind
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    margin_percent: GridNumbers
    binding: list[list[str | None]] = Field(description="Spec that is in the way first")
    worst: Worst | None = Field(description="The smallest margin: what the whole grid has")
    gains: list[Gain] = Field(description="That reach the margin")


class InterpolatedGains(Answer):
    """Gains between the grid points; null where a grid point that carries weight has none."""

    name: str
    coordinates: dict[str, float]
    gains: dict[str, float | None]
    units: dict[str, str]
    clipped: bool = Field(description="Outside the grid: the gains are those of the nearest edge")
    held: bool = Field(description="Outside the grid, and a controller in flight holds its last gains instead")
    rule: str
    out_of_range: str
    law: str
    reason: str | None


class MarginFigures(Answer):
    """The least margins of a loop at every grid point."""

    gain_margin_up_db: GridNumbers
    gain_margin_down_db: GridNumbers
    phase_margin_deg: GridNumbers
    delay_margin_s: GridNumbers
    disk_margin: GridNumbers
    sensitivity_peak: GridNumbers
    crossover_rad_s: GridNumbers


class StepFigures(Answer):
    """Figures of the aileron's response to the reference step at every grid point."""

    rise_time_s: GridNumbers
    settling_time_s: GridNumbers
    overshoot_percent: GridNumbers
    undershoot_percent: GridNumbers
    peak_time_s: GridNumbers
    steady_state_value_deg: GridNumbers
    steady_state_error_deg: GridNumbers
    bandwidth_rad_s: GridNumbers


class Figures(Answer):
    """One controller at every grid point; null where it carries no gains, or as `null_means` says."""

    name: str
    kind: Kind
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    decay_rate_1_s: GridNumbers = Field(description="Least distance of the closed-loop poles from the imaginary axis")
    damping_ratio: GridNumbers = Field(description="Least of the closed-loop poles")
    margins: dict[str, MarginFigures] = Field(description="By the actuator input at which the loop is cut")
    step: StepFigures | None = Field(description="null where no point carries gains")
    poles: list[list[list[Complex] | None]]
    null_means: dict[str, str] = Field(description="What a null means where the controller carries gains")
