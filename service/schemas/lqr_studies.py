"""Answers of studies of state feedback in time: power weighed and not, and trajectories in the phase planes."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.requirement_answers import ReferenceStep, Worst
from service.schemas.weights import PlainWeights, PowerWeights
from service.schemas.wire import Answer

#: Samples of a signal; null where a value does not exist.
Samples = list[float | None]


class StepPowers(Answer):
    """Figures of the reference step at every point; null where there is no design or the value does not exist.

    Power is torque times rate, trim torque included. `total` is the sum of the magnitudes of both, what a supply must
    give that takes nothing back; `net` the magnitude of the sum, where one actuator may feed the other.
    """

    tab_peak_power_w: GridNumbers
    aileron_peak_power_w: GridNumbers
    total_peak_power_w: GridNumbers
    net_peak_power_w: GridNumbers
    settling_time_s: GridNumbers
    overshoot_percent: GridNumbers


class RetuningFactors(Answer):
    """Factors on the weights before: of the tab's torque and rate, of the aileron's, and of the integrals."""

    tab: GridNumbers
    aileron: GridNumbers
    integrals: GridNumbers


class WeighedPower(Answer):
    """The weights without regard to power, as asked for, and with it."""

    before: PlainWeights
    after: PowerWeights


class LargestTotals(Answer):
    """Largest peak of the total power over the points that have both designs, and the point that sets it."""

    before: Worst
    after: Worst


class PowerTrace(Answer):
    """The step at the point; totals, trim included. Power is positive when the motor drives the surface."""

    aileron_deg: Samples
    tab_deg: Samples
    aileron_torque_n_m: Samples
    tab_torque_n_m: Samples
    aileron_power_w: Samples
    tab_power_w: Samples
    total_power_w: Samples = Field(description="Sum of the magnitudes of both")


class PowerTraces(Answer):
    """Both steps at a point, at the same times."""

    point: int
    time_s: list[float]
    before: PowerTrace | None = Field(description="null where the weights without regard to power have no design")
    after: PowerTrace


class PowerComparison(Answer):
    """The reference step before and after power is weighed, the aileron settling in the same time (seed Fig 5.3).

    `after` is what the controller flies where `after_is_flown`; else its weights do not ask for the same settling time,
    and are retuned here so that the comparison is at equal terms. `outcomes` are those of the design after.
    """

    name: str
    kind: Kind
    form: Literal["balanced", "net_work"]
    reference: ReferenceStep
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    after_is_flown: bool
    weights: WeighedPower
    factors: RetuningFactors
    before: StepPowers
    after: StepPowers
    total_ratio: GridNumbers = Field(description="Peak of the total power after over before")
    largest_total_power_w: LargestTotals
    traces: PowerTraces | None = Field(description="null when no point is asked for")


class Trajectory(Answer):
    """One trajectory; totals, trim included.

    The tab's angle over the aileron's is the plane of the surfaces; the torque over the rate of the same surface what
    its motor has to do.
    """

    time_s: list[float]
    aileron_deg: Samples
    tab_deg: Samples
    aileron_rate_deg_s: Samples
    tab_rate_deg_s: Samples
    aileron_torque_n_m: Samples
    tab_torque_n_m: Samples


class FreeTrajectory(Answer):
    """From angles that are let go at rest; the start is from trim, the trajectory a total."""

    aileron_start_deg: float
    tab_start_deg: float
    trajectory: Trajectory


class TrimAngles(Answer):
    """Where free trajectories end."""

    aileron_deg: float
    tab_deg: float


class PhasePlane(Answer):
    """Trajectories of the closed loop at a point (seed Fig 5.8): after the reference step, and let go from angles.

    Of a loop with transport delays, `delays` are exact after the step and approximants in free trajectories.
    """

    name: str
    point: int
    delays: Literal["none", "exact_after_the_step"]
    trim: TrimAngles
    reference: ReferenceStep
    step: Trajectory | None = Field(description="null for a regulator, which follows no reference")
    free: list[FreeTrajectory]
