"""What a transport delay asks for: a frequency grid that misses nothing, and the brackets on it.

With a delay the loop is no ratio of polynomials, and L crosses the real axis without end. The grid is
logarithmic and linear at once, and dense about the resonances of the loop, opened and closed.
"""

from __future__ import annotations

import numpy as np

from design.frequency.feedback import ClosedLoop
from design.frequency.polynomials import evaluate, magnitude_bound, roots, squared_magnitude
from model.arrays import ComplexArray, FloatArray, IntArray

#: Above the last frequency where ``|L|`` reaches this, nothing is looked for: a gain margin beyond 60 dB.
QUIET = 1e-3
#: Below the last frequency where ``|L|`` reaches this, the grid is denser: high peaks of S are there.
LOUD = 0.2
#: Points of the logarithmic part of the grid, and of each of the linear parts.
POINTS = 1024
#: Largest frequency times delay [rad]: eight points of the linear part to a turn of the delay.
LARGEST_TURN = 0.25 * np.pi * POINTS
#: Points about each resonance, in units of its half width.
OFFSETS = np.array([-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])


def search_grid(loop: ClosedLoop) -> FloatArray:
    """Frequencies (N, W), strictly rising from 0, in units of the loop's scale."""
    ratio, count = loop.transfer, loop.poles.shape[-1]
    features = np.concatenate([loop.poles, roots(ratio.denominator), roots(ratio.numerator)], axis=-1)
    features = np.where(np.isnan(features), 0.0, features)
    size = np.abs(features)
    widest = 2.0 * size[:, :count].max(axis=-1)
    limit = LARGEST_TURN / loop.delay
    loud, top = (np.minimum(np.maximum(_last_above(loop, level), widest), limit) for level in (LOUD, QUIET))
    bottom = np.minimum(np.where(size > 1e-6, size, 1.0).min(axis=-1), top) * 1e-3
    steps = np.linspace(0.0, 1.0, POINTS)
    near = np.abs(features.imag)[..., None] + np.abs(features.real)[..., None] * OFFSETS
    parts = (
        bottom[:, None] * (top / bottom)[:, None] ** steps,
        top[:, None] * steps,
        loud[:, None] * steps,
        np.clip(near.reshape(near.shape[0], -1), 0.0, top[:, None]),
    )
    grid = np.sort(np.concatenate(parts, axis=-1), axis=-1)
    # A point that is there twice is of no use: its neighbours would not enclose anything. It moves up.
    twice = np.diff(grid, axis=-1, prepend=-1.0) == 0.0
    beyond = top[:, None] * np.linspace(1.01, 1.1, grid.shape[-1])
    return np.sort(np.where(twice, beyond, grid), axis=-1)


def _last_above(loop: ClosedLoop, level: float) -> FloatArray:
    """Largest frequency (N,) where ``|L|`` is `level`; 0 where it is less throughout."""
    top, bottom = (squared_magnitude(p) for p in (loop.transfer.numerator, loop.transfer.denominator))
    x = roots(bottom - top / level**2)
    with np.errstate(invalid="ignore"):
        real = (x.real > 0.0) & (np.abs(x.imag) <= 1e-6 * np.abs(x))
    return np.asarray(np.sqrt(np.where(real, x.real, 0.0).max(axis=-1)))


def turned_numerator(loop: ClosedLoop, rows: IntArray, omega: FloatArray) -> ComplexArray:
    """Numerator of L with the delay, (K, m), at the frequencies `omega` (K, m) of the points `rows` (K,)."""
    value = evaluate(loop.transfer.numerator[rows], np.asarray(1j * omega, dtype=complex))
    return np.asarray(value * np.exp(-1j * omega * loop.delay[rows][:, None]))


def real_axis_brackets(loop: ClosedLoop, least_width: int) -> FloatArray:
    """Frequencies (N, M) where L with its delay is real, zero first, nan padded; M at least `least_width`."""
    grid = search_grid(loop)
    sign = np.sign(_height(loop, np.arange(grid.shape[0]), grid))
    rows, place = np.nonzero(sign[:, :-1] * sign[:, 1:] < 0.0)
    low, high = grid[rows, place], grid[rows, place + 1]
    rising = sign[rows, place + 1]
    for _ in range(40):
        middle = 0.5 * (low + high)
        above = _height(loop, rows, middle[:, None])[:, 0] * rising > 0.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    count = np.bincount(rows, minlength=grid.shape[0])
    result = np.full((grid.shape[0], max(least_width, 1 + int(count.max(initial=0)))), np.nan)
    result[:, 0] = 0.0
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    result[rows, 1 + np.arange(rows.size) - first[rows]] = 0.5 * (low + high)
    return result


def _height(loop: ClosedLoop, rows: IntArray, omega: FloatArray) -> FloatArray:
    """Im L times ``|denominator|^2``, exactly zero where it is only rounding."""
    denominator = evaluate(loop.transfer.denominator[rows], np.asarray(1j * omega, dtype=complex))
    height = np.imag(turned_numerator(loop, rows, omega) * np.conj(denominator))
    bound = magnitude_bound(loop.transfer.numerator[rows], omega) * magnitude_bound(
        loop.transfer.denominator[rows], omega
    )
    return np.where(np.abs(height) > 1e-14 * bound, height, 0.0)
