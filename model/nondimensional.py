"""The linear model without dimensions: time in chords of air or in periods of the servo tab (seed 4.4, 7.6).

With time in ``tau`` and torque in ``T0``, angles as they are, the states are ``[dt, tau dt', da, tau da']`` and

    A^ = tau S A S^-1,  B^ = tau S B T0,  S = diag(1, tau, 1, tau).

In units of ``tau = c/V`` and ``T0 = q c^2 s`` the stiffness ``-C_hf / m`` and the damping ``-D_hf / m`` are pure
aerodynamic coefficients over mass ratios ``m = J / (rho c^4 s / 2)``: neither dynamic pressure nor airspeed is left,
only density (and Mach number). In units of ``1/omega_n`` the servo tab's stiffness is one and its damping 2 zeta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, GridArrays
from model.flight import FlightCondition
from model.linear_model import LinearModel
from model.servo_tab import ServoTab
from model.system import TabAileron


@dataclass(frozen=True, eq=False)
class NondimensionalModel(GridArrays):
    """``dx/dtheta = A x + B u`` with ``theta = t / time_unit`` and torques in `torque_unit`, over the grid.

    Attributes
    ----------
    A : (*G, n, n), B : (*G, n, 2) [-]; angles in radians, rates in radians per time unit
    time_unit : (*G,) [s]
    torque_unit : (*G,) [N m]
    states, inputs : names, as in the model it came from
    """

    A: FloatArray
    B: FloatArray
    time_unit: FloatArray
    torque_unit: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]


def nondimensional(model: LinearModel, time_unit: FloatArray, torque_unit: FloatArray) -> NondimensionalModel:
    """The model in given units (*G,) [s], [N m]; its eigenvalues are the old ones times the time unit.

    States whose names end in ``_rate`` are rates; others keep their unit.
    """
    time, torque = np.asarray(time_unit, float), np.asarray(torque_unit, float)
    rate = np.array([name.endswith("_rate") for name in model.states])
    scale = np.where(rate, time[..., None], 1.0)
    A = time[..., None, None] * scale[..., :, None] * model.A / scale[..., None, :]
    B = (time * torque)[..., None, None] * scale[..., :, None] * model.B
    grid = A.shape[:-2]
    return NondimensionalModel(
        A, B, np.broadcast_to(time, grid), np.broadcast_to(torque, grid), model.states, model.inputs
    )


def aerodynamic_time(system: TabAileron, condition: FlightCondition) -> FloatArray:
    """Time in which the air passes a wing chord, ``c/V`` (*G,) [s]."""
    return np.asarray(system.geometry.chord / condition.airspeed)


def servo_time(servo: ServoTab) -> FloatArray:
    """``1/omega_n`` of the servo tab (*G,) [s]; nan where the aileron's stiffness does not restore."""
    return np.asarray(1.0 / servo.natural_frequency)
