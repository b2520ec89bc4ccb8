"""What is seen of a trajectory: the loop's outputs as totals, and the torques that move the surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.simulation.contact import FASTEST, FREE
from design.simulation.dynamics import Dynamics
from design.simulation.quadrature import derivative
from design.simulation.tab_servo import TabDynamics
from design.simulation.torque_drives import TorqueDynamics
from design.simulation.trajectory import Trajectory
from model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals at the M nodes of a trajectory, totals; surfaces in the order [tab, aileron].

    Attributes
    ----------
    outputs : (M, o, P) those of the loop
    angle, rate, acceleration : (M, 2, P) of the surfaces
    torque : (M, 2, P) of the actuators on the surfaces [N m]
    driven_rate, driven_angle : (M, 2, P) of what the actuators move: of a tab on a link the actuator's own
    air, friction : (M, 2, P) torques of the air, and of sliding friction [N m]
    """

    outputs: FloatArray
    angle: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    torque: FloatArray
    driven_angle: FloatArray
    driven_rate: FloatArray
    air: FloatArray
    friction: FloatArray


def signals(dynamics: Dynamics, found: Trajectory) -> Signals:
    """Signals of a trajectory of the same dynamics."""
    x, rates = (np.moveaxis(each, 1, 0) for each in (found.states, found.rates))
    at, plant = dynamics.at, dynamics.flown.plant
    tab_rate = x[at["dt_rate"]] if "dt_rate" in at else rates[at["dt"]]
    second = rates[at["dt_rate"]] if "dt_rate" in at else derivative(found.time, found.segment, tab_rate)
    angle = np.stack([x[at["dt"]], x[at["da"]]], axis=1) + plant.angles.T
    rate = np.stack([tab_rate, x[at["da_rate"]]], axis=1)
    acceleration = np.stack([second, rates[at["da_rate"]]], axis=1)
    air = _air(dynamics, x, tab_rate)
    if isinstance(dynamics, TorqueDynamics):
        torque = dynamics.applied(found.states, found.commands)
        torque += np.where(found.mode >= FASTEST, found.holding, 0.0)
        driven = angle, rate
    else:
        assert isinstance(dynamics, TabDynamics)
        torque = _with_imposed_tab(dynamics, x, rates, tab_rate, acceleration)
        driven = _driven(dynamics, x, rates, angle, rate)
    friction = _friction(dynamics, found, rate)
    outputs = _outputs(dynamics, found, angle, rate, torque, driven)
    return Signals(outputs, angle, rate, acceleration, torque, *driven, air, friction)


def _air(dynamics: Dynamics, x: FloatArray, tab_rate: FloatArray) -> FloatArray:
    """(M, 2, P) torques of the air: what the trim torques hold, the linear part, and what is beyond it."""
    model, at = dynamics.flown.plant.model, dynamics.at
    motion = np.stack([tab_rate if name == "dt_rate" else x[at[name]] for name in model.states])
    linear = np.einsum("pij,jmp->mip", model.air_torque, motion)
    beyond = np.moveaxis(dynamics.beyond_linear(x, tab_rate), 0, 1)
    return np.asarray(linear + beyond - model.input_offset.T)


def _with_imposed_tab(
    dynamics: TabDynamics, x: FloatArray, rates: FloatArray, tab_rate: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """(M, 2, P) torque of the tab by inverse dynamics, or of its link, and the trim torque that holds the aileron."""
    if dynamics.linked:
        tab = dynamics.link_torque(x, rates[dynamics.servo.angle])
    else:
        tab = dynamics.required_torque(x, tab_rate, np.moveaxis(acceleration, 1, 0))
    return np.stack([tab, np.broadcast_to(dynamics.trim_torque[1], tab.shape)], axis=1)


def _driven(
    dynamics: TabDynamics, x: FloatArray, rates: FloatArray, angle: FloatArray, rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Angles and rates (M, 2, P) of what the actuators move."""
    if not dynamics.linked:
        return angle, rate
    own = x[dynamics.servo.angle] + dynamics.flown.plant.angles[:, 0] + dynamics.trim_stretch
    moved = rates[dynamics.servo.angle]
    return np.stack([own, angle[:, 1]], axis=1), np.stack([moved, rate[:, 1]], axis=1)


def _friction(dynamics: Dynamics, found: Trajectory, rate: FloatArray) -> FloatArray:
    """(M, 2, P) torque of sliding friction; a tab whose motion is imposed overcomes its own all the same."""
    sliding = (found.mode == FREE) | (found.mode >= FASTEST)
    friction = np.where(sliding, -dynamics.holders.kinetic * found.slide, 0.0)
    if isinstance(dynamics, TabDynamics):
        friction[:, 0] = -dynamics.own_friction * np.sign(rate[:, 0])
    return np.asarray(friction)


def _outputs(
    dynamics: Dynamics,
    found: Trajectory,
    angle: FloatArray,
    rate: FloatArray,
    torque: FloatArray,
    driven: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """(M, o, P) in the loop's order; what is no angle, rate or torque is a row of the loop's C and D."""
    loop = dynamics.flown.loop
    by_name = {
        "dt": angle[:, 0], "da": angle[:, 1], "dt_rate": rate[:, 0], "da_rate": rate[:, 1],
        "T_t": torque[:, 0], "T_a": torque[:, 1], "dt_actuator": driven[0][:, 0], "dt_actuator_rate": driven[1][:, 0],
    }  # fmt: skip
    outputs = np.empty((len(found.time), len(loop.outputs), dynamics.points))
    for row, name in enumerate(loop.outputs):
        if name in by_name:
            outputs[:, row] = by_name[name]
        else:
            outputs[:, row] = np.einsum("pj,mjp->mp", loop.C[:, row], found.states)
            outputs[:, row] += np.einsum("pj,mjp->mp", loop.D[:, row], found.commands) + loop.offset[:, row]
    return outputs
