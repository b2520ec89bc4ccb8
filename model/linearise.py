"""Linearisation of the equations of motion about a trim, by analytic derivatives (seed 2.3.7 to 2.3.20)."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray
from model.flight import FlightCondition
from model.induced_angles import induced_angle_derivatives, induced_angles
from model.linear_model import LinearModel
from model.system import TabAileron
from model.trim import Trim

# How the angles [dt, da] sit in the state [dt, dt', da, da'].
_ANGLES_OF_STATE = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])


def linearise(system: TabAileron, condition: FlightCondition, trim: Trim) -> LinearModel:
    """Linear model in deviations from `trim`, at every point of the grid.

    ``J d'' = Bk d' + Kk d + T`` (seed 2.3.7) with ``Kk = -q c^2 s dC_H/d(angles)`` and
    ``Bk = -q c^2 s dC_H/d(rates)`` (seed 2.3.8 to 2.3.15, the span added); then the state-space form of
    seed 2.3.20. Trim rates count: with a thesis-damped aileron moving at ``da0'`` the tab's column of Kk
    carries ``1 - da0' sin(dt0) ca/V``.

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
    stiffness, damping = gradient[..., :, 0::2], gradient[..., :, 1::2]
    inertia = np.broadcast_to(system.moving_inertia(condition), stiffness.shape)
    mobility = np.linalg.inv(inertia)
    grid = stiffness.shape[:-2]
    A, B = np.zeros((*grid, 4, 4)), np.zeros((*grid, 4, 2))
    A[..., 0, 1] = A[..., 2, 3] = 1.0
    A[..., 1::2, 0::2] = mobility @ stiffness
    A[..., 1::2, 1::2] = mobility @ damping
    B[..., 1::2, :] = mobility
    return LinearModel(
        A=A,
        B=B,
        C=np.broadcast_to(_ANGLES_OF_STATE, (*grid, 2, 4)),
        D=np.zeros((*grid, 2, 2)),
        state_offset=np.broadcast_to(trim.state, (*grid, 4)),
        input_offset=np.broadcast_to(trim.torque, (*grid, 2)),
        inertia=inertia,
        damping=damping,
        stiffness=stiffness,
    )


def _coefficient_gradient(system: TabAileron, condition: FlightCondition, trim: Trim) -> FloatArray:
    """``dC_H / d[dt, dt', da, da']`` at the trim, incompressible (*G, 2, 4)."""
    angles, motion = trim.state[..., 0::2], _ANGLES_OF_STATE
    if system.aerodynamics.damping == "thesis":
        angles = angles + induced_angles(system.geometry, condition.airspeed, trim.state)
        motion = motion + induced_angle_derivatives(system.geometry, condition.airspeed, trim.state)
    moments = system.aerodynamics.source.at(trim.alpha, angles[..., 0], angles[..., 1])
    by_state = np.asarray(moments.gradient[..., 1:] @ motion)
    if system.aerodynamics.damping == "quasi_steady":
        time = np.asarray(system.geometry.chord / condition.airspeed)[..., None, None]
        rates = time * system.rate_derivatives
        by_state = np.array(np.broadcast_to(by_state, (*rates.shape[:-2], 2, 4)))
        by_state[..., 1::2] += rates
    return by_state
