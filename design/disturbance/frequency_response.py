"""Frequency responses as data: complex values, magnitude, phase and singular values over the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.disturbance.closed_system import ClosedSystem
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

#: Where a resonance is looked at: at its peak, and these many half widths beside it.
_BESIDE = np.array([0.0, -0.5, 0.5, -1.0, 1.0, -2.0, 2.0, -4.0, 4.0])
#: A mode of less damping than this has a peak over frequency.
_RESONANT = np.sqrt(0.5)


@dataclass(frozen=True, eq=False)
class FrequencyResponse(GridArrays):
    """Response of outputs to inputs over frequency.

    Attributes
    ----------
    omega : (*G, W) frequencies [rad/s]
    value : (*G, W, o, p) complex response [unit of the output per unit of the input]
    inputs, outputs : names
    """

    omega: FloatArray
    value: ComplexArray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def magnitude(self) -> FloatArray:
        """(*G, W, o, p) absolute value, in the units of `value`."""
        return np.abs(self.value)

    @property
    def phase(self) -> FloatArray:
        """(*G, W, o, p) phase [rad], without jumps of a turn: as of the first frequency, where it is in (-pi, pi].

        Neighbouring frequencies are taken to be less than half a turn apart. A frequency without a value has nan, and
        is left out of the count.
        """
        return unwrapped_phase(self.value)

    @property
    def singular_values(self) -> FloatArray:
        """(*G, W, min(o, p)) singular values, the largest first. They mean something where the units are alike."""
        return singular_values(self.value)


def frequency_response(system: ClosedSystem, omega: FloatArray) -> FrequencyResponse:
    """Response of a closed system at some frequencies, by a linear system at each: exact, delays included.

    Parameters
    ----------
    system : over any grid; also where it is not stable
    omega : (W,) or (*G, W) frequencies [rad/s], at least 0

    Returns
    -------
    FrequencyResponse; nan where a point is not finite, and at a frequency that is exactly a pole

    Raises
    ------
    ValueError : a frequency is negative, or not finite, or the shape is neither of the two
    """
    frequencies = over_grid(omega, system.grid)
    return FrequencyResponse(frequencies, system.response(frequencies), system.inputs, system.outputs)


def over_grid(omega: FloatArray, grid: tuple[int, ...]) -> FloatArray:
    """Frequencies (W,) or (*G, W) as (*G, W); ValueError unless they are finite and at least 0."""
    omega = np.asarray(omega, dtype=float)
    if omega.ndim != 1 and omega.shape[:-1] != grid:
        raise ValueError(f"frequencies have shape {omega.shape}: expected (W,), or (W,) at each point of {grid}")
    if not np.all(np.isfinite(omega) & (omega >= 0.0)):
        raise ValueError("frequencies must be finite and at least 0")
    return np.broadcast_to(omega, (*grid, omega.shape[-1]))


def unwrapped_phase(value: ComplexArray) -> FloatArray:
    """Phase (*G, W, o, p) [rad] of a response, without jumps of a turn along its frequencies."""
    phase = np.angle(value)
    known = np.isfinite(phase)
    if known.all():
        return np.unwrap(phase, axis=-3)
    # The step to the next known value is what counts; a gap repeats the value before it.
    last = np.maximum.accumulate(np.where(known, np.arange(phase.shape[-3])[:, None, None], 0), axis=-3)
    filled = np.nan_to_num(np.take_along_axis(phase, last, axis=-3))
    return np.where(known, np.unwrap(filled, axis=-3), np.nan)


def singular_values(value: ComplexArray) -> FloatArray:
    """Singular values (..., min(o, p)) of matrices (..., o, p), the largest first; nan where an entry is."""
    if min(value.shape[-2:]) == 1:
        return np.asarray(np.linalg.norm(value, axis=(-2, -1))[..., None])
    if value.shape[-2:] == (2, 2):
        return _of_two_by_two(value)
    known = np.asarray(np.isfinite(value).all(axis=(-2, -1)))
    found = np.linalg.svd(np.asarray(np.where(known[..., None, None], value, 0.0), dtype=complex), compute_uv=False)
    return np.where(known[..., None], found, np.nan)


def _of_two_by_two(value: ComplexArray) -> FloatArray:
    """Both singular values from ``(s1 -+ s2)^2``, sums of squares in which nothing cancels.

    With ``e = det / |det|`` they are ``|a - e d*|^2 + |b + e c*|^2`` and ``|a + e d*|^2 + |b - e c*|^2``.
    """
    a, b, c, d = value[..., 0, 0], value[..., 0, 1], value[..., 1, 0], value[..., 1, 1]
    determinant = a * d - b * c
    size = np.abs(determinant)
    direction = np.where(size > 0.0, determinant, 1.0) / np.where(size > 0.0, size, 1.0)
    e, f = direction * np.conj(c), direction * np.conj(d)
    largest = 0.5 * (np.hypot(np.abs(a + f), np.abs(b - e)) + np.hypot(np.abs(a - f), np.abs(b + e)))
    return np.stack([largest, size / np.where(largest > 0.0, largest, 1.0)], axis=-1)


def response_frequencies(poles: ComplexArray, low: float, high: float, count: int) -> FloatArray:
    """Frequencies that show a response whole: evenly spread over the decades, and at and about its resonances.

    The peak of a mode of damping ratio z is at ``|p| sqrt(1 - 2 z^2)``, and ``-Re p`` wide to either side. Modes take
    at most half of the frequencies, the peaks first, those of the least damped modes before the others.

    Parameters
    ----------
    poles : (*G, n) [rad/s]
    low, high : the first frequency and the last [rad/s]
    count : how many there are, W

    Returns
    -------
    (*G, W) rising [rad/s]; without those of resonances where a point's poles are nan

    Raises
    ------
    ValueError : not 0 < low < high < inf, or fewer than two frequencies
    """
    if not 0.0 < low < high < np.inf:
        raise ValueError(f"the first frequency must be positive and below the last, got {low} and {high} rad/s")
    if count < 2:
        raise ValueError(f"a response needs at least two frequencies, got {count}")
    grid, rows = poles.shape[:-1], poles.reshape(-1, poles.shape[-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        damping = np.abs(rows.real) / np.abs(rows)
        resonant = (rows.imag > 0.0) & (damping < _RESONANT)
        peak = np.abs(rows) * np.sqrt(np.maximum(1.0 - 2.0 * damping**2, 0.0))
    order = np.argsort(np.where(resonant, damping, np.inf), axis=-1, stable=True)
    resonant, peak, width = (np.take_along_axis(v, order, axis=-1) for v in (resonant, peak, np.abs(rows.real)))
    marks = (peak[:, None, :] + width[:, None, :] * _BESIDE[:, None]).reshape(len(rows), -1)
    chosen = _first(np.tile(resonant, _BESIDE.size) & (marks > low) & (marks < high), min(count // 2, count - 2))
    spread = count - np.sum(chosen, axis=-1, keepdims=True)
    even = low * (high / low) ** np.minimum(np.arange(count) / (spread - 1), 1.0)
    even[np.arange(count) == spread - 1] = high
    marks = np.where(chosen, marks, np.inf)
    both = np.concatenate([np.where(np.arange(count) < spread, even, np.inf), marks], axis=-1)
    return np.sort(both, axis=-1)[:, :count].reshape(*grid, count)


def _first(mask: BoolArray, count: int) -> BoolArray:
    """The mask (N, k) with no more than its first `count` entries of each row."""
    return mask & (np.cumsum(mask, axis=-1) <= count)
