"""What a simulated response asks of the actuators: the figures of `design.response.demand`, of the samples.

Peaks are those of parabolas through three samples about each largest one, except that a limit is not exceeded.
Integrals are those of cubics; power that changes sign is split there by the straight line between two samples.
"""

from __future__ import annotations

import numpy as np

from design.response.demand import ActuatorDemand
from design.simulation.dynamics import Dynamics, limit_or_infinite
from design.simulation.quadrature import interval_integrals, runs
from design.simulation.request import SURFACES
from design.simulation.signals import Signals
from design.simulation.trajectory import Trajectory
from model.arrays import BoolArray, FloatArray

LIMITS = ("deflection", "rate", "torque", "power")
#: From this part of a limit on an actuator counts as being at it: a rate loop reaches its limit only in the end.
AT_LIMIT = 0.99
#: A torque is held that in this last part of the response varies by less than that part of its peak.
_REST, _STEADY = 0.05, 0.02


def demands(dynamics: Dynamics, found: Trajectory, seen: Signals) -> tuple[ActuatorDemand, ...]:
    """Demand on each actuator of the loop, over P points; nan at points that have diverged.

    `holding_torque` is the mean over the last twentieth of the response, nan where the torque still varies there by
    more than a fiftieth of its peak.
    """
    made = []
    for name in dynamics.flown.loop.inputs:
        i = SURFACES.index(name)
        caps = [limit_or_infinite(dynamics.flown.request, name, what) for what in LIMITS]
        made.append(_demand(found, seen, i, caps))
    return tuple(made)


def limit_signals(seen: Signals) -> FloatArray:
    """(M, 2, 4, P) magnitudes of what each limit is on, in the order of `LIMITS`."""
    power = seen.torque * seen.driven_rate
    return np.abs(np.stack([seen.driven_angle, seen.driven_rate, seen.torque, power], axis=2))


def at_limits(dynamics: Dynamics, sizes: FloatArray) -> BoolArray:
    """(M, 2, 4, P) where a limit is reached, of the sizes of `limit_signals`."""
    limits = [[limit_or_infinite(dynamics.flown.request, name, what) for what in LIMITS] for name in SURFACES]
    return np.asarray(sizes >= AT_LIMIT * np.array(limits)[..., None])


def time_at_limits(found: Trajectory, reached: BoolArray) -> FloatArray:
    """(P, 2, 4) how long each limit is reached [s]: a node stands for half the steps beside it."""
    weight = np.zeros(len(found.time))
    for rows in runs(found.segment):
        gaps = np.diff(found.time[rows])
        weight[rows] += 0.5 * (np.append(gaps, 0.0) + np.insert(gaps, 0, 0.0))
    return np.asarray(np.einsum("m,mijp->pij", weight, reached.astype(float)))


def _demand(found: Trajectory, seen: Signals, i: int, caps: list[float]) -> ActuatorDemand:
    torque, rate = seen.torque[:, i], seen.driven_rate[:, i]
    power = torque * rate
    duration = found.time[-1]
    weights = [(rows, float(found.time[rows.start + 1] - found.time[rows.start])) for rows in runs(found.segment)]

    def mean_square(y: FloatArray) -> FloatArray:
        return np.asarray(sum(h * interval_integrals(y[rows] ** 2).sum(axis=0) for rows, h in weights) / duration)

    net = sum(h * interval_integrals(power[rows]).sum(axis=0) for rows, h in weights)
    gross = sum(h * _gross(power[rows]).sum(axis=0) for rows, h in weights)
    peak_torque = _peak(found, torque, caps[2])
    tail = torque[found.time >= (1.0 - _REST) * duration]
    steady = tail.max(axis=0) - tail.min(axis=0) <= _STEADY * peak_torque
    gone = ~np.isnan(found.diverged_at)
    figures = (
        peak_torque, np.sqrt(np.maximum(mean_square(torque), 0.0)),
        np.where(steady, np.abs(tail.mean(axis=0)), np.nan), _peak(found, rate, caps[1]),
        _peak(found, seen.acceleration[:, i], np.inf), _peak(found, seen.driven_angle[:, i], caps[0]),
        _peak(found, power, caps[3]), np.sqrt(np.maximum(mean_square(power), 0.0)),
        np.maximum(0.5 * (gross + net), 0.0), np.maximum(0.5 * (gross - net), 0.0),
        np.sqrt(np.maximum(mean_square(seen.acceleration[:, i]), 0.0)),
    )  # fmt: skip
    return ActuatorDemand(*(np.where(gone, np.nan, figure) for figure in figures))


def _peak(found: Trajectory, signal: FloatArray, cap: float) -> FloatArray:
    """(P,) largest magnitude of samples (M, P) and of parabolas through three of them, no more than a cap."""
    size = np.abs(signal)
    largest = size.max(axis=0)
    refined = largest.copy()
    for rows in runs(found.segment):
        part = size[rows]
        before, here, after = part[:-2], part[1:-1], part[2:]
        bend = 2.0 * here - before - after
        top = (here >= before) & (here >= after) & (bend > 0.0) & (here >= 0.9 * largest)
        rise = np.where(top, (after - before) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)), 0.0)
        refined = np.maximum(refined, (here + rise).max(axis=0, initial=0.0))
    return np.asarray(np.maximum(np.minimum(refined, cap), largest))


def _gross(power: FloatArray) -> FloatArray:
    """Integrals (k - 1, P) of the magnitude of powers (k, P) over each interval, in steps."""
    a, b = power[:-1], power[1:]
    plain = np.abs(interval_integrals(power))
    split = 0.5 * (a**2 + b**2) / np.where(a != b, np.abs(a - b), 1.0)
    return np.where(a * b < 0.0, split, plain)
