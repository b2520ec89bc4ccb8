"""Largest values over all frequencies of the closed loop's sensitivities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.crossovers import positive_roots
from design.frequency.delayed import search_grid, turned_numerator
from design.frequency.feedback import ClosedLoop, complementary
from design.frequency.polynomials import evaluate, powers, squared_magnitude, with_derivatives
from model.arrays import FloatArray, GridArrays

#: A peak is proved to be the largest to within this part of its square.
RESOLUTION = 1e-8
#: Two or three passes prove a peak; more than this are only for loops that are next to unstable.
LARGEST_NUMBER_OF_PASSES = 30
#: With a delay: how many local maxima of the grid are looked into. Next to the edge of stability a narrow
#: peak can lie between two points of the grid and show as a low one.
SUMMITS = 16
#: Where the search begins besides the poles: squares of frequencies over the loop's scale, 0 included.
SAMPLES = np.concatenate([[0.0], np.geomspace(1e-3, 4.0, 24) ** 2])


@dataclass(frozen=True, eq=False)
class Peaks(GridArrays):
    """Peaks over all frequencies, (N,), each at least 1 because L vanishes at infinity.

    Attributes
    ----------
    sensitivity : ``max |1 + L|^-1``
    balanced : ``max |S - T| = max |1 - L| / |1 + L|``
    """

    sensitivity: FloatArray
    balanced: FloatArray


def peaks(loop: ClosedLoop) -> Peaks:
    """Peaks of the closed loop's sensitivity functions; meaningless where it is not stable."""
    N = loop.scale.size
    if loop.delayed:
        omega = np.concatenate([_delayed_peak(loop, opposite) for opposite in (False, True)])
    else:
        omega = _peak(loop)
    T, _ = complementary(loop, np.arange(2 * N) % N, omega, loop.delayed)
    sensitivity, balanced = np.abs(1.0 - T[:N]), np.abs(1.0 - 2.0 * T[N:])
    return Peaks(np.maximum(sensitivity, 1.0), np.maximum(balanced, 1.0))


def _peak(loop: ClosedLoop) -> FloatArray:
    """Frequencies (2N,) where S, and where S - T, are largest: ratios of two monic polynomials each.

    From the best of a few frequencies near the closed loop's poles, Newton on the derivative; then the
    proof: the roots of ``|top|^2 - level |bottom|^2`` bound the frequencies that lie above the level, if
    there are any, and the search goes on from their midpoints (Bruinsma and Steinbuch 1990).
    """
    ratio, N = loop.transfer, loop.scale.size
    tops = np.concatenate([ratio.denominator, ratio.denominator - ratio.numerator])
    P, Q = squared_magnitude(tops), np.tile(squared_magnitude(loop.characteristic), (2, 1))
    start = np.concatenate([loop.poles.imag**2, np.abs(loop.poles) ** 2, np.tile(SAMPLES, (N, 1))], axis=-1)
    x, level = _best(P, Q, np.tile(start, (2, 1)))
    level = np.maximum(level, 1.0)
    active = np.arange(x.size)
    for _ in range(LARGEST_NUMBER_OF_PASSES):
        above = level[active] * (1.0 + RESOLUTION)
        edges = np.sort(positive_roots(P[active] - above[:, None] * Q[active]), axis=-1)
        middles = 0.5 * (edges[:, 1:] + edges[:, :-1])
        exceeded = ~np.isnan(middles).all(axis=-1)
        if not exceeded.any():
            break
        active, above, middles = active[exceeded], above[exceeded], middles[exceeded]
        found, height = _best(P[active], Q[active], np.where(np.isnan(middles), 0.0, middles))
        better = height > above
        active = active[better]
        x[active], level[active] = found[better], height[better]
    return np.sqrt(x)


def _best(P: FloatArray, Q: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where ``P/Q`` is largest (N,) among `start` (N, m), sharpened by Newton on ``P'Q - PQ'``; its value."""
    heights = evaluate(P, start) / evaluate(Q, start)
    best = np.argmax(heights, axis=-1)[:, None]
    start, height = (np.take_along_axis(v, best, axis=-1)[:, 0] for v in (start, heights))
    both, x = with_derivatives(np.stack([P, Q])), start
    for _ in range(3):
        (p, dp, ddp), (q, dq, ddq) = np.moveaxis(both @ powers(x, P.shape[-1])[..., None], 1, -2)[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            x = x - (dp * q - p * dq) / (ddp * q - p * ddq)
        x = np.where(np.isfinite(x) & (x > 0.0), x, start)
    p, q = (both[:, :, 0] * powers(x, P.shape[-1])).sum(axis=-1)
    return np.where(p > height * q, x, start), np.maximum(p / q, height)


def _delayed_peak(loop: ClosedLoop, opposite: bool) -> FloatArray:
    """Frequency (N,) of the largest ``|1 + L|^-1``, or ``|1 - L| / |1 + L|``, with the delay.

    The highest summits of the grid are each looked at again, between their neighbours, ever closer.
    """
    grid = search_grid(loop)
    every = np.arange(grid.shape[0])
    height = _delayed_height(loop, grid, opposite)
    padded = np.pad(height, ((0, 0), (1, 1)), constant_values=-np.inf)
    summit = (height >= padded[:, :-2]) & (height >= padded[:, 2:])
    place = np.argsort(np.where(summit, -height, np.inf), axis=-1)[:, :SUMMITS]
    low = grid[every[:, None], np.maximum(place - 1, 0)]
    high = grid[every[:, None], np.minimum(place + 1, grid.shape[1] - 1)]
    fractions = np.linspace(0.0, 1.0, 17)
    for _ in range(6):
        near = low[..., None] + (high - low)[..., None] * fractions
        height = _delayed_height(loop, near.reshape(every.size, -1), opposite).reshape(near.shape)
        best = height.argmax(axis=-1)[..., None]
        low, high = (np.take_along_axis(near, np.clip(best + side, 0, 16), axis=-1)[..., 0] for side in (-1, 1))
    middle = 0.5 * (low + high)
    best = _delayed_height(loop, middle, opposite).argmax(axis=-1)[:, None]
    return np.take_along_axis(middle, best, axis=-1)[:, 0]


def _delayed_height(loop: ClosedLoop, omega: FloatArray, opposite: bool) -> FloatArray:
    denominator = evaluate(loop.transfer.denominator, np.asarray(1j * omega, dtype=complex))
    numerator = turned_numerator(loop, np.arange(omega.shape[0]), omega)
    top = denominator - numerator if opposite else denominator
    return np.asarray(np.abs(top / (denominator + numerator)))
