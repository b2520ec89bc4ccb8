"""Where the work goes: kinetic energy, and the work of actuators, air and friction, over the grid and time.

Of surfaces that start from rest

    kinetic = actuators + air + friction + reaction - stops

up to the error of the integration, which `residual` shows. `reaction` is the work of ``J_ta dt''`` on the aileron,
which the servo-tab model of a tab-only loop leaves out (seed 2.3.21); elsewhere it is zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.simulation.dynamics import Dynamics
from design.simulation.quadrature import running_integral
from design.simulation.signals import Signals
from design.simulation.torque_drives import TorqueDynamics
from design.simulation.trajectory import Trajectory
from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class EnergyBalance(GridArrays):
    """Energies since t = 0 at the samples, each [J].

    Attributes
    ----------
    kinetic : (*G, T) of both surfaces, virtual inertia included
    actuators : (*G, T, 2) work of the actuators on the surfaces, order [tab, aileron]
    air : (*G, T, 2) work of the air on the surfaces
    friction : (*G, T) work of friction, at most 0
    reaction : (*G, T) work that the servo-tab model leaves out
    stops : (*G, T) energy that stops have taken
    """

    kinetic: FloatArray
    actuators: FloatArray
    air: FloatArray
    friction: FloatArray
    reaction: FloatArray
    stops: FloatArray

    @property
    def residual(self) -> FloatArray:
        """What the balance leaves (*G, T) [J]: the error of integration and quadrature."""
        work = self.actuators.sum(axis=-1) + self.air.sum(axis=-1) + self.friction + self.reaction - self.stops
        return np.asarray(self.kinetic - work)


def energy_balance(dynamics: Dynamics, found: Trajectory, seen: Signals) -> EnergyBalance:
    """The balance of P points at the samples of a trajectory."""
    J = np.moveaxis(dynamics.flown.plant.model.inertia, 0, -1)
    rate = seen.rate
    kinetic = 0.5 * np.einsum("mip,ijp,mjp->mp", rate, J, rate)
    reaction = J[0, 1] * seen.acceleration[:, 0] * rate[:, 1]
    if isinstance(dynamics, TorqueDynamics):
        reaction = np.zeros_like(reaction)
    powers = np.concatenate(
        [seen.torque * rate, seen.air * rate, np.sum(seen.friction * rate, axis=1)[:, None], reaction[:, None]], axis=1
    )
    work = running_integral(found.time, found.segment, powers)[found.sampled]
    last = np.moveaxis(work, -1, 0)
    return EnergyBalance(
        kinetic=kinetic[found.sampled].T, actuators=last[..., :2], air=last[..., 2:4], friction=last[..., 4],
        reaction=last[..., 5], stops=found.stop_loss[found.sampled].T,
    )  # fmt: skip
