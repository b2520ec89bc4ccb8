"""The non-linear equations of motion ``J d'' + q c^2 s C_H = T`` (seed 2.2.17), and their inverse.

A state is ``[dt, dt', da, da']`` [rad], [rad/s]; with unsteady damping ``lag_1, lag_2`` [rad] may follow, whose own
equation is `lag_states.lag_rates`. Without them the circulation is taken as settled, C(k) = 1, as it is at rest.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, Floats
from model.flight import FlightCondition
from model.induced_angles import induced_angles
from model.lag_states import lag_coefficients
from model.system import TabAileron


def aerodynamic_torque(system: TabAileron, condition: FlightCondition, alpha: Floats, state: FloatArray) -> FloatArray:
    """Torque of the air about each hinge, ``-q c^2 s C_H``, without virtual inertia.

    Parameters
    ----------
    system, condition : the section and its flight condition (*G)
    alpha : incidence (*G,) [rad]
    state : (*G, 4), or (*G, 6) with lag states [rad], [rad/s]

    Returns
    -------
    (*G, 2) array, order [tab, aileron] [N m], positive in the positive sense of the angles

    Raises
    ------
    ValueError : lag states without unsteady damping, or a state of another length
    """
    state = np.asarray(state, float)
    lagging = state.shape[-1] == 6
    if state.shape[-1] not in (4, 6) or (lagging and system.aerodynamics.damping != "unsteady"):
        raise ValueError(
            f"a state of {state.shape[-1]} numbers with damping {system.aerodynamics.damping!r}: expected dt, dt_rate, "
            "da, da_rate, and only with unsteady damping lag_1, lag_2"
        )
    angles, rates = state[..., 0:4:2], state[..., 1:4:2]
    if system.aerodynamics.damping == "thesis":
        angles = angles + induced_angles(system.geometry, condition.airspeed, state)
    moments = system.aerodynamics.source.at(alpha, angles[..., 0], angles[..., 1])
    coefficients = moments.value
    if system.aerodynamics.damping != "thesis":
        reduced = rates * np.asarray(system.geometry.chord / condition.airspeed)[..., None]
        coefficients = coefficients + np.sum(system.rate_derivatives * reduced[..., None, :], axis=-1)
    if lagging:
        coefficients = coefficients + lag_coefficients(system, condition, state)
    scale = system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach)
    return np.asarray(-scale[..., None] * coefficients)


def acceleration(
    system: TabAileron, condition: FlightCondition, alpha: Floats, state: FloatArray, torque: FloatArray
) -> FloatArray:
    """Angular accelerations under actuator torques; arguments broadcast over the grid.

    Parameters
    ----------
    alpha : incidence (*G,) [rad]
    state : (*G, 4), or (*G, 6) with lag states
    torque : actuator torques (*G, 2), order [tab, aileron] [N m]

    Returns
    -------
    (*G, 2) array ``[dt'', da'']`` [rad/s^2]
    """
    total = torque + aerodynamic_torque(system, condition, alpha, state)
    return np.asarray(np.linalg.solve(system.moving_inertia(condition), total[..., None])[..., 0])


def required_torque(
    system: TabAileron, condition: FlightCondition, alpha: Floats, state: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """Inverse dynamics: actuator torques (*G, 2) [N m] that give accelerations ``[dt'', da'']`` (*G, 2)."""
    inertial = np.sum(system.moving_inertia(condition) * np.asarray(acceleration)[..., None, :], axis=-1)
    return np.asarray(inertial - aerodynamic_torque(system, condition, alpha, state))
