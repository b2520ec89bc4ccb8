"""The angles of a trim: given ones, and those that follow from a torque that is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats, GridArrays
from model.hinge_moments.expansion import HingeMomentSource
from model.solve_angle import ANGLE_TOLERANCE, Equation, EquationAt, least_angle, solve_angle
from model.trim_request import HeldTorque, Surface, TrimRequest

_ROW: dict[Surface, int] = {"tab": 0, "aileron": 1}
_PAIR_STEPS = 50


@dataclass(frozen=True, eq=False)
class TrimAngles(GridArrays):
    """Tab and aileron angles (*S,) [rad], and whether they do what was asked for."""

    tab: FloatArray
    aileron: FloatArray
    found: BoolArray


def solved_angles(source: HingeMomentSource, request: TrimRequest, load: FloatArray) -> TrimAngles:
    """Angles of a trim (*S,).

    Parameters
    ----------
    source : hinge moments, incompressible
    request : what to hold
    load : torque of a unit coefficient (*G,) [N m]. S is G only where a torque other than zero is held: an angle
        at which a torque vanishes is the same at every dynamic pressure
    """
    tab, aileron = request.tab_torque, request.aileron_torque
    if tab is not None and aileron is not None:
        return _pair(source, request, (tab, aileron), load)
    if tab is not None:
        given = _angle(request.aileron)
        equation = torque_equation(source, request.alpha, "tab", given, tab.surface, _coefficient(tab, load))
        shape = equation(np.zeros(_shape(request.alpha, given, load, tab))).value.shape
        solved = solve_angle(equation, shape, request.tab_limit)
        return TrimAngles(solved.angle, np.broadcast_to(given, shape), solved.found)
    if aileron is not None:
        given = _angle(request.tab)
        wanted = _coefficient(aileron, load)
        equation = torque_equation(source, request.alpha, "aileron", given, aileron.surface, wanted)
        shape = equation(np.zeros(_shape(request.alpha, given, load, aileron))).value.shape
        solved = solve_angle(equation, shape, request.aileron_limit)
        return TrimAngles(np.broadcast_to(given, shape), solved.angle, solved.found)
    if isinstance(request.tab, str):
        return _least_torque(source, request)
    both = np.broadcast_arrays(np.asarray(request.tab, float), _angle(request.aileron))
    return TrimAngles(both[0], both[1], np.ones(both[0].shape, dtype=bool))


def torque_equation(
    source: HingeMomentSource, alpha: Floats, unknown: Surface, other: Floats, surface: Surface, wanted: Floats
) -> Equation:
    """``C_H`` of `surface` minus `wanted`, as an equation for the angle of `unknown`; `other` is the other angle."""
    row, column = _ROW[surface], 1 + _ROW[unknown]

    def equation(angle: FloatArray) -> EquationAt:
        dt, da = (angle, other) if unknown == "tab" else (other, angle)
        moments = source.at(alpha, dt, da)
        value = np.asarray(moments.value[..., row] - wanted)
        slope, covered = moments.gradient[..., row, column], source.covers(alpha, dt, da)
        return EquationAt(value, np.broadcast_to(slope, value.shape), np.broadcast_to(covered, value.shape))

    return equation


def _least_torque(source: HingeMomentSource, request: TrimRequest) -> TrimAngles:
    """Tab angle (*S,) that makes ``T_t^2 + T_a^2`` least, the aileron's angle being given."""
    alpha, aileron = request.alpha, _angle(request.aileron)

    def size(tab: FloatArray) -> FloatArray:
        squares = np.sum(source.at(alpha, tab, aileron).value ** 2, axis=-1)
        return np.asarray(np.where(source.covers(alpha, tab, aileron), squares, np.inf))

    def stationary(tab: FloatArray) -> EquationAt:
        moments = source.at(alpha, tab, aileron)
        by_tab = moments.gradient[..., 1]
        value = np.asarray(np.sum(moments.value * by_tab, axis=-1))
        # The slope without the source's curvature: exact for a linear source, never negative.
        slope, covered = np.sum(by_tab**2, axis=-1), source.covers(alpha, tab, aileron)
        return EquationAt(value, np.broadcast_to(slope, value.shape), np.broadcast_to(covered, value.shape))

    shape = stationary(np.zeros(np.broadcast_shapes(np.shape(alpha), aileron.shape))).value.shape
    solved = least_angle(size, stationary, shape, request.tab_limit)
    return TrimAngles(solved.angle, np.broadcast_to(aileron, shape), solved.found)


def _pair(
    source: HingeMomentSource, request: TrimRequest, held: tuple[HeldTorque, HeldTorque], load: FloatArray
) -> TrimAngles:
    """Both angles (*S,) from both torques, by Newton's method from neutral, kept within the limits.

    Points that have converged stay where they are, so each takes the same way alone as in company.
    """
    wanted = np.stack(np.broadcast_arrays(*(_coefficient(h, load) for h in held)), axis=-1)
    rows = [_ROW[h.surface] for h in held]
    neutral = np.zeros(np.broadcast_shapes(np.shape(request.alpha), wanted.shape[:-1]))
    shape = source.at(request.alpha, neutral, neutral).value.shape[:-1]
    limits = np.array([request.tab_limit, request.aileron_limit])
    angles, moving = np.zeros((*shape, 2)), np.ones(shape, dtype=bool)
    for _ in range(_PAIR_STEPS):
        step = _pair_step(source, request.alpha, angles, rows, wanted)
        new = np.clip(angles + np.where(np.isfinite(step), step, 0.0), -limits, limits)
        moved = moving & (np.max(np.abs(new - angles), axis=-1) > ANGLE_TOLERANCE)
        angles = np.where(moving[..., None], new, angles)
        moving = moved
        if not np.any(moving):
            break
    left = np.max(np.abs(_pair_step(source, request.alpha, angles, rows, wanted)), axis=-1)
    covered = source.covers(request.alpha, angles[..., 0], angles[..., 1])
    return TrimAngles(angles[..., 0], angles[..., 1], np.asarray((left <= 100.0 * ANGLE_TOLERANCE) & covered))


def _pair_step(
    source: HingeMomentSource, alpha: Floats, angles: FloatArray, rows: list[int], wanted: FloatArray
) -> FloatArray:
    """Newton's step (*S, 2) [tab, aileron]; infinite where the two equations do not fix both angles."""
    moments = source.at(alpha, angles[..., 0], angles[..., 1])
    value, slope = moments.value[..., rows] - wanted, moments.gradient[..., rows, 1:]
    determinant = slope[..., 0, 0] * slope[..., 1, 1] - slope[..., 0, 1] * slope[..., 1, 0]
    held = determinant != 0.0
    safe = np.where(held, determinant, 1.0)
    tab = (slope[..., 0, 1] * value[..., 1] - slope[..., 1, 1] * value[..., 0]) / safe
    aileron = (slope[..., 1, 0] * value[..., 0] - slope[..., 0, 0] * value[..., 1]) / safe
    return np.asarray(np.where(held[..., None], np.stack([tab, aileron], axis=-1), np.inf))


def _coefficient(held: HeldTorque, load: FloatArray) -> FloatArray:
    """Coefficient (*S,) that the held torque balances; S is () for a torque of zero."""
    if not np.any(held.torque):
        return np.zeros(np.shape(held.torque))
    return np.asarray(held.torque / load)


def _shape(alpha: Floats, given: FloatArray, load: FloatArray, held: HeldTorque) -> tuple[int, ...]:
    return np.broadcast_shapes(np.shape(alpha), given.shape, _coefficient(held, load).shape)


def _angle(given: object) -> FloatArray:
    return np.asarray(given, float)
