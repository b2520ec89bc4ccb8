"""Answers about the actuator of a controller: candidates judged, and designs within given limits."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.actuator_sizing import ActuatorName
from service.schemas.design import Gain, Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.manoeuvres import Manoeuvre
from service.schemas.requirement_answers import Limits, Worst
from service.schemas.wire import Answer

Capability = Literal["torque", "static", "rate", "continuous", "power", "line"]
LoadCase = Literal["holding", "peak_hinge_moment", "ground_gust"]
Limited = Literal["deflection", "rate", "torque", "power"]


class SurfaceFigures(Answer):
    """What the manoeuvre asks of the actuator at its surface, without its rotor; null without design, or unlimited."""

    peak_torque_n_m: GridNumbers
    rms_torque_n_m: GridNumbers
    holding_torque_n_m: GridNumbers
    peak_hinge_moment_n_m: GridNumbers = Field(description="Of the air, trim included")
    peak_rate_deg_s: GridNumbers
    peak_acceleration_deg_s2: GridNumbers
    rms_acceleration_deg_s2: GridNumbers
    peak_power_w: GridNumbers
    rms_power_w: GridNumbers


class StaticLoad(Answer):
    """A load that is held at rest."""

    case: LoadCase
    torque_n_m: GridNumbers


class SeenAtSurface(Answer):
    """A candidate behind its gear, losses left out; null is unlimited."""

    stall_torque_n_m: float
    continuous_torque_n_m: float | None
    no_load_rate_deg_s: float
    rotor_inertia_kg_m2: float


class Judged(Answer):
    """A candidate at its best gear ratio. A headroom is the part of a capability that is left, below 0 too little.

    A headroom is null where nothing is known of what is asked for, or what is asked for has no bound.
    """

    gear_ratio: float
    at_surface: SeenAtSurface
    enough: bool
    least_headroom: float | None
    capability: Capability | None = Field(description="That has the least headroom")
    point: int | None = Field(description="Where that is")
    headroom: dict[Capability, Worst] = Field(description="The least of each capability over the grid")
    least_headroom_over_grid: GridNumbers


class FedBack(Judged):
    """The candidate on the design that has its rotor, each gear ratio judged on the design made with it."""

    designs: int = Field(description="How many designs it took; 0 where the rotor changes none")
    converged: bool = Field(description="Whether no ratio beside this one is better: of a range, 2 % more or less")
    lost_points: list[int] = Field(description="Points that have a design without the rotor, and none with it")
    requirement: SurfaceFigures
    settling_time_s: GridNumbers = Field(description="Of the design that has the rotor")
    bandwidth_rad_s: GridNumbers


class JudgedCandidate(Judged):
    """A candidate on the design as it is, and on the design with its rotor where that was asked for."""

    name: str
    fed_back: FedBack | None


class ActuatorSelection(Answer):
    """What the actuator must do, and the candidates: those that are enough first, then by their least headroom."""

    name: str
    kind: Kind
    actuator: ActuatorName
    manoeuvre: Manoeuvre | None = Field(description="Null: the reference of the design")
    duration_s: float
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    requirement: SurfaceFigures
    envelope: dict[str, Worst]
    static_loads: list[StaticLoad]
    candidates: list[JudgedCandidate]


class LimitedPeaks(Answer):
    """Peaks of what is limited, over the grid; null as a whole where there is no such limit."""

    peak_deflection_deg: GridNumbers | None
    peak_rate_deg_s: GridNumbers | None
    peak_torque_n_m: GridNumbers | None
    peak_power_w: GridNumbers | None


class HeldPart(Answer):
    """Which points the actuator can hold, and what breaks at the others; null where there is no design."""

    held: list[list[bool | None]]
    points_held: int
    breaks: list[list[list[Limited] | None]]
    peaks: LimitedPeaks = Field(description="That the reference asks for")


class StepBefore(Answer):
    """How quick the design is."""

    settling_time_s: GridNumbers
    bandwidth_rad_s: GridNumbers


class SlowerDesign(Answer):
    """The fastest design within the limits, by what steers it, and what came nearest where there is none."""

    outcomes: GridOutcomes
    reasons: GridReasons
    steered_by: list[list[Literal["specs", "tab_rate", "torque", "torque_and_rate"] | None]] = Field(
        description="The limits as specs, a lower tab rate still, a higher price of the actuator's torque, or of its "
        "torque and rate; null where the design is as it was"
    )
    factor: GridNumbers = Field(
        description="Price of the actuator over what it was; of tab-only controllers the peak rate of the tab"
    )
    settling_time_s: GridNumbers
    bandwidth_rad_s: GridNumbers
    held: HeldPart
    least_peaks: LimitedPeaks = Field(description="Where nothing helps, how near to the limits it comes")
    gains: list[Gain]


class InverseSizing(Answer):
    """What an actuator with limits makes of a design."""

    name: str
    kind: Kind
    actuator: ActuatorName
    limits: Limits
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    held: HeldPart
    before: StepBefore
    within_limits: SlowerDesign | None
    reason: str | None = Field(description="Why there is no design to choose within the limits")
