"""The numbers of a Kalman filter by name: all that a controller needs to run it, beside the gains on its estimates."""

from __future__ import annotations

import numpy as np

from design.estimation.kalman_filter import KalmanFilter
from design.estimation.readings import RATES
from design.gains import Gain
from design.loop import Loop
from model.arrays import FloatArray

#: Exponents of rad, s and N m in the unit of a state.
_Unit = tuple[int, int, int]
_SYMBOLS = ("rad", "s", "N m")


def filter_gains(loop: Loop, estimator: KalmanFilter) -> tuple[Gain, ...]:
    """``L_<state>_<angle>``, then ``A_<state>_<state>`` and ``B_<state>_<input>`` of the model that the filter runs.

    Entries of the model that are 0 at every point, or 1 at every point, are left out: they are of kinematics.

    Parameters
    ----------
    loop : the full-state feedback that the filter was made for (*G)
    estimator : the filter (*G)
    """
    ok, states = estimator.outcomes.ok, estimator.states
    plant = [loop.states.index(name) for name in states]
    A, B = loop.A[..., plant, :][..., plant], loop.B[..., plant, :]
    torques = tuple(f"T_{actuator[0]}" for actuator in loop.inputs)
    found = _named("L", states, tuple(RATES), estimator.L)
    found += [gain for gain in _named("A", states, states, A) if not _kinematic(gain.values[ok])]
    found += [gain for gain in _named("B", states, torques, B) if not _kinematic(gain.values[ok])]
    return tuple(Gain(gain.name, gain.unit, np.where(ok, gain.values, np.nan)) for gain in found)


def _named(symbol: str, rows: tuple[str, ...], columns: tuple[str, ...], matrix: FloatArray) -> list[Gain]:
    return [
        Gain(f"{symbol}_{row}_{column}", _unit(row, column), matrix[..., i, j])
        for i, row in enumerate(rows)
        for j, column in enumerate(columns)
    ]


def _kinematic(values: FloatArray) -> bool:
    return bool(np.all(values == 0.0) or np.all(values == 1.0))


def _unit(row: str, column: str) -> str:
    """Unit of what makes the rate of one signal from another."""
    exponents = np.subtract(_of_signal(row), _of_signal(column)) - (0, 1, 0)
    above = [_power(symbol, n) for symbol, n in zip(_SYMBOLS, exponents, strict=True) if n > 0]
    below = [_power(symbol, -n) for symbol, n in zip(_SYMBOLS, exponents, strict=True) if n < 0]
    if not below:
        return " ".join(above) or "1"
    divisor = below[0] if len(below) == 1 and " " not in below[0] else f"({' '.join(below)})"
    return f"{' '.join(above) or '1'}/{divisor}"


def _of_signal(name: str) -> _Unit:
    if name.endswith("_rate"):
        return (1, -1, 0)
    return (0, 0, 1) if name.startswith("T_") or name.endswith("_torque") else (1, 0, 0)


def _power(symbol: str, n: int) -> str:
    return symbol if n == 1 else f"{symbol}^{n}"
