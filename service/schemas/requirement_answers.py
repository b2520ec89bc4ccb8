"""Answers about what manoeuvres ask of the actuators."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.manoeuvres import Manoeuvre
from service.schemas.point import PointGain
from service.schemas.wire import Answer


class ReferenceStep(Answer):
    """The design's own manoeuvre."""

    kind: Literal["step"]
    aileron_deg: float
    tab_deg: float
    rate_limit_deg_s: float | None
    duration_s: float


class Demand(Answer):
    """Demand on one actuator over the grid; null where there is no design or the figure is unlimited."""

    peak_torque_n_m: GridNumbers
    rms_torque_n_m: GridNumbers
    holding_torque_n_m: GridNumbers
    peak_rate_deg_s: GridNumbers
    peak_acceleration_deg_s2: GridNumbers
    rms_acceleration_deg_s2: GridNumbers
    peak_deflection_deg: GridNumbers
    peak_power_w: GridNumbers
    rms_power_w: GridNumbers
    energy_out_j: GridNumbers
    energy_back_j: GridNumbers


class FlownDemand(Demand):
    """The same, with the time at each limit (null without one), and the bandwidth needed at small amplitude."""

    time_at_deflection_limit_s: GridNumbers
    time_at_rate_limit_s: GridNumbers
    time_at_torque_limit_s: GridNumbers
    time_at_power_limit_s: GridNumbers
    needed_bandwidth_rad_s: GridNumbers


class Worst(Answer):
    """The largest value over the grid, and the flat point that sets it."""

    value: float | None = Field(json_schema_extra={"unit": "that of the figure"})
    point: int | None


class Limits(Answer):
    """Limits of an actuator; null is unlimited."""

    deflection_deg: float | None
    rate_deg_s: float | None
    torque_n_m: float | None
    power_w: float | None


class TorqueSpeedPoint(Answer):
    """Torque and rate that are asked for at the same time, and the grid point that asks."""

    torque_n_m: float
    rate_deg_s: float
    point: int


class TorqueSpeed(Answer):
    """Torque and rate together over the whole envelope: what a motor's curve must lie outside of.

    `hull` is the convex hull, counter-clockwise; `cloud` the outermost of each direction.
    """

    hull: list[TorqueSpeedPoint]
    cloud: list[TorqueSpeedPoint]


class Tracking(Answer):
    """How far a surface is from its reference, less the trim."""

    peak_deg: GridNumbers
    rms_deg: GridNumbers


class Requirements(Answer):
    """What the reference step asks of each actuator of the controller, trim torque included.

    Over the envelope `rms_torque_n_m` is the continuous requirement, the others are peaks.
    """

    name: str
    kind: Kind
    reference: ReferenceStep
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    actuators: dict[str, Demand]
    envelope: dict[str, dict[str, Worst]]
    limits: dict[str, Limits]


class Route(Answer):
    """What one way of following the manoeuvre says. `tracking` is by surface."""

    actuators: dict[str, FlownDemand]
    envelope: dict[str, dict[str, Worst]]
    torque_speed: dict[str, TorqueSpeed | None] = Field(description="null where torques are not finite")
    tracking: dict[str, Tracking]


class SimulatedDemand(Demand):
    """The same of the non-linear response, with the time at each limit (0 where there is none)."""

    time_at_deflection_limit_s: GridNumbers
    time_at_rate_limit_s: GridNumbers
    time_at_torque_limit_s: GridNumbers
    time_at_power_limit_s: GridNumbers


class AntiWindup(Answer):
    """What an integral's rate is changed by for each unit of a command that the actuator cannot follow."""

    name: str
    unit: str
    values: GridNumbers = Field(json_schema_extra={"unit": "see `unit`"})


class Simulated(Answer):
    """What the non-linear response says.

    `simulation` is `completed`, `diverged`, `too_fast` for the step that is allowed, or `no_loop`. `difference_percent`
    is how much larger a figure is than that of the linear response. `energy_residual_j` is the largest error of the
    balance of energy: what the integration leaves.
    """

    actuators: dict[str, SimulatedDemand]
    envelope: dict[str, dict[str, Worst]]
    difference_percent: dict[str, dict[str, GridNumbers]]
    simulation: list[list[str | None]]
    simulation_reasons: list[list[str | None]]
    diverged_at_s: GridNumbers
    left_data_at_s: GridNumbers = Field(description="When the angles left what the hinge-moment data know")
    energy_residual_j: GridNumbers
    anti_windup: list[AntiWindup]
    unenforced: list[str] = Field(description="Limits that this drive cannot be held to; they are watched all the same")


class FlownRequirements(Answer):
    """What a manoeuvre asks of each actuator, trim torque included.

    Over the envelope `rms_torque_n_m` is the continuous requirement, the others are peaks.
    """

    name: str
    kind: Kind
    manoeuvre: Manoeuvre
    duration_s: float
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    linear: Route
    nonlinear: Simulated | None = Field(description="null unless asked for")
    limits: dict[str, Limits]


class LimitsReached(Answer):
    """Whether each limit of an actuator is reached, sample by sample."""

    deflection: list[bool]
    rate: list[bool]
    torque: list[bool]
    power: list[bool]


class Energies(Answer):
    """Energies since the beginning: kinetic = actuators + air + friction + reaction - stops, but for the residual."""

    kinetic_j: list[float | None]
    tab_actuator_j: list[float | None]
    aileron_actuator_j: list[float | None]
    air_j: list[float | None]
    friction_j: list[float | None]
    reaction_j: list[float | None]
    stops_j: list[float | None]
    residual_j: list[float | None]


class Simulation(Answer):
    """What became of a non-linear response."""

    outcome: str
    reason: str | None
    diverged_at_s: float | None
    left_data_at_s: float | None
    limits_reached: dict[str, LimitsReached]
    energy: Energies
    anti_windup: list[PointGain]
    unenforced: list[str]


class Response(Answer):
    """The response to the reference step from trim; every signal is a total, under a name that ends in its unit."""

    name: str
    point: int
    kind: Literal["linear", "nonlinear"]
    reference: ReferenceStep
    time_s: list[float]
    signals: dict[str, list[float | None]]
    units: dict[str, str]
    simulation: Simulation | None = Field(description="null where the response is the exact linear one")


class FlownResponse(Answer):
    """The response to a manoeuvre from trim; every signal is a total, under a name that ends in its unit."""

    name: str
    point: int
    kind: Literal["linear", "nonlinear"]
    manoeuvre: Manoeuvre
    time_s: list[float]
    signals: dict[str, list[float | None]]
    units: dict[str, str]
    simulation: Simulation | None = Field(description="null where the response is the exact linear one")
