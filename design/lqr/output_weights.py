"""Weights of named outputs: ``int( y'W_y y + u'W_u u ) dt`` with ``y = C x + D u`` (seed 5.1).

In states and inputs that is ``Q = C'W_y C``, ``R = W_u + D'W_y D``, ``N = C'W_y D``. What can be weighed:

============================== ====================================================================
any state of the structure     ``dt dt_rate da da_rate int_a int_t tab_torque lag_1 ..``
``da_error dt_error``          ``r_a - da`` and ``r_t - dt``
``dt_acceleration ..``         ``dt''`` and ``da''`` [rad/s^2], of the equations of motion
``T_t T_a``                    the torques on the surfaces from trim [N m], behind what lags them
``T_t_command T_a_command``    the commanded torques u [N m]
============================== ====================================================================
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.pade import delay_chain
from design.lqr.structures import FOLLOWED
from design.lqr.tracking import TrackingPlant
from design.lqr.weights import WeightsRefused, check_definite, check_semidefinite
from model.arrays import FloatArray

_COMMANDS = ("T_t_command", "T_a_command")
_TORQUES = ("T_t", "T_a")
_ACCELERATIONS = {"dt_acceleration": "dt_rate", "da_acceleration": "da_rate"}


@dataclass(frozen=True, eq=False)
class OutputWeights:
    """Weights of outputs and inputs, in SI and radians.

    Attributes
    ----------
    outputs : names, see the module
    W_y : (k, k) weight of the outputs, symmetric, positive semidefinite
    W_u : (2, 2) weight of the commands, symmetric, positive definite
    """

    outputs: tuple[str, ...]
    W_y: FloatArray
    W_u: FloatArray

    def __post_init__(self) -> None:
        for name in ("W_y", "W_u"):
            matrix = np.array(getattr(self, name), dtype=float)
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)


@dataclass(frozen=True, eq=False)
class OutputMap:
    """``y = C x + D u``, C (*G, k, n) and D (*G, k, 2)."""

    C: FloatArray
    D: FloatArray


def output_map(outputs: tuple[str, ...], plant: TrackingPlant) -> OutputMap:
    """Rows of named outputs.

    Raises
    ------
    WeightsRefused : there is no such output
    """
    *grid, n, m = plant.B.shape
    C, D = np.zeros((*grid, len(outputs), n)), np.zeros((*grid, len(outputs), m))
    errors = {f"{FOLLOWED[name]}_error": FOLLOWED[name] for name in plant.structure.references}
    for row, name in enumerate(outputs):
        if name in plant.states:
            C[..., row, plant.states.index(name)] = 1.0
        elif name in errors:
            C[..., row, plant.states.index(errors[name])] = -1.0
        elif name in _ACCELERATIONS:
            of = plant.states.index(_ACCELERATIONS[name])
            C[..., row, :], D[..., row, :] = plant.A[..., of, :], plant.B[..., of, :]
        elif name in _COMMANDS:
            D[..., row, _COMMANDS.index(name)] = 1.0
        elif name in _TORQUES:
            _add_torque(C, D, row, _TORQUES.index(name), plant)
        else:
            known = (*plant.states, *errors, *_ACCELERATIONS, *_TORQUES, *_COMMANDS)
            raise WeightsRefused("W_y", None, f"there is no output {name!r} to weigh; there are {' '.join(known)}")
    return OutputMap(C, D)


def _add_torque(C: FloatArray, D: FloatArray, row: int, i: int, plant: TrackingPlant) -> None:
    """The torque of an actuator: a state behind a lag, what comes out of a delay, or the command."""
    drive = plant.structure.drives[i]
    if drive.torque_state is not None:
        C[..., row, plant.states.index(drive.torque_state)] = 1.0
    elif drive.chain:
        held = [plant.states.index(name) for name in drive.chain]
        C[..., row, held] = delay_chain(drive.delay_states).c
    else:
        D[..., row, i] = 1.0


def check_output_weights(weights: OutputWeights) -> None:
    """Refuse weights that are no quadratic form of the outputs, or leave a command without a weight.

    Raises
    ------
    WeightsRefused : names ``W_y`` or ``W_u``, and the eigenvalue
    """
    k = len(weights.outputs)
    if weights.W_y.shape != (k, k):
        said = f"W_y has shape {weights.W_y.shape}: expected {(k, k)}, over the outputs {' '.join(weights.outputs)}"
        raise WeightsRefused("W_y", None, said)
    check_semidefinite(weights.W_y, (k, k), "W_y")
    check_definite(weights.W_u, (len(_COMMANDS), len(_COMMANDS)), "W_u")
