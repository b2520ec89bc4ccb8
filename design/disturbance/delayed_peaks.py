"""Peaks over frequency of loops with delays: a dense grid, and every high summit of it looked at ever closer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from design.disturbance.closed_system import StablePoints
from design.disturbance.delayed_grid import delayed_grid
from design.disturbance.frequency_grid import summits
from design.disturbance.level_set import Peak
from design.disturbance.open_parts import OpenParts
from model.arrays import ComplexArray, FloatArray, IntArray

#: What is to be largest: heights (..., q) of responses (..., o, p).
Heights = Callable[[ComplexArray], FloatArray]
#: A summit of the grid is looked at when it reaches this part of the highest: the grid shows a resonance from half a
#: half width aside at least, that is 0.89 of its peak. Of many such summits the highest are looked at.
_WORTH_LOOKING, _SUMMITS = 0.8, 12
#: Points that are worked on at once, so that memory does not grow with the grid.
_AT_ONCE = 32
#: Each pass puts nine places between the neighbours of the best; a parabola through the last three is the end of it.
_PASSES, _FRACTIONS = 5, np.linspace(0.0, 1.0, 9)


def delayed_peaks(points: StablePoints, parts: OpenParts, heights: Heights) -> Peak:
    """Largest heights (N, q) over all frequencies, and where, of stable systems (N, ...) with delays.

    The response is no ratio of polynomials, and there is no Hamiltonian to prove it by: what the grid
    (`design.disturbance.delayed_grid`) does not show is not found. Where an output takes an input at once and two
    delays differ, their echoes meet in ever new ways, and a peak far above the loop's band may be missed by 1e-5.
    """
    blocks = [slice(first, first + _AT_ONCE) for first in range(0, max(len(points.R), 1), _AT_ONCE)]
    found = [_peaks_of_block(points.take(block), parts.take(block), heights) for block in blocks]
    return Peak(np.concatenate([peak.gain for peak in found]), np.concatenate([peak.omega for peak in found]))


def _peaks_of_block(points: StablePoints, parts: OpenParts, heights: Heights) -> Peak:
    grid = delayed_grid(points, parts)
    height = heights(points.response(grid))
    places = summits(height, _WORTH_LOOKING, _SUMMITS)
    row, rank, signal = np.nonzero(places >= 0)
    place = places[row, rank, signal]
    low, high = grid[row, np.maximum(place - 1, 0)], grid[row, np.minimum(place + 1, grid.shape[1] - 1)]
    event = np.arange(row.size)
    for _ in range(_PASSES):
        near = low[:, None] + (high - low)[:, None] * _FRACTIONS
        found = heights(points.take(row).response(near))[event, :, signal]
        best = np.clip(found.argmax(axis=-1), 1, 7)
        low, high = near[event, best - 1], near[event, best + 1]
    before, here, after = (found[event, best + side] for side in (-1, 0, 1))
    bend = np.minimum(before + after - 2.0 * here, 0.0)
    shift = np.clip(0.5 * (before - after) / np.where(bend < 0.0, bend, -np.inf), -1.0, 1.0)
    omega = np.where(found.argmax(axis=-1) == 0, near[:, 0], 0.5 * (low + high) + 0.5 * shift * (high - low))
    gain = heights(points.take(row).response(omega[:, None]))[event, 0, signal]
    far = heights(parts.at_infinity().D).max(axis=1)
    peak = Peak(far, np.full((len(height), height.shape[-1]), np.inf))
    return _raised(peak, row, signal, np.maximum(gain, here), np.where(gain >= here, omega, 0.5 * (low + high)))


def _raised(peak: Peak, row: IntArray, signal: IntArray, gain: FloatArray, omega: FloatArray) -> Peak:
    """The peak (N, q), or where a summit (E,) of its row and signal is higher, that."""
    gains, omegas = peak.gain.copy(), peak.omega.copy()
    # Of several summits the last written stays: the highest, so they are written in order.
    order = np.argsort(gain, kind="stable")
    order = order[gain[order] > gains[row[order], signal[order]]]
    gains[row[order], signal[order]], omegas[row[order], signal[order]] = gain[order], omega[order]
    return Peak(gains, np.where(gains > 0.0, omegas, np.nan))
