"""Answers about what the controllers of a design ask of the actuators, side by side (seed 5.7)."""

from __future__ import annotations

from pydantic import Field

from service.schemas.design import Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.requirement_answers import ReferenceStep, Worst
from service.schemas.wire import Answer

#: Arrays in the grid's shape with one more axis behind, that of the rate limits; null where a value does not exist.
GridCurves = list[list[list[float | None]]]
_SAVED = "Part of the aileron's torque that the tab saves; negative where it costs more than it gives"
_SAVED_OF_THE_ENVELOPE = "Part by which the aileron's actuator may be smaller: of the largest torque over the grid"


class ActuationFigures(Answer):
    """Figures of the reference step at every point, trim included; null where `missing` says why, or without a design.

    `aileron_peak_torque_n_m` is what the aileron's actuator gives, of a tab-only controller the torque that the trim
    leaves; `tab_held_peak_torque_n_m` what the same motion of the aileron would need, the tab held at its trim angle.
    """

    aileron_peak_torque_n_m: GridNumbers
    tab_held_peak_torque_n_m: GridNumbers
    torque_saved_percent: GridNumbers = Field(description=_SAVED)
    tab_peak_torque_n_m: GridNumbers
    tab_peak_rate_deg_s: GridNumbers
    tab_peak_deflection_deg: GridNumbers
    settling_time_s: GridNumbers
    overshoot_percent: GridNumbers


class ActuationEnvelope(Answer):
    """The largest value of each figure over the grid, with its point."""

    aileron_peak_torque_n_m: Worst
    tab_held_peak_torque_n_m: Worst
    torque_saved_percent: float | None = Field(description=_SAVED_OF_THE_ENVELOPE)
    tab_peak_torque_n_m: Worst
    tab_peak_rate_deg_s: Worst
    tab_peak_deflection_deg: Worst
    settling_time_s: Worst
    overshoot_percent: Worst


class EnvelopeCurves(Answer):
    """The largest value of each figure over the grid at each rate limit, with its point."""

    aileron_peak_torque_n_m: list[Worst]
    tab_held_peak_torque_n_m: list[Worst]
    torque_saved_percent: list[float | None] = Field(description=_SAVED_OF_THE_ENVELOPE)
    tab_peak_torque_n_m: list[Worst]
    tab_peak_rate_deg_s: list[Worst]
    tab_peak_deflection_deg: list[Worst]
    settling_time_s: list[Worst]
    overshoot_percent: list[Worst]


class PointCurves(Answer):
    """Each figure at every point and rate limit."""

    aileron_peak_torque_n_m: GridCurves
    tab_held_peak_torque_n_m: GridCurves
    torque_saved_percent: GridCurves = Field(description=_SAVED)
    tab_peak_torque_n_m: GridCurves
    tab_peak_rate_deg_s: GridCurves
    tab_peak_deflection_deg: GridCurves
    settling_time_s: GridCurves
    overshoot_percent: GridCurves


class ActuationCurves(Answer):
    """The same figures of the reference step reached at limited rates, in the order of `rate_limit_deg_s` (Fig 5.20).

    Each is followed until the reference has arrived, and from then on for as long as the step is; the settling time
    counts from the beginning. Transport delays are approximants in time.
    """

    envelope: EnvelopeCurves
    points: PointCurves


class MissingFigure(Answer):
    """Points with a design, by flat row-major index, at which a figure does not exist, and why."""

    figure: str
    rate_limit_deg_s: float | None = Field(description="null: the step itself")
    points: list[int]
    reason: str


class ComparedController(Answer):
    """One controller; with a `reason`, it has no place in the comparison, and no figures."""

    name: str
    kind: Kind
    outcomes: GridOutcomes
    reasons: GridReasons
    reason: str | None
    step: ActuationFigures | None
    envelope: ActuationEnvelope | None
    curves: ActuationCurves | None
    missing: list[MissingFigure]


class ActuationComparison(Answer):
    """All controllers of the design on its reference step, and with the reference's rate limited."""

    reference: ReferenceStep
    rate_limit_deg_s: list[float]
    grid: Grid
    controllers: list[ComparedController]
