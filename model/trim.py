"""Trim: the angles a condition is held at, and the torques that hold them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays
from model.flight import FlightCondition
from model.hinge_moments.expansion import HingeMomentSource
from model.motion import required_torque
from model.system import TabAileron

#: A solved trim angle beyond this is no trim: the surface would stand across the flow [rad].
LARGEST_TRIM_ANGLE = np.pi / 2.0
_NEWTON_STEPS = 50
_ANGLE_TOLERANCE = 1e-12  # [rad]


@dataclass(frozen=True)
class TrimRequest:
    """What to hold: incidence and deflections [rad].

    Attributes
    ----------
    alpha : incidence [rad]
    aileron : aileron angle [rad]
    tab : tab angle relative to the aileron [rad], or ``zero_aileron_torque``: the tab angle at which the
        aileron floats at its angle without any torque from its actuator

    Raises
    ------
    ValueError : an angle that is not finite, or an unknown word
    """

    alpha: float
    aileron: float = 0.0
    tab: float | Literal["zero_aileron_torque"] = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.tab, str) and self.tab != "zero_aileron_torque":
            raise ValueError(f"tab must be an angle [rad] or 'zero_aileron_torque', not {self.tab!r}")
        angles = [self.alpha, self.aileron] + ([] if isinstance(self.tab, str) else [self.tab])
        if not np.all(np.isfinite(angles)):
            raise ValueError("trim angles must be finite [rad]")


@dataclass(frozen=True, eq=False)
class Trim(GridArrays):
    """The trim at every point of the grid.

    Attributes
    ----------
    alpha : (*G,) incidence [rad]
    state : (*G, 4) ``[dt, dt', da, da']``, rates zero [rad], [rad/s]
    torque : (*G, 2) holding torques, order [tab, aileron] [N m]
    residual : (*G,) largest torque left out of balance [N m]
    reached : (*G,) bool, False where no tab angle within `LARGEST_TRIM_ANGLE` does what was asked for;
        state and residual then show the nearest that was found
    """

    alpha: FloatArray
    state: FloatArray
    torque: FloatArray
    residual: FloatArray
    reached: BoolArray


def trim(system: TabAileron, condition: FlightCondition, request: TrimRequest) -> Trim:
    """Trim a section at every point of the grid (*G)."""
    if isinstance(request.tab, str):
        tab, reached = _zero_aileron_torque(system.aerodynamics.source, request.alpha, request.aileron)
    else:
        tab, reached = np.asarray(request.tab, float), np.asarray(True)
    shape = np.broadcast_shapes(system.hinge_load(condition).shape, tab.shape)
    state = np.zeros((*shape, 4))
    state[..., 0], state[..., 2] = tab, request.aileron
    needed = required_torque(system, condition, request.alpha, state, np.zeros(2))
    torque = needed.copy()
    if isinstance(request.tab, str):
        torque[..., 1] = 0.0
    return Trim(
        alpha=np.full(shape, float(request.alpha)),
        state=state,
        torque=torque,
        residual=np.max(np.abs(torque - needed), axis=-1, keepdims=True)[..., 0],
        reached=np.broadcast_to(reached, shape),
    )


def _zero_aileron_torque(source: HingeMomentSource, alpha: float, aileron: float) -> tuple[FloatArray, BoolArray]:
    """Tab angle (*H,) at which ``C_Ha`` vanishes, by Newton's method, and whether it was found.

    Points that have converged stay where they are, so each takes the same way alone as in company.
    """
    tab = np.zeros(source.at(alpha, 0.0, aileron).value.shape[:-1])
    moving = np.ones(tab.shape, dtype=bool)
    for _ in range(_NEWTON_STEPS):
        step = _newton_step(source, alpha, tab, aileron)
        new = np.clip(tab + np.where(np.isfinite(step), step, 0.0), -LARGEST_TRIM_ANGLE, LARGEST_TRIM_ANGLE)
        moved = moving & (np.abs(new - tab) > _ANGLE_TOLERANCE)
        tab = np.where(moving, new, tab)
        moving = moved
        if not np.any(moving):
            break
    left = _newton_step(source, alpha, tab, aileron)
    return np.asarray(tab), np.asarray(np.abs(left) <= 100.0 * _ANGLE_TOLERANCE)


def _newton_step(source: HingeMomentSource, alpha: float, tab: FloatArray, aileron: float) -> FloatArray:
    """``-C_Ha / C_Ha,dt`` (*H,) [rad]; infinite where the tab has no hold on the aileron."""
    moments = source.at(alpha, tab, aileron)
    value, slope = moments.value[..., 1], moments.gradient[..., 1, 1]
    held = slope != 0.0
    step = -value / np.where(held, slope, 1.0)
    return np.asarray(np.where(held | (value == 0.0), step, np.inf))
