"""Answers about similarity: what the dynamics depend on."""

from __future__ import annotations

from pydantic import Field

from service.schemas.design import EnvelopeWarning, Grid, GridAir, GridNumbers, GridOutcomes, GridReasons, OutcomeCode
from service.schemas.hinge_moments import HingeMomentFit
from service.schemas.point import Matrix
from service.schemas.wire import Answer


class Powers(Answer):
    """Local powers of one figure over the grid, the temperature held.

    `dynamic_pressure` and `airspeed` at given density; `density` at given dynamic pressure; `density_at_airspeed` at
    given airspeed.
    """

    dynamic_pressure: GridNumbers
    airspeed: GridNumbers
    density: GridNumbers
    density_at_airspeed: GridNumbers


class ServoExponents(Answer):
    """What the servo-tab's natural frequency and damping ratio go with."""

    omega_n: Powers
    damping_ratio: Powers


class PressureSchedule(Answer):
    """What a schedule in dynamic pressure alone gets wrong: figures it counts on over those that are there."""

    sufficient: bool
    reason: str
    tolerance: float
    reference_density_kg_m3: float
    frequency_factor: GridNumbers
    damping_factor: GridNumbers
    worst_factor: float | None
    best_factor: float | None


class NondimensionalModel(Answer):
    """``dx/dtheta = A x + B u``, ``theta = t / time_unit_s``, torques in units of `torque_unit_n_m`."""

    index: int
    coordinates: dict[str, float]
    outcome: OutcomeCode
    reason: str | None
    A: Matrix | None
    B: Matrix | None
    time_unit_s: float | None
    torque_unit_n_m: float | None


class Nondimensional(Answer):
    """Non-dimensional linear models, one a grid point; null where the outcome is not ok."""

    states: list[str]
    inputs: list[str]
    points: list[NondimensionalModel]


class ScaledServoTab(Answer):
    """The measured servo-tab at the size of this section, over the grid."""

    omega_n_rad_s: GridNumbers
    damping_ratio: GridNumbers
    dc_gain: GridNumbers
    frequency_factor: GridNumbers = Field(description="Natural frequency over the measured one")
    damping_factor: GridNumbers = Field(description="Damping ratio over the measured one")
    reduced_frequency: GridNumbers
    assumptions: list[str]


class Similarity(Answer):
    """What the dynamics depend on over the grid, and whether dynamic pressure alone schedules them."""

    grid: Grid
    air: GridAir
    outcomes: GridOutcomes
    reasons: GridReasons
    warnings: list[EnvelopeWarning]
    hinge_moment_fit: HingeMomentFit | None
    exponents: ServoExponents
    pressure_schedule: PressureSchedule
    nondimensional: Nondimensional
    scaled: ScaledServoTab | None
