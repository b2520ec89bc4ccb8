"""Answers about one controller of a design: root locus, response, requirements, interpolated gains."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.point import Complex
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


class Response(Answer):
    """The response to the reference step from trim; every signal is a total, under a name that ends in its unit."""

    name: str
    point: int
    kind: Literal["linear"]
    reference: ReferenceStep
    time_s: list[float]
    signals: dict[str, list[float | None]]
    units: dict[str, str]


class ReferenceStep(Answer):
    """The manoeuvre that is followed."""

    kind: Literal["step"]
    aileron_deg: float
    duration_s: float


class Demand(Answer):
    """Demand on one actuator over the grid; null where there is no design or the figure is unlimited."""

    peak_torque_n_m: GridNumbers
    rms_torque_n_m: GridNumbers
    holding_torque_n_m: GridNumbers
    peak_rate_deg_s: GridNumbers
    peak_acceleration_deg_s2: GridNumbers = Field(json_schema_extra={"unit": "deg/s^2"})
    peak_deflection_deg: GridNumbers
    peak_power_w: GridNumbers
    rms_power_w: GridNumbers
    energy_out_j: GridNumbers
    energy_back_j: GridNumbers


class Worst(Answer):
    """The largest value over the grid, and the flat point that sets it."""

    value: float | None = Field(json_schema_extra={"unit": "that of the figure"})
    point: int | None


class Limits(Answer):
    """What the actuator can do, as the request gave it; null is unlimited."""

    deflection_deg: float | None
    rate_deg_s: float | None
    torque_n_m: float | None
    power_w: float | None


class Requirements(Answer):
    """What the reference step asks of each actuator of the controller, trim torque included."""

    name: str
    kind: Kind
    reference: ReferenceStep
    grid: Grid
    outcomes: GridOutcomes
    reasons: GridReasons
    actuators: dict[str, Demand]
    envelope: dict[str, dict[str, Worst]]
    limits: dict[str, Limits]


class InterpolatedGains(Answer):
    """Gains between the grid points; null where a grid point that carries weight has none."""

    name: str
    coordinates: dict[str, float]
    gains: dict[str, float | None]
    units: dict[str, str]
    clipped: bool
    rule: str
    out_of_range: str
    law: str
    reason: str | None
