"""How far one signal of a stable loop gets away while what it follows moves at a constant rate."""

from __future__ import annotations

import numpy as np

from design.lqr.hamiltonian import solve_or_nan
from model.arrays import ComplexArray, FloatArray, IntArray

#: Samples of each mode, evenly over so many of its time constants.
SAMPLES, TIME_CONSTANTS = 192, 6.0
#: Times that the largest sample is looked at more closely, at so many points between its neighbours.
ZOOMS, POINTS = 8, 9
#: Loops that are worked on at once, so that memory stays bounded.
AT_ONCE = 128
#: Part of the lag's pole that a mode is at least taken to lie away from it, where only a place in time is sought.
NEAR = 1e-6


def ramp_deviation(
    A: FloatArray, forcing: FloatArray, late: FloatArray, lag: float, row: int
) -> tuple[FloatArray, FloatArray]:
    """Last and largest (N, C) value of a state y of ``y' = A y + forcing + late (1 - e^(-t/lag))``, y(0) = 0.

    The largest is that of the size. Both are nan where A is not stable, or where modes that coincide leave no basis.

    Parameters
    ----------
    A : (N, n, n)
    forcing, late : (N, C, n), C cases of each loop
    lag : [s]; 0: `late` acts at once
    row : index of the state
    """
    values, vectors = np.linalg.eig(A)
    stable = np.all(values.real < 0.0, axis=-1)
    # Modes (N, n, C) of what drives, seen in the row.
    both = np.swapaxes(np.concatenate([forcing, late], axis=-2), -1, -2).astype(complex)
    seen = np.asarray(vectors[:, row, :, None] * solve_or_nan(vectors, both), dtype=complex)
    cases = forcing.shape[-2]
    constant, fading = seen[..., :cases] + seen[..., cases:], seen[..., cases:]
    last = -np.sum(constant / values[..., None], axis=-2).real
    largest = np.concatenate(
        [
            _largest(values[part], constant[part], fading[part], lag)
            for part in (slice(k, k + AT_ONCE) for k in range(0, len(A), AT_ONCE))
        ]
        or [np.zeros((0, cases))]
    )
    known = stable[:, None] & np.isfinite(last)
    return np.where(known, last, np.nan), np.where(known, np.fmax(largest, np.abs(last)), np.nan)


def _largest(values: ComplexArray, constant: ComplexArray, fading: ComplexArray, lag: float) -> FloatArray:
    """(N, C) largest size over time, found among samples that resolve every mode and then between them."""
    poles = values if lag == 0.0 else np.concatenate([values, np.full((len(values), 1), -1.0 / lag)], axis=-1)
    spans = TIME_CONSTANTS / np.maximum(np.abs(poles.real), 1e-300)
    times = np.sort((spans[..., None] * np.linspace(0.0, 1.0, SAMPLES)).reshape(len(values), -1), axis=-1)
    best = _roughly_largest(values, constant, fading, lag, times)
    begin = np.take_along_axis(times, np.maximum(best - 1, 0), axis=-1)
    end = np.take_along_axis(times, np.minimum(best + 1, times.shape[-1] - 1), axis=-1)
    found = np.zeros(begin.shape)
    for _ in range(ZOOMS):
        closer = begin[..., None] + (end - begin)[..., None] * np.linspace(0.0, 1.0, POINTS)
        size = np.abs(_signal(values, constant, fading, lag, closer))
        best = np.argmax(np.where(np.isfinite(size), size, 0.0), axis=-1)
        found = np.fmax(found, np.max(size, axis=-1))
        step = (end - begin) / (POINTS - 1)
        begin, end = begin + step * np.maximum(best - 1, 0), begin + step * np.minimum(best + 1, POINTS - 1)
    return np.asarray(found)


def _roughly_largest(
    values: ComplexArray, constant: ComplexArray, fading: ComplexArray, lag: float, times: FloatArray
) -> IntArray:
    """(N, C) index of the largest sample at times (N, T): of one sum of exponentials, which rounding may blur."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        weights = constant / values[..., None]
        rest = -np.sum(weights, axis=-2).real
        signal = np.zeros((*times.shape, constant.shape[-1])) + rest[:, None]
        if lag > 0.0:
            apart = values + 1.0 / lag
            apart = np.where(np.abs(apart) < NEAR / lag, NEAR / lag, apart)  # where they coincide: nearly so
            late = fading / apart[..., None]
            weights = weights - late
            signal = signal + np.exp(-times / lag)[..., None] * np.sum(late, axis=-2).real[:, None]
        signal = signal + (np.exp(values[:, None, :] * times[..., None]) @ weights).real
        size = np.abs(signal)
    return np.asarray(np.argmax(np.where(np.isfinite(size), size, 0.0), axis=-2))


def _signal(
    values: ComplexArray, constant: ComplexArray, fading: ComplexArray, lag: float, times: FloatArray
) -> FloatArray:
    """(N, C, T) at times (N, 1 or C, T): sum over the modes of their answers to a constant and to e^(-t/lag)."""
    total = np.zeros(np.broadcast_shapes(times.shape, (*constant.shape[::2], 1)))
    for i in range(values.shape[-1]):
        pole = values[:, i, None, None]
        total = total + (constant[:, i, :, None] * (np.expm1(pole * times) / pole)).real
        if lag > 0.0:
            total = total - (fading[:, i, :, None] * _between(pole, -1.0 / lag, times)).real
    return total


def _between(pole: ComplexArray, other: float, times: FloatArray) -> ComplexArray:
    """``(e^(pole t) - e^(other t)) / (pole - other)``, ``t e^(pole t)`` where they coincide."""
    slow = np.where(pole.real >= other, pole, other)
    apart = np.where(pole.real >= other, other - pole, pole - other)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(apart == 0.0, times, np.expm1(apart * times) / apart)
    return np.asarray(np.exp(slow * times) * ratio)
