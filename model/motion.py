"""The non-linear equations of motion ``J d'' + q c^2 s C_H = T`` (seed 2.2.17), and their inverse."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, Floats
from model.flight import FlightCondition
from model.induced_angles import induced_angles
from model.system import TabAileron


def aerodynamic_torque(system: TabAileron, condition: FlightCondition, alpha: Floats, state: FloatArray) -> FloatArray:
    """Torque of the air about each hinge, ``-q c^2 s C_H``, without virtual inertia.

    Parameters
    ----------
    system, condition : the section and its flight condition (*G)
    alpha : incidence (*G,) [rad]
    state : ``[dt, dt', da, da']`` (*G, 4) [rad], [rad/s]

    Returns
    -------
    (*G, 2) array, order [tab, aileron] [N m], positive in the positive sense of the angles
    """
    state = np.asarray(state, float)
    angles, rates = state[..., 0::2], state[..., 1::2]
    if system.aerodynamics.damping == "thesis":
        angles = angles + induced_angles(system.geometry, condition.airspeed, state)
    moments = system.aerodynamics.source.at(alpha, angles[..., 0], angles[..., 1])
    coefficients = moments.value
    if system.aerodynamics.damping == "quasi_steady":
        reduced = rates * np.asarray(system.geometry.chord / condition.airspeed)[..., None]
        coefficients = coefficients + np.sum(system.rate_derivatives * reduced[..., None, :], axis=-1)
    scale = system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach)
    return np.asarray(-scale[..., None] * coefficients)


def acceleration(
    system: TabAileron, condition: FlightCondition, alpha: Floats, state: FloatArray, torque: FloatArray
) -> FloatArray:
    """Angular accelerations under actuator torques; arguments broadcast over the grid.

    Parameters
    ----------
    alpha : incidence (*G,) [rad]
    state : ``[dt, dt', da, da']`` (*G, 4)
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
