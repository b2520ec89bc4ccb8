"""Linearisation of the equations of motion about a trim, by analytic derivatives (seed 2.3.7 to 2.3.20)."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray
from model.flight import FlightCondition
from model.induced_angles import induced_angle_derivatives, induced_angles
from model.lag_states import LAG_STATES, incidence_row, lag_columns, lag_rows, with_settled_lags
from model.linear_model import STATES, LinearModel
from model.system import TabAileron
from model.trim import Trim

# How the angles [dt, da] sit in the state [dt, dt', da, da'].
_ANGLES_OF_STATE = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])


def linearise(system: TabAileron, condition: FlightCondition, trim: Trim) -> LinearModel:
    """Linear model in deviations from `trim`, at every point of the grid.

    ``J d'' = Bk d' + Kk d + T`` (seed 2.3.7) with ``Kk = -q c^2 s dC_H/d(angles)`` and
    ``Bk = -q c^2 s dC_H/d(rates)`` (seed 2.3.8 to 2.3.15, the span added); then the state-space form of
    seed 2.3.20. Trim rates count: with a thesis-damped aileron moving at ``da0'`` the tab's column of Kk
    carries ``1 - da0' sin(dt0) ca/V``. With unsteady damping two lag states follow, which the trim's deflections
    and rates have settled (`lag_states`).

    Parameters
    ----------
    system, condition : the section and its flight condition (*G)
    trim : the point of linearisation (*G); its rates need not vanish

    Returns
    -------
    LinearModel : (*G, ...), input deviations from ``trim.torque``

    Raises
    ------
    ValueError : Mach one and more with the Prandtl-Glauert correction
    """
    scale = system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach)
    gradient = -scale[..., None, None] * _coefficient_gradient(system, condition, trim)
    stiffness, damping, lag_torque = gradient[..., 0:4:2], gradient[..., 1:4:2], gradient[..., 4:]
    inertia = np.broadcast_to(system.moving_inertia(condition), stiffness.shape)
    mobility = np.linalg.inv(inertia)
    unsteady = system.aerodynamics.damping == "unsteady"
    grid, n = stiffness.shape[:-2], 6 if unsteady else 4
    A, B, C = np.zeros((*grid, n, n)), np.zeros((*grid, n, 2)), np.zeros((*grid, 2, n))
    A[..., 0, 1] = A[..., 2, 3] = 1.0
    A[..., 1:4:2, 0:4:2] = mobility @ stiffness
    A[..., 1:4:2, 1:4:2] = mobility @ damping
    A[..., 1:4:2, 4:] = mobility @ lag_torque
    B[..., 1:4:2, :] = mobility
    C[..., :4] = _ANGLES_OF_STATE
    state = trim.state
    if unsteady:
        A[..., 4:, :] = lag_rows(system, condition)
        state = with_settled_lags(system, condition, trim.state)
    return LinearModel(
        A=A,
        B=B,
        C=C,
        D=np.zeros((*grid, 2, 2)),
        state_offset=np.broadcast_to(state, (*grid, n)),
        input_offset=np.broadcast_to(trim.torque, (*grid, 2)),
        inertia=inertia,
        damping=damping,
        stiffness=stiffness,
        lag_torque=lag_torque,
        states=(*STATES, *LAG_STATES) if unsteady else STATES,
    )


def _coefficient_gradient(system: TabAileron, condition: FlightCondition, trim: Trim) -> FloatArray:
    """``dC_H / d[dt, dt', da, da']`` at the trim, and by the lags if there are any, incompressible (*G, 2, n)."""
    angles, motion = trim.state[..., 0::2], _ANGLES_OF_STATE
    if system.aerodynamics.damping == "thesis":
        angles = angles + induced_angles(system.geometry, condition.airspeed, trim.state)
        motion = motion + induced_angle_derivatives(system.geometry, condition.airspeed, trim.state)
    moments = system.aerodynamics.source.at(trim.alpha, angles[..., 0], angles[..., 1])
    by_state = np.asarray(moments.gradient[..., 1:] @ motion)
    if system.aerodynamics.damping != "thesis":
        time = np.asarray(system.geometry.chord / condition.airspeed)[..., None, None]
        rates = time * system.rate_derivatives
        by_state = np.array(np.broadcast_to(by_state, (*rates.shape[:-2], 2, 4)))
        by_state[..., 1::2] += rates
    if system.aerodynamics.damping == "unsteady":
        by_lag = lag_columns(system)
        # What the lags take up, the motion itself does not carry at once.
        missing = np.sum(by_lag, axis=-1)[..., :, None] * incidence_row(system, condition)[..., None, :]
        by_lag = np.broadcast_to(by_lag, (*by_state.shape[:-1], 2))
        by_state = np.concatenate([by_state - missing, by_lag], axis=-1)
    return by_state
