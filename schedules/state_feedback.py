"""State feedback over a grid in the form that is flown: of all states, of filtered rates, of estimates, or as code."""

from __future__ import annotations

from dataclasses import dataclass

from design.estimation.filter_gains import filter_gains
from design.estimation.kalman_filter import KalmanFilter, kalman_filter
from design.estimation.noise_model import NoiseModel
from design.estimation.observer import with_kalman_filter
from design.estimation.rate_filters import with_rate_filters
from design.gains import Gain
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.controller import LqrController
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.lqr.sampled_design import SampledLqrDesign, design_lqr_sampled, sampled_gains, sampled_lqr_loop
from design.lqr.synthesis import LqrDesign, design_lqr
from design.lqr.torque_loop import gains, lqr_loop
from design.outcome import Outcomes
from schedules.analysis import PlantEnvelope
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class StateFeedback:
    """A state feedback over the grid, not yet judged.

    Attributes
    ----------
    outcomes : (*G,)
    gains : each (*G,); those of a Kalman filter among them
    loop : that is flown, over the grid
    optimum : the regulator and its certificate
    observer : the filter that estimates the states, where one does
    """

    outcomes: Outcomes
    gains: tuple[Gain, ...]
    loop: Loop | CodedLoop
    optimum: LqrDesign | SampledLqrDesign
    observer: KalmanFilter | None = None


def state_feedback(study: Study, plant: PlantEnvelope, request: LqrController) -> StateFeedback:
    """Gains of a state feedback at every point, and the loop that they fly.

    Raises
    ------
    WeightsRefused : the weights define no regulator, or fail to see a mode at every ok point
    ValueError : a controller that samples and estimates at once
    """
    if request.sampling is not None:
        return _sampled(study, plant, request)
    found = design_lqr(plant.model, request, plant.outcomes, study.tab_actuator, study.aileron_actuator)
    loop = lqr_loop(plant.model, found)
    if isinstance(request.measurement, RateFilters):
        return StateFeedback(found.outcomes, gains(found), with_rate_filters(loop, request.measurement.cutoff), found)
    if isinstance(request.measurement, KalmanMeasurement):
        estimator = kalman_filter(loop, noise_of(request.measurement), found.outcomes)
        named = (*gains(found), *filter_gains(loop, estimator))
        return StateFeedback(estimator.outcomes, named, with_kalman_filter(loop, estimator), found, estimator)
    return StateFeedback(found.outcomes, gains(found), loop, found)


def noise_of(measurement: KalmanMeasurement) -> NoiseModel:
    """Intensities of the noises whose roots a controller is asked for with."""
    return NoiseModel(
        tab_torque=measurement.tab_torque_noise**2,
        aileron_torque=measurement.aileron_torque_noise**2,
        tab_angle=measurement.tab_angle_noise**2,
        aileron_angle=measurement.aileron_angle_noise**2,
        recovery=measurement.recovery,
    )


def _sampled(study: Study, plant: PlantEnvelope, request: LqrController) -> StateFeedback:
    assert request.sampling is not None
    if request.measurement is not None:
        raise ValueError(f"controller {request.name}: a sampled state feedback measures every state")
    found = design_lqr_sampled(
        plant.model, request, request.sampling, plant.outcomes, study.tab_actuator, study.aileron_actuator
    )
    return StateFeedback(found.outcomes, sampled_gains(found), sampled_lqr_loop(plant.model, found), found)
