"""What a transport delay asks for: a frequency grid that misses nothing, and the brackets on it.

With a delay the loop is no ratio of polynomials, and L crosses the real axis without end. The grid is
logarithmic and linear at once, and dense about the resonances of the loop, opened and closed. Loops of very many
states (a sampled loop with a long delay) are looked through in the same way: polynomials of their squared
magnitude would have lost their roots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.frequency.feedback import ClosedLoop, complementary
from design.frequency.nearest import nearest_each_way
from design.frequency.polynomials import evaluate, roots, squared_magnitude
from design.frequency.positive_roots import position_in_row
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

#: Above the last frequency where ``|L|`` reaches this, nothing is looked for: a gain margin beyond 60 dB.
QUIET = 1e-3
#: Below the last frequency where ``|L|`` reaches this, the grid is denser: high peaks of S are there.
LOUD = 0.2
#: Points of the logarithmic part of the grid, and of each of the linear parts.
POINTS = 1024
#: Largest frequency times delay [rad]: eight points of the linear part to a turn of the delay.
LARGEST_TURN = 0.25 * np.pi * POINTS
#: How many more crossings of the real axis are located than are asked for: which are nearest to 1 is an estimate.
SPARE = 3
#: A zero is found when the last step is below this part of the frequency, or after so many steps.
NARROW, MOST_STEPS = 1e-9, 60
#: Points about each resonance, in units of its half width.
OFFSETS = np.array([-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])


def search_grid(loop: ClosedLoop) -> FloatArray:
    """Frequencies (N, W), strictly rising from 0, in units of the loop's scale."""
    ratio = loop.transfer
    features = np.concatenate([loop.poles, roots(ratio.denominator), roots(ratio.numerator)], axis=-1)
    features = np.where(np.isnan(features), 0.0, features)
    near = np.abs(features.imag)[..., None] + np.abs(features.real)[..., None] * OFFSETS
    size = np.abs(features)
    slowest = np.where(size > 1e-6, size, 1.0).min(axis=-1)[:, None]
    parts = _all_frequencies(loop, slowest) if loop.sample_time is not None else _heard_frequencies(loop, slowest)
    top = parts[0][:, -1:]
    grid = np.sort(np.concatenate([*parts, np.clip(near.reshape(len(near), -1), 0.0, top)], axis=-1), axis=-1)
    # A point that is there twice is of no use: its neighbours would not enclose anything. It moves up.
    twice = np.diff(grid, axis=-1, prepend=-1.0) == 0.0
    beyond = top * np.linspace(1.01, 1.1, grid.shape[-1])
    return np.sort(np.where(twice, beyond, grid), axis=-1)


def _heard_frequencies(loop: ClosedLoop, slowest: FloatArray) -> tuple[FloatArray, ...]:
    """To where the loop falls silent: linear parts (N, `POINTS`) from 0, and a logarithmic one."""
    widest = 2.0 * np.abs(loop.poles).max(axis=-1, keepdims=True)
    loud, top = (np.maximum(_last_above(loop, level)[:, None], widest) for level in (LOUD, QUIET))
    if loop.delayed:
        limit = LARGEST_TURN / loop.delay[:, None]
        loud, top = np.minimum(loud, limit), np.minimum(top, limit)
    steps = np.linspace(0.0, 1.0, POINTS)
    bottom = 1e-3 * np.minimum(slowest, top)
    return top * steps, loud * steps, bottom * (top / bottom) ** steps


def _all_frequencies(loop: ClosedLoop, slowest: FloatArray) -> tuple[FloatArray, ...]:
    """To next to half the sampling rate: a part (N, 2 `POINTS`) that is linear in rad/s, and a logarithmic one."""
    unit = 1.0 / loop.scale[:, None]
    linear = unit * np.tan(0.5 * np.pi * np.arange(2 * POINTS) / (2 * POINTS))
    bottom = 1e-3 * np.minimum(slowest, unit)
    return linear, bottom * (unit / bottom) ** np.linspace(0.0, 1.0, POINTS)


def _last_above(loop: ClosedLoop, level: float) -> FloatArray:
    """Largest frequency (N,) where ``|L|`` is `level`; 0 where it is less throughout."""
    top, bottom = (squared_magnitude(p) for p in (loop.transfer.numerator, loop.transfer.denominator))
    x = roots(bottom - top / level**2)
    with np.errstate(invalid="ignore"):
        real = (x.real > 0.0) & (np.abs(x.imag) <= 1e-6 * np.abs(x))
    return np.asarray(np.sqrt(np.where(real, x.real, 0.0).max(axis=-1)))


@dataclass(frozen=True, eq=False)
class GridResponse(GridArrays):
    """T with the delay on the search grid, (N, W) each, frequencies in units of the loop's scale."""

    omega: FloatArray
    value: ComplexArray


def grid_response(loop: ClosedLoop) -> GridResponse:
    """T with the delay on `search_grid`."""
    omega = search_grid(loop)
    phase = omega * loop.delay[:, None]
    numerator = _on_axis(loop.numerator, omega)
    turned = numerator * (np.cos(phase) - 1j * np.sin(phase))
    return GridResponse(omega, turned / (_on_axis(loop.characteristic, omega) - numerator + turned))


def _on_axis(p: FloatArray, omega: FloatArray) -> ComplexArray:
    """Values (N, W) of (N, n+1) at ``j omega``: even and odd powers are two real polynomials in ``-omega^2``."""
    x = -(omega**2)
    even, odd = p[:, ::-1][:, ::2][:, ::-1], p[:, ::-1][:, 1::2][:, ::-1]
    result = np.empty(omega.shape, dtype=complex)
    result.real, result.imag = evaluate(even, x), evaluate(odd, x) * omega
    return result


def real_axis_starts(loop: ClosedLoop, found: GridResponse, width: int) -> FloatArray:
    """Frequencies (N, M) where L with its delay is real, zero first, nan padded.

    L is real where T is, and on the same side of the real axis elsewhere. Of each point only those with the
    critical ratio nearest to 1, either way, are located, `SPARE` times as many as the `width` that is asked for.
    """
    T = found.value
    above = T.imag > 0.0
    above[:, 0] = above[:, 1]  # at zero frequency T is real
    rows, place = np.nonzero(above[:, :-1] != above[:, 1:])
    first, last = T[rows, place], T[rows, place + 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        estimate = (first.real * last.imag - last.real * first.imag) / (last.imag - first.imag)
        ratio = 1.0 - 1.0 / estimate
    chosen = np.flatnonzero(nearest_each_way(rows, ratio, len(T), SPARE * width))
    zero = np.zeros((len(T), 1))
    return np.concatenate([zero, _located(loop, found, rows[chosen], place[chosen], "imag", 0.0)], axis=-1)


def unit_circle_starts(loop: ClosedLoop, found: GridResponse) -> FloatArray:
    """Frequencies (N, M) where ``|L| = 1``, nan padded: there ``Re T = 1/2``, whatever the delay."""
    above = found.value.real > 0.5
    rows, place = np.nonzero(above[:, :-1] != above[:, 1:])
    return _located(loop, found, rows, place, "real", 0.5)


def _located(
    loop: ClosedLoop, found: GridResponse, rows: IntArray, place: IntArray, part: str, level: float
) -> FloatArray:
    """Where that part of T has the level between the grid's points `place` (K,) and the next, side by side in rows."""
    low, high = found.omega[rows, place], found.omega[rows, place + 1]

    def excess(omega: FloatArray) -> FloatArray:
        return np.asarray(getattr(complementary(loop, rows, omega, loop.delayed)[0], part) - level)

    position = position_in_row(rows, len(found.omega))
    result = np.full((len(found.omega), 1 + int(position.max(initial=0))), np.nan)
    result[rows, position] = zero_between(excess, low, high)
    return result


def zero_between(function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """Where a function changes its sign between `low` and `high` (K,); anywhere between them where it does not.

    Regula falsi, with the Illinois rule: the end that stays counts half.
    """
    value_low, value_high = function(low), function(high)
    w = low
    for _ in range(MOST_STEPS):
        with np.errstate(divide="ignore", invalid="ignore"):
            guess = high - value_high * (high - low) / (value_high - value_low)
        last, w = w, np.where((guess >= low) & (guess <= high), guess, 0.5 * (low + high))
        if np.all(np.abs(w - last) <= NARROW * high):
            break
        value = function(w)
        below = value * value_low > 0.0
        value_low, value_high = (
            np.where(below, value, 0.5 * value_low),
            np.where(below, 0.5 * value_high, value),
        )
        low, high = np.where(below, w, low), np.where(below, high, w)
    return w
