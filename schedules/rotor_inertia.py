"""The rotor of an actuator, seen through its gear: inertia that is carried by the angle of one surface alone (6.3.2).

A rotor behind a gear of ratio n turns n times as fast as its surface turns against what carries the motor. Beside the
section it adds ``n^2 J / 2`` times the square of that rate to the kinetic energy, so that ``n^2 J`` is added to one
entry of the diagonal of the inertia matrix, ``J_tt`` or ``J_aa``. The tab's angle is relative to the aileron: a rotor
is no heavier tab, which would add to all four entries. Left out is ``n J``, by which the motor's case turning with the
aileron acts on the rotor: n times less.

Trim and torques of the air do not depend on inertia, so that the linear models are changed and nothing else.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.loop import Loop
from model.arrays import FloatArray
from model.linear_model import LinearModel
from model.servo_tab import servo_tab
from schedules.analysis import PlantEnvelope

#: Actuator -> its row among the inputs and surfaces.
SURFACES = {"tab": 0, "aileron": 1}


def model_with_rotor(model: LinearModel, actuator: str, inertia: float) -> LinearModel:
    """The linear models with a rotor's inertia on one surface.

    Parameters
    ----------
    model : (*G)
    actuator : ``tab`` or ``aileron``
    inertia : of the rotor at the surface, gear ratio squared included [kg m^2], at least 0
    """
    i = SURFACES[actuator]
    J = model.inertia.copy()
    J[..., i, i] += inertia
    mobility = np.linalg.inv(J)
    A, B = model.A.copy(), model.B.copy()
    A[..., 1:4:2, :] = mobility @ model.air_torque
    B[..., 1:4:2, :] = mobility
    return replace(model, A=A, B=B, inertia=J)


def plant_with_rotor(plant: PlantEnvelope, actuator: str, inertia: float) -> PlantEnvelope:
    """The plant over the grid with a rotor's inertia on one surface; its section is still that without it."""
    ok = plant.outcomes.ok
    model = model_with_rotor(plant.model.take(ok), actuator, inertia)
    return replace(plant, model=model.spread(ok), servo_tab=servo_tab(model).spread(ok))


def without_rotor_torque(loop: Loop, actuator: str, inertia: float) -> Loop:
    """The loop with the torque of an actuator at its surface: less what accelerates the rotor, ``T - J d''``.

    Parameters
    ----------
    loop : with both rates among its states, as every state feedback has them
    actuator : ``tab`` or ``aileron``
    inertia : of the rotor at the surface [kg m^2]
    """
    letter = {"tab": "t", "aileron": "a"}[actuator]
    F: FloatArray = loop.F.copy()
    F[..., loop.outputs.index(f"T_{letter}"), loop.states.index(f"d{letter}_rate")] -= inertia
    return replace(loop, F=F)
