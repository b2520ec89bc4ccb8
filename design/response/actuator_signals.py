"""Signals of actuators on samples that resolve them: torque, rate, deflection, acceleration, power.

Their integrals are those of the polynomials through the samples (1e-8 of their value).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from design.response.excursions import hidden_excursions
from design.response.extremes import NOISE
from design.response.interpolant import crossings, interval_integrals, sign_changes, windows
from model.arrays import FloatArray, GridArrays, IntArray

LETTERS: dict[str, str] = {"tab": "t", "aileron": "a"}
#: Order of an actuator's signals.
TORQUE, RATE, DEFLECTION, ACCELERATION, POWER = range(5)
#: A jump is one when it exceeds this part of the signal's peak.
JUMP = 1e-12
#: Those whose mean squares are wanted.
SQUARED = [TORQUE, ACCELERATION, POWER]


class Outputs(Protocol):
    """A response, as far as its outputs have names."""

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each output."""

    def index(self, name: str) -> int:
        """Index of the named output; ValueError when there is none."""


@dataclass(frozen=True, eq=False)
class Work(GridArrays):
    """Net work and the integral of the magnitude of the power, each (*G, a) [J]."""

    net: FloatArray
    gross: FloatArray

    @property
    def out(self) -> FloatArray:
        """(*G, a) work of the actuators on the surfaces while their power is positive [J], >= 0."""
        return np.maximum(0.5 * (self.gross + self.net), 0.0)

    @property
    def back(self) -> FloatArray:
        """(*G, a) work of the surfaces on the actuators while their power is negative [J], >= 0."""
        return np.maximum(0.5 * (self.gross - self.net), 0.0)


def output_indices(response: Outputs, actuators: tuple[str, ...]) -> IntArray:
    """(a, 3) indices of each actuator's torque, rate and deflection among the outputs.

    The rate stands in for a torque that is not there.

    Raises
    ------
    ValueError : no such actuator, or the loop lacks its rate or deflection among the outputs
    """
    unknown = [name for name in actuators if name not in LETTERS]
    if unknown:
        raise ValueError(f"no actuator {unknown[0]!r}; there are {', '.join(LETTERS)}")
    indices = []
    for actuator in actuators:
        angle, torque = f"d{LETTERS[actuator]}", torque_name(actuator)
        rate = response.index(f"{angle}_rate")
        indices.append([response.index(torque) if torque in response.names else rate, rate, response.index(angle)])
    return np.array(indices, dtype=np.int64)


def torque_name(actuator: str) -> str:
    """Name of the output that is the actuator's torque."""
    return f"T_{LETTERS[actuator]}"


def linear_rows(rows: FloatArray, generator: FloatArray, indices: IntArray) -> FloatArray:
    """(*G, 4 a, N) rows of torque, rate, deflection and acceleration of actuators with these indices (a, 3)."""
    *grid, _, size = rows.shape
    found = np.empty((*grid, len(indices), POWER, size))
    found[..., : DEFLECTION + 1, :] = rows[..., indices, :]
    found[..., ACCELERATION, :] = found[..., RATE, :] @ generator
    return found.reshape(*grid, len(indices) * POWER, size)


def with_power(linear: FloatArray) -> FloatArray:
    """(*G, a, 5, S, m+1) all signals from the linear ones (*G, 4 a, S, m+1)."""
    *grid, count, blocks, samples = linear.shape
    signals = np.empty((*grid, count // POWER, POWER + 1, blocks, samples))
    signals[..., :POWER, :, :] = linear.reshape(*grid, count // POWER, POWER, blocks, samples)
    np.multiply(signals[..., TORQUE, :, :], signals[..., RATE, :, :], out=signals[..., POWER, :, :])
    return signals


def square_integrals(signals: FloatArray, steps: FloatArray) -> FloatArray:
    """Integrals (...) of the squares of signals (..., S, m+1) over blocks with these sample steps (S,) [s]."""
    weights = steps[:, None] * interval_integrals(signals.shape[-1] - 1).sum(axis=-1)
    return np.asarray(np.einsum("...sk,...sk,sk->...", signals, signals, weights))


def works(power: FloatArray, steps: FloatArray, peak: FloatArray) -> Work:
    """Work of powers (*G, a, S, m+1) over blocks with these sample steps (S,) [s].

    Interval by interval, those where the power changes sign in two parts, those where it does so twice in three.

    Parameters
    ----------
    peak : (*G, a) largest magnitudes of the powers: what is rounding is so beside them
    """
    blocks, samples = power.shape[-2:]
    parts = power @ interval_integrals(samples - 1)
    sizes = np.abs(parts)
    rows = power.reshape(-1, samples)
    row, before = np.nonzero(sign_changes(rows, NOISE * np.repeat(peak.reshape(-1), blocks)))
    low = before.astype(float)
    middle = crossings(rows, row, before, np.zeros(len(row)))
    curve = windows(rows, row, low + 0.5)
    halves = np.abs(curve.integral(low, middle)) + np.abs(curve.integral(middle, low + 1.0))
    by_interval = sizes.reshape(-1, samples - 1)
    by_interval[row, before] = halves
    hidden = hidden_excursions(rows, np.repeat(peak.reshape(-1), blocks))
    missed = 2.0 * np.abs(hidden.course.integral(hidden.begin, hidden.end))
    np.add.at(by_interval, (hidden.row, hidden.interval), missed)
    return Work(np.asarray(parts.sum(axis=-1) @ steps), np.asarray(sizes.sum(axis=-1) @ steps))
