"""Answers about limited tabs (seed Fig 5.19)."""

from __future__ import annotations

from pydantic import Field

from service.schemas.design import Grid, GridOutcomes, GridReasons, Kind
from service.schemas.requirement_answers import ReferenceStep, Worst
from service.schemas.wire import Answer

#: Arrays in the grid's shape with one more axis behind, that of the limits; null where a value does not exist.
GridCurves = list[list[list[float | None]]]


class LimitedTabFigures(Answer):
    """Figures at every point and limit, trim included; null without a design or where the simulation did not end."""

    aileron_peak_torque_n_m: GridCurves
    aileron_rms_torque_n_m: GridCurves
    tab_peak_deflection_deg: GridCurves
    tab_time_at_limit_s: GridCurves
    final_error_deg: GridCurves = Field(description="How far the aileron is from its reference in the end")


class LimitedTab(Answer):
    """The design's reference, simulated with the tab's deflection limited and nothing else, in the order of the limits.

    `envelope` is the largest aileron torque over the grid at each limit. Of a tab-only controller the aileron's torque
    is that of the trim.
    """

    name: str
    kind: Kind
    reference: ReferenceStep
    tab_limit_deg: list[float]
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    points: LimitedTabFigures
    envelope: list[Worst]
    simulation: list[list[list[str | None]]]
    simulation_reasons: list[list[list[str | None]]]
