"""Trim: the angles a condition is held at, and the torques that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats, GridArrays, ObjectArray
from model.flight import FlightCondition
from model.motion import required_torque
from model.system import TabAileron
from model.trim_angles import solved_angles
from model.trim_request import LARGEST_TRIM_ANGLE as LARGEST_TRIM_ANGLE
from model.trim_request import HeldTorque as HeldTorque
from model.trim_request import TrimRequest as TrimRequest


@dataclass(frozen=True, eq=False)
class Trim(GridArrays):
    """The trim at every point of the grid.

    Attributes
    ----------
    alpha : (*G,) incidence [rad]
    state : (*G, 4) ``[dt, dt', da, da']``, rates zero [rad], [rad/s]
    torque : (*G, 2) holding torques, order [tab, aileron] [N m]; one that was asked for is the one asked for
    residual : (*G,) largest torque left out of balance [N m]
    reached : (*G,) bool, False where no angle within the request's limits and the source's domain does what was
        asked for; state and residual then show the nearest that was found
    reason : (*G,) object, words where not reached: which equation, which limit, what is left; else None
    """

    alpha: FloatArray
    state: FloatArray
    torque: FloatArray
    residual: FloatArray
    reached: BoolArray
    reason: ObjectArray


def trim(system: TabAileron, condition: FlightCondition, request: TrimRequest) -> Trim:
    """Trim a section at every point of the grid (*G).

    One solved angle is the solution nearest to neutral; two are the solution that Newton's method finds from there
    (README, decision 14).

    Raises
    ------
    ValueError : Mach one and more with the Prandtl-Glauert correction
    """
    load = np.asarray(system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach))
    angles = solved_angles(system.aerodynamics.source, request, load)
    shape = np.broadcast_shapes(load.shape, np.shape(request.alpha), angles.tab.shape)
    state = np.zeros((*shape, 4))
    state[..., 0], state[..., 2] = angles.tab, angles.aileron
    needed = required_torque(system, condition, request.alpha, state, np.zeros(2))
    torque = needed.copy()
    for held in (request.tab_torque, request.aileron_torque):
        if held is not None:
            torque[..., 0 if held.surface == "tab" else 1] = held.torque
    reached = np.broadcast_to(angles.found, shape)
    residual = np.max(np.abs(torque - needed), axis=-1, keepdims=True)[..., 0]
    return Trim(
        alpha=np.array(np.broadcast_to(request.alpha, shape), float),
        state=state,
        torque=torque,
        residual=residual,
        reached=reached,
        reason=_reasons(system.aerodynamics.source.domain, request, state, residual, reached),
    )


def _reasons(
    domain: str, request: TrimRequest, state: FloatArray, residual: FloatArray, reached: BoolArray
) -> ObjectArray:
    """Words (*G,) at the points that were not reached, None elsewhere."""
    reasons = np.full(reached.shape, None, dtype=object)
    known = "" if domain == "every angle" else f"; hinge moments are known for {domain}"
    for row in np.argwhere(~reached):
        index = tuple(int(i) for i in row)
        nearest = f"tab {_degrees(state[index][0])}, aileron {_degrees(state[index][2])}"
        reasons[index] = (
            f"{_equation(request, reached.shape, index)}: no {_unknowns(request)} does it; the nearest found, "
            f"{nearest}, leaves {residual[index]:.4g} N m{known}"
        )
    return reasons


def _equation(request: TrimRequest, shape: tuple[int, ...], index: tuple[int, ...]) -> str:
    """What was asked for at a point, in words."""
    asked = [
        f"{held.surface} torque of {_at(held.torque, shape, index):.4g} N m"
        for held in (request.tab_torque, request.aileron_torque)
        if held is not None
    ]
    return " and ".join(asked) or "least torque"


def _unknowns(request: TrimRequest) -> str:
    """The angles that were free, with their limits."""
    free = []
    if isinstance(request.tab, str | HeldTorque):
        free.append(f"tab angle within +-{_degrees(request.tab_limit)}")
    if isinstance(request.aileron, str | HeldTorque):
        free.append(f"aileron angle within +-{_degrees(request.aileron_limit)}")
    return " with an ".join(free)


def _at(value: Floats, shape: tuple[int, ...], index: tuple[int, ...]) -> float:
    return float(np.broadcast_to(value, shape)[index])


def _degrees(angle: float) -> str:
    return f"{np.rad2deg(angle):.4g} deg"
