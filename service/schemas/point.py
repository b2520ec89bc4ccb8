"""Answers about one grid point: the plant, and each controller there."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.design import EnvelopeWarning, Grid, GridAir, GridOutcomes, GridReasons, Kind, OutcomeCode
from service.schemas.hinge_moments import HingeMomentFit
from service.schemas.wire import Answer

Matrix = list[list[float]]


class Complex(Answer):
    """A complex number."""

    re: float
    im: float


class Air(Answer):
    """Air and speed at the point."""

    altitude_m: float
    airspeed_m_s: float
    dynamic_pressure_pa: float
    mach: float
    density_kg_m3: float
    temperature_k: float
    pressure_pa: float
    speed_of_sound_m_s: float


class Trim(Answer):
    """Angles held and the torques that hold them."""

    alpha_deg: float
    aileron_deg: float
    tab_deg: float
    T_t_n_m: float
    T_a_n_m: float
    residual_n_m: float


class HingeMomentValues(Answer):
    """Coefficients at the trim."""

    C_Ht: float
    C_Ha: float


class HingeMomentDerivatives(Answer):
    """Derivatives of the coefficients at the trim, per radian."""

    C_Ha_alpha: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ha_da: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ha_dt: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_alpha: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_da: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_dt: float = Field(json_schema_extra={"unit": "1/rad"})


class HingeMoments(Answer):
    """First-order expansion of the hinge moments about the trim."""

    values: HingeMomentValues
    derivatives: HingeMomentDerivatives


class LinearModel(Answer):
    """``x' = A x + B u``, ``y = C x + D u`` in deviations from the offsets; SI and radians."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    state_offset: list[float]
    input_offset: list[float]


class ServoTab(Answer):
    """The aileron driven by the tab alone: ``da/dt = numerator / denominator``, highest power first."""

    numerator: list[float]
    denominator: list[float]
    dc_gain: float | None
    zero: float | None = Field(json_schema_extra={"unit": "rad/s"})
    omega_n_rad_s: float | None
    damping_ratio: float | None
    reason: str | None


class Plant(Answer):
    """The plant at one grid point; null where the point is outside the model."""

    index: int
    coordinates: dict[str, float]
    outcome: OutcomeCode
    reason: str | None
    air: Air
    trim: Trim | None
    hinge_moments: HingeMoments | None
    linear_model: LinearModel | None
    poles: list[Complex] | None
    servo_tab: ServoTab | None


class PointGain(Answer):
    """One gain at the point, SI and radians."""

    name: str
    unit: str
    value: float | None = Field(json_schema_extra={"unit": "see `unit`"})


class GainMargin(Answer):
    """A factor on the loop gain that puts a closed-loop pole on the axis, and the frequency there."""

    ratio: float
    db: float = Field(json_schema_extra={"unit": "dB"})
    omega_rad_s: float


class PhaseMargin(Answer):
    """The phase margin at one gain crossover: positive means that much lag destabilises, negative lead."""

    deg: float = Field(json_schema_extra={"unit": "deg"})
    omega_rad_s: float


class Margins(Answer):
    """Margins of the loop cut at one actuator input; a null margin has its reason under `reasons`."""

    gain_margins: list[GainMargin]
    phase_margins: list[PhaseMargin]
    gain_margin_up_db: float | None
    gain_margin_down_db: float | None
    phase_margin_deg: float | None
    delay_margin_s: float | None
    disk_margin: float | None
    sensitivity_peak: float | None
    crossover_rad_s: float | None
    reasons: dict[str, str]


class Step(Answer):
    """The aileron's response to the reference step; a null figure has its reason under `reasons`."""

    rise_time_s: float | None
    settling_time_s: float | None
    overshoot_percent: float | None
    undershoot_percent: float | None
    peak_time_s: float | None
    steady_state_value_deg: float | None
    steady_state_error_deg: float | None
    bandwidth_rad_s: float | None
    reasons: dict[str, str]


class Riccati(Answer):
    """Certificate of the optimal gains: residual, closed loop of the design, and its return difference.

    The return difference of a continuous design is ``R^1/2 (I + L) R^-1/2`` of all states, at least 1. Nothing keeps
    that of a sampled one at 1: there it is the smallest ``|1 + L|`` of the loops cut one at a time. The spectral radius
    is that of a sampled design, else null.
    """

    residual: float
    largest_real_part: float = Field(json_schema_extra={"unit": "1/s"})
    return_difference_min: float
    spectral_radius: float | None


class SignalRms(Answer):
    """Root mean square of a signal; null where it is unlimited."""

    signal: str
    unit: str
    value: float | None = Field(json_schema_extra={"unit": "see `unit`"})


class EstimateError(Answer):
    """Root mean square of the error of an estimate, under the noise that the filter believes in."""

    state: str
    unit: str
    value: float = Field(json_schema_extra={"unit": "see `unit`"})


class KalmanFilter(Answer):
    """Poles and errors of the filter, and the residual of its Riccati equation."""

    poles: list[Complex]
    residual: float
    error_rms: list[EstimateError]


class FedBack(Answer):
    """Figures of a loop: with all states fed back, or as it is implemented.

    The root mean squares are those under the request's torque noises and errors of the measured angles; null with
    rate filters, which know no noise.
    """

    margins: dict[str, Margins]
    return_difference_min: dict[str, float | None] = Field(description="Smallest |1 + L| at each cut, at most 1")
    damping_ratio: float
    settling_time_s: float | None
    disturbance_rms: list[SignalRms] | None
    noise_rms: list[SignalRms] | None


class Estimation(Answer):
    """What it costs that not all states are measured: the loop that is implemented beside the full-state feedback."""

    kind: Literal["rate_filters", "kalman"]
    filter: KalmanFilter | None = Field(description="null with rate filters")
    full_state: FedBack
    implemented: FedBack


class PointVerdict(Answer):
    """A spec at the point."""

    spec: str
    limit: float = Field(json_schema_extra={"unit": "see `unit`"})
    unit: str
    source: str
    value: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    distance: float | None = Field(
        json_schema_extra={"unit": "see `unit`"}, description="How far inside the limit; negative outside"
    )
    passed: bool


class StepRejection(Answer):
    """After a unit step of a disturbing torque: the largest deviation, when it is over, and what stays.

    It is over when the deviation stays within 5 % of its peak.
    """

    peak: float | None = Field(json_schema_extra={"unit": "see `unit` of the pair"})
    peak_time_s: float | None
    rejection_time_s: float | None
    residual: float | None = Field(json_schema_extra={"unit": "see `unit` of the pair"})


class DisturbancePair(Answer):
    """What a disturbance or sensor noise does to a signal; null where it is unlimited.

    `h2` times the root of the spectral density of white noise at the source is the root mean square of the signal.
    """

    from_: str = Field(alias="from")
    to: str
    unit: str
    peak_gain: float | None = Field(json_schema_extra={"unit": "see `unit`"}, description="Over all frequencies")
    peak_omega_rad_s: float | None
    h2: float | None = Field(json_schema_extra={"unit": "see `h2_unit`"})
    h2_unit: str
    step: StepRejection | None = Field(description="Of a step; null for noise")


class Relaxation(Answer):
    """A spec whose relaxation alone makes the point feasible: as asked, and the best value with all others met."""

    spec: str
    unit: str
    limit: float = Field(json_schema_extra={"unit": "see `unit`"})
    reachable: float = Field(json_schema_extra={"unit": "see `unit`"})
    relaxation_percent: float = Field(description="In per cent of the limit")


class MissedSpec(Answer):
    """A spec that the nearest design misses, and its value there; null where it has none."""

    spec: str
    unit: str
    limit: float = Field(json_schema_extra={"unit": "see `unit`"})
    nearest: float | None = Field(json_schema_extra={"unit": "see `unit`"})


class Infeasibility(Answer):
    """Why the point has no gains: the spec in the way, what alone would have to be relaxed, the smallest part first."""

    blocking: str | None = Field(description="null when no single relaxation is enough")
    relaxations: list[Relaxation]
    nearest_design_misses: list[MissedSpec]


class PointController(Answer):
    """One controller at the point; null figures where it carries no gains there."""

    name: str
    kind: Kind
    outcome: OutcomeCode
    reason: str | None
    infeasibility: Infeasibility | None
    gains: list[PointGain]
    poles: list[Complex] | None
    margins: dict[str, Margins] | None
    step: Step | None
    disturbance: list[DisturbancePair] | None = Field(description="null for a sampled state feedback")
    riccati: Riccati | None
    estimation: Estimation | None = Field(description="null where every state is measured")
    verdicts: list[PointVerdict]


class Point(Plant):
    """Everything about one grid point."""

    controllers: list[PointController]


class LinearModels(Answer):
    """The grid part of a design, with no controllers."""

    grid: Grid
    air: GridAir
    outcomes: GridOutcomes
    reasons: GridReasons
    warnings: list[EnvelopeWarning]
    hinge_moment_fit: HingeMomentFit | None
    points: list[Plant]
