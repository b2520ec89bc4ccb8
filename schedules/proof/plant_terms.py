"""How the plant changes over the envelope: two numbers, or three with lag states (proof of seed 2.3.20's form).

Without virtual inertia the mass matrix is that of the bodies, so the linear model is affine in

    Q = f q    torque of the air by angles and lag states       q dynamic pressure, f compressibility
    D = f q/V  torque of the air by rates
    V          pace of the lag states

when trim angles or hinge-moment slopes do not change: `scaled_model` makes the model of any such triple from the one
at a single point, and `misfit` says how far the envelope's own models are from that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.arrays import FloatArray
from model.flight import FlightCondition
from model.linear_model import LinearModel
from model.system import TabAileron
from model.trim_request import HeldTorque, TrimRequest

TERMS = ("Q", "D", "V")


def term_values(system: TabAileron, condition: FlightCondition) -> FloatArray:
    """``[Q, D, V]`` (*G, 3) [Pa, Pa s/m, m/s]."""
    factor = system.aerodynamics.amplification(condition.mach)
    q, speed = condition.dynamic_pressure, condition.airspeed
    return np.stack(np.broadcast_arrays(factor * q, factor * q / speed, speed), axis=-1)


def given_point_by_point(request: TrimRequest) -> bool:
    """Whether a trim is asked for grid point by grid point, so that nothing says what it is between them."""
    asked = (request.alpha, request.aileron, request.tab)
    numbers = (value.torque if isinstance(value, HeldTorque) else value for value in asked)
    return any(np.ndim(value) > 0 for value in numbers if not isinstance(value, str))


def scaled_model(reference: LinearModel, ratios: FloatArray) -> LinearModel:
    """Models (N,) at `ratios` (N, 3) times the ``[Q, D, V]`` of the reference, one model or (N,) of them."""
    by_q, by_d, by_v = (ratios[..., k, None, None] for k in range(3))
    A = np.array(np.broadcast_to(reference.A, (*ratios.shape[:-1], *reference.A.shape[-2:])))
    A[..., 1:4:2, 0:4:2] *= by_q
    A[..., 1:4:2, 1:4:2] *= by_d
    A[..., 1:4:2, 4:] *= by_q
    A[..., 4:, 0:4:2] *= by_v
    A[..., 4:, 4:] *= by_v

    def spread(values: FloatArray, like: int) -> FloatArray:
        return np.broadcast_to(values, (*ratios.shape[:-1], *values.shape[-like:]))

    return replace(
        reference, A=A, B=spread(reference.B, 2), C=spread(reference.C, 2), D=spread(reference.D, 2),
        state_offset=spread(reference.state_offset, 1), input_offset=spread(reference.input_offset, 1),
        inertia=spread(reference.inertia, 2), damping=reference.damping * by_d, stiffness=reference.stiffness * by_q,
        lag_torque=reference.lag_torque * by_q,
    )  # fmt: skip


def misfit(reference: LinearModel, ratios: FloatArray, actual: LinearModel) -> float:
    """Largest difference of models (N,) from the scaled reference, relative to the largest entry of the same row."""
    expected = scaled_model(reference, ratios)
    worst = 0.0
    for made, real in ((expected.A, actual.A), (expected.B, actual.B), (expected.inertia, actual.inertia)):
        size = np.max(np.abs(real), axis=-1, keepdims=True)
        worst = max(worst, float(np.max(np.abs(made - real) / np.where(size > 0.0, size, 1.0), initial=0.0)))
    return worst
