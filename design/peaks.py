"""Largest values over all frequencies of the closed loop's sensitivities."""

from __future__ import annotations

import numpy as np

from design.crossovers import positive_roots
from design.delayed import search_grid, turned_numerator
from design.feedback import ClosedLoop, complementary
from design.polynomials import derivative, evaluate, product, squared_magnitude, total
from model.arrays import ComplexArray, FloatArray

#: A peak is proved to be the largest to within this part of its square.
RESOLUTION = 1e-8


def sensitivity_peak(loop: ClosedLoop) -> FloatArray:
    """``max |1 + L|^-1`` over the frequencies (N,); at least 1, because L vanishes at infinity."""
    top = loop.transfer.denominator
    omega = _delayed_peak(loop, opposite=False) if loop.delayed else _peak(loop, top)
    return np.maximum(np.abs(1.0 - _complementary_at(loop, omega)), 1.0)


def balanced_peak(loop: ClosedLoop) -> FloatArray:
    """``max |S - T| = max |1 - L| / |1 + L|`` over the frequencies (N,), at least 1."""
    top = loop.transfer.denominator - loop.transfer.numerator
    omega = _delayed_peak(loop, opposite=True) if loop.delayed else _peak(loop, top)
    return np.maximum(np.abs(1.0 - 2.0 * _complementary_at(loop, omega)), 1.0)


def _complementary_at(loop: ClosedLoop, omega: FloatArray) -> ComplexArray:
    return complementary(loop, np.arange(omega.size), omega, loop.delayed)[0]


def _peak(loop: ClosedLoop, top: FloatArray) -> FloatArray:
    """Frequency (N,) where ``|top / characteristic|`` is largest, both monic.

    From the best of a few frequencies near the closed loop's poles, Newton on the derivative; then the
    proof: the roots of ``|top|^2 - level |characteristic|^2`` bound the frequencies that lie above the level,
    if there are any, and the search goes on from their midpoints (Bruinsma and Steinbuch 1990).
    """
    P, Q = squared_magnitude(top), squared_magnitude(loop.characteristic)
    zero = np.zeros((P.shape[0], 1))
    start = np.concatenate([zero, loop.poles.imag**2, np.abs(loop.poles) ** 2], axis=-1)
    x, level = _best(P, Q, start)
    level = np.maximum(level, 1.0)
    active = np.arange(x.size)
    for _ in range(50):
        p, q = P[active], Q[active]
        edges = positive_roots(p - (level[active] * (1.0 + RESOLUTION))[:, None] * q)
        edges = np.sort(edges, axis=-1)
        middles = 0.5 * (edges[:, 1:] + edges[:, :-1])
        found, height = _best(p, q, np.where(np.isnan(middles), 0.0, middles))
        better = height > level[active] * (1.0 + RESOLUTION)
        active = active[better]
        if active.size == 0:
            break
        x[active], level[active] = found[better], height[better]
    return np.sqrt(x)


def _best(P: FloatArray, Q: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where ``P/Q`` is largest (N,) among `start` (N, m), sharpened by Newton on ``P'Q - PQ'``, and its value."""
    heights = _ratio(P, Q, start)
    best = np.argmax(heights, axis=-1)[:, None]
    x, height = (np.take_along_axis(v, best, axis=-1) for v in (start, heights))
    slope = total(product(derivative(P), Q), -product(P, derivative(Q)))
    for _ in range(4):
        with np.errstate(divide="ignore", invalid="ignore"):
            trial = x - evaluate(slope, x) / evaluate(derivative(slope), x)
        trial = np.where(np.isfinite(trial) & (trial > 0.0), trial, x).real
        trial_height = _ratio(P, Q, trial)
        x = np.where(trial_height > height, trial, x)
        height = np.maximum(height, trial_height)
    return x[:, 0], height[:, 0]


def _ratio(P: FloatArray, Q: FloatArray, x: FloatArray) -> FloatArray:
    return np.asarray(evaluate(P, x) / evaluate(Q, x)).real


def _delayed_peak(loop: ClosedLoop, opposite: bool) -> FloatArray:
    """Frequency (N,) of the largest ``|1 + L|^-1``, or ``|1 - L| / |1 + L|``, with the delay.

    The four highest points of the grid are each looked at again, between their neighbours, ever closer.
    """
    grid = search_grid(loop)
    every = np.arange(grid.shape[0])
    height = _delayed_height(loop, grid, opposite)
    padded = np.pad(height, ((0, 0), (1, 1)), constant_values=-np.inf)
    summit = (height >= padded[:, :-2]) & (height >= padded[:, 2:])
    place = np.argsort(np.where(summit, -height, np.inf), axis=-1)[:, :4]
    low = grid[every[:, None], np.maximum(place - 1, 0)]
    high = grid[every[:, None], np.minimum(place + 1, grid.shape[1] - 1)]
    fractions = np.linspace(0.0, 1.0, 17)
    for _ in range(8):
        near = low[..., None] + (high - low)[..., None] * fractions
        height = _delayed_height(loop, near.reshape(every.size, -1), opposite).reshape(near.shape)
        best = height.argmax(axis=-1)[..., None]
        low, high = (np.take_along_axis(near, np.clip(best + side, 0, 16), axis=-1)[..., 0] for side in (-1, 1))
    middle = 0.5 * (low + high)
    best = _delayed_height(loop, middle, opposite).argmax(axis=-1)
    return middle[every, best]


def _delayed_height(loop: ClosedLoop, omega: FloatArray, opposite: bool) -> FloatArray:
    denominator = evaluate(loop.transfer.denominator, 1j * omega)
    numerator = turned_numerator(loop, np.arange(omega.shape[0]), omega)
    return np.abs((denominator - numerator if opposite else denominator) / (denominator + numerator))
