"""Answers about scaling laws."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import Gain, Grid, GridNumbers, GridOutcomes, GridReasons, Kind
from service.schemas.point import Complex
from service.schemas.requirement_answers import Worst
from service.schemas.wire import Answer

GridFlags = list[list[bool]]


class GainLaw(Answer):
    """``coefficient (variable / reference)^exponent``; null, with a reason, for a gain that follows no law.

    `predicted_exponent` is that of the non-dimensional model, for a servo whose bandwidth scales along.
    """

    gain: str
    unit: str
    variable: Literal["dynamic_pressure", "mass_flux"]
    variable_unit: str
    reference: float | None = Field(json_schema_extra={"unit": "see `variable_unit`"})
    coefficient: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    exponent: float | None
    predicted_exponent: float
    misfit_percent: float | None = Field(description="Root mean square of the logarithm of law over gain")
    points: int
    reason: str | None


class SpecLoss(Answer):
    """How far inside a spec the law and the per-point design are, in per cent of its limit; negative outside."""

    spec: str
    source: Literal["request", "spec_pack", "limits"]
    distance_by_law_percent: GridNumbers
    distance_by_design_percent: GridNumbers
    failed: GridFlags
    points_failed: int
    worst_point: int | None


class ScalingLoss(Answer):
    """What the laws lose against the per-point design."""

    flown: GridFlags
    stable: GridFlags
    bandwidth_ratio: GridNumbers
    slowest: Worst | None
    specs: list[SpecLoss]


class ScaledPoles(Answer):
    """Poles ``[branch][grid]`` made non-dimensional, and how near those of a branch come together over the grid."""

    branches: list[list[list[Complex | None]]]
    centre: list[Complex | None]
    spread_percent: list[float | None]
    rms_spread_percent: list[float | None]


class PoleScaling(Answer):
    """Poles over omega_n, and over the root of ``q / q_ref`` [rad/s], with the loop closed and open."""

    omega_n_rad_s: GridNumbers
    reference_pressure_pa: float | None
    closed_by_omega_n: ScaledPoles
    open_by_omega_n: ScaledPoles
    closed_by_root_pressure_rad_s: ScaledPoles
    open_by_root_pressure_rad_s: ScaledPoles


class BothPoles(Answer):
    """Poles of the per-point design, and of the schedule by laws."""

    design: PoleScaling
    law: PoleScaling


class Scaling(Answer):
    """The baseline schedule of two numbers a gain (seed 4.4): laws, gains, outcomes, loss, and scaled poles."""

    name: str
    kind: Kind
    grid: Grid
    laws: list[GainLaw]
    gains: list[Gain]
    outcomes: GridOutcomes
    reasons: GridReasons
    loss: ScalingLoss
    poles: BothPoles
