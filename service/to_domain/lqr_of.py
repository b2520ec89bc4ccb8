"""From the wire to the parts of a regulator: its weights, where the tab rests, what is measured."""

from __future__ import annotations

from math import radians, tau

import numpy as np

from design.lqr.allocation import TabAllocation, TabRatio
from design.lqr.measurement import KalmanMeasurement, Measurement, RateFilters
from design.lqr.output_weights import OutputWeights
from design.lqr.power_weights import NetWorkWeights, PlainWeights, PowerBalancedWeights, ReferenceStep, Weights
from design.lqr.weights import BrysonWeights, ExplicitWeights
from service.schemas import flight, lqr_requests, weights


def lqr_weights(wire: weights.Weights, step: ReferenceStep) -> Weights:
    """Weights by their rule; power is judged on `step`."""
    if not isinstance(wire, weights.PowerWeights):
        return plain_weights(wire)
    base, keep_settling = plain_weights(wire.base), bool(wire.keep_settling)
    if wire.form == "balanced":
        return PowerBalancedWeights(base, wire.tab_power_w, wire.aileron_power_w, step, keep_settling)
    retuned_on = step if keep_settling else None
    return NetWorkWeights(base, wire.tab_price or 0.0, wire.aileron_price or 0.0, wire.part, retuned_on)


def plain_weights(wire: weights.PlainWeights) -> PlainWeights:
    """Weights without regard to power; Bryson's angles from degrees to radians."""
    if isinstance(wire, weights.BrysonWeights):
        return bryson_weights(wire)
    if isinstance(wire, weights.OutputWeights):
        return OutputWeights(tuple(wire.outputs), np.array(wire.W_y, dtype=float), np.array(wire.W_u, dtype=float))
    return ExplicitWeights(
        Q=np.array(wire.Q, dtype=float),
        R=np.array(wire.R, dtype=float),
        N=None if wire.N is None else np.array(wire.N, dtype=float),
    )


def bryson_weights(wire: weights.BrysonWeights) -> BrysonWeights:
    """Largest acceptable values, angles from degrees to radians."""
    return BrysonWeights(
        aileron=radians(wire.aileron_deg),
        aileron_rate=radians(wire.aileron_rate_deg_s),
        tab=radians(wire.tab_deg),
        tab_rate=radians(wire.tab_rate_deg_s),
        aileron_integral=_radians(wire.aileron_integral_deg_s),
        tab_torque=wire.tab_torque_n_m,
        aileron_torque=wire.aileron_torque_n_m,
        tab_integral=_radians(wire.tab_integral_deg_s),
    )


def reference_step(wire: flight.Reference, controller: lqr_requests.Lqr) -> ReferenceStep:
    """The request's step, as far as the controller follows it."""
    tab = wire.tab_deg if controller.reference == "aileron_and_tab" else 0.0
    return ReferenceStep(aileron=radians(wire.aileron_deg), duration=wire.duration_s, tab=radians(tab))


def tab_allocation(wire: lqr_requests.TabAllocation) -> TabAllocation:
    """A rule, or the ratio itself."""
    return TabRatio(wire.tab_per_aileron) if isinstance(wire, lqr_requests.TabTravel) else wire


def measurement(wire: lqr_requests.Measurement | None) -> Measurement | None:
    """What is measured; Hz and degrees become radians. A root density per root Hz is one per root of 1/s."""
    if wire is None:
        return None
    if isinstance(wire, lqr_requests.RateFilters):
        return RateFilters(tau * wire.cutoff_hz)
    return KalmanMeasurement(
        tab_torque_noise=wire.tab_torque_noise,
        aileron_torque_noise=wire.aileron_torque_noise,
        tab_angle_noise=radians(wire.tab_angle_noise_deg),
        aileron_angle_noise=radians(wire.aileron_angle_noise_deg),
        recovery=wire.recovery,
    )


def _radians(angle: float | None) -> float | None:
    return None if angle is None else radians(angle)
