"""Peaks of transfers over all frequencies: of every pair of input and output, and of the whole system (H-infinity)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from design.disturbance.closed_system import ClosedSystem, StablePoints
from design.disturbance.delayed_peaks import Heights, delayed_peaks
from design.disturbance.frequency_grid import distinct, summits
from design.disturbance.level_set import Peak, proved_peak
from design.disturbance.lyapunov import balanced
from design.disturbance.open_parts import Matrices
from design.disturbance.pair_screen import PairScreen
from design.disturbance.summits import largest_singular_value
from design.frequency.polynomials import nearby_power_of_two
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

#: The grid that a search starts from: this many frequencies, to this far beyond the slowest and the fastest mode.
_POINTS, _REACH = 24, 8.0
#: Places about each mode, in units of its half width.
_OFFSETS = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
#: Summits of the grid are climbed that reach this part of the highest, and no more of them than this.
_WORTH_CLIMBING, _SUMMITS = 0.8, 4


def pair_peaks(system: ClosedSystem) -> Peak:
    """Largest gain over all frequencies from each input to each output.

    Returns
    -------
    Peak : gain (*G, o, p) [unit of the output per unit of the input], accurate to 1e-9 of it, and omega (*G, o, p)
        [rad/s], 0 and inf included. A gain is inf where the output takes the rate of the input; both are nan where
        the loop is not stable or not finite, and omega where the gain is zero.
    """
    points = system.stable_points
    if points.parts is not None:
        found = delayed_peaks(points, points.parts, _of_pairs)
    else:
        matrices = balanced(points.matrices)
        search = _Search.of(points, _of_pairs)
        pairs = _in_units(_pairs(matrices), search.scale)
        found = proved_peak(pairs, search.start, search.quiet, PairScreen(matrices, search.scale))
        found = Peak(found.gain * search.scale, found.omega)
    nothing = ~(points.linked | points.direct)
    return _over_grid(system, found, points.R != 0.0, nothing)


def h_infinity_norm(system: ClosedSystem) -> Peak:
    """Largest singular value of the whole transfer over all frequencies, (*G,) each; otherwise as `pair_peaks`.

    It is the largest ratio of the root mean squares of all outputs and all inputs together, in the units that they
    have: it means something where inputs are alike and outputs are.
    """
    points = system.stable_points
    if points.parts is not None:
        found = delayed_peaks(points, points.parts, lambda value: largest_singular_value(value)[..., None])
    else:
        search = _Search.of(points, lambda value: np.linalg.norm(value, axis=(-2, -1))[..., None])
        found = proved_peak(_in_units(balanced(points.matrices), search.scale), search.start, search.quiet)
        found = Peak(found.gain * search.scale, found.omega)
    nothing = ~np.any(points.linked | points.direct, axis=(-2, -1))
    return _over_grid(system, found, np.any(points.R != 0.0, axis=(-2, -1)), nothing)


def _of_pairs(value: ComplexArray) -> FloatArray:
    """Magnitudes (..., o p) of responses (..., o, p)."""
    return np.abs(value).reshape(*value.shape[:-2], value.shape[-2] * value.shape[-1])


@dataclass(frozen=True, eq=False)
class _Search(GridArrays):
    """Where N q signals are searched from.

    Attributes
    ----------
    start : (N q, S) frequencies near their highest summits, nan padded [rad/s]
    quiet : (N q,) where they are smallest [rad/s]
    scale : (N q,) their size, a power of two
    """

    start: FloatArray
    quiet: FloatArray
    scale: FloatArray

    @classmethod
    def of(cls, points: StablePoints, heights: Heights) -> Self:
        """From a grid: zero, a ladder over the decades, and places about every mode.

        A resonance with a quarter of its half width between it and the next place shows 0.97 of its peak.
        """
        size = np.abs(points.poles)
        low, high = size.min(axis=-1, keepdims=True) / _REACH, size.max(axis=-1, keepdims=True) * _REACH
        ladder = low * (high / low) ** np.linspace(0.0, 1.0, _POINTS)
        about = [np.abs(points.poles.imag) + np.abs(points.poles.real) * offset for offset in _OFFSETS]
        grid = distinct(np.abs(np.concatenate([0.0 * low, ladder, size, *about], axis=-1)))
        height = heights(points.response(grid))
        place = summits(height, _WORTH_CLIMBING, _SUMMITS)
        row = np.arange(len(grid))[:, None]
        start = np.where(place >= 0, grid[row[..., None], place], np.nan)
        quiet = grid[row, np.argmin(height, axis=1)]
        scale = nearby_power_of_two(height.max(axis=1))
        return cls(start.swapaxes(1, 2).reshape(-1, _SUMMITS), quiet.reshape(-1), scale.reshape(-1))


def _pairs(system: Matrices) -> Matrices:
    """Each pair as a system of its own, (N o p, ...)."""
    A, B, C, D = system.A, system.B, system.C, system.D
    point, i, j = (index.reshape(-1) for index in np.indices(D.shape))
    return Matrices(A[point], B.mT[point, j][..., None], C[point, i][:, None], D[point, i, j][:, None, None])


def _in_units(system: Matrices, scale: FloatArray) -> Matrices:
    """Systems (N, ...) whose outputs are in units of a scale (N,): no square of a gain over- or underflows."""
    unit = scale[:, None, None]
    return Matrices(system.A, system.B, system.C / unit, system.D / unit)


def _over_grid(system: ClosedSystem, found: Peak, endless: BoolArray, nothing: BoolArray) -> Peak:
    """Peaks of the stable points over the grid: `endless` (N, ...) where they grow with frequency, or zero."""
    gain, omega = (values.reshape(endless.shape) for values in (found.gain, found.omega))
    gain = np.where(nothing, 0.0, np.where(endless, np.inf, gain))
    omega = np.where(nothing, np.nan, np.where(endless, np.inf, omega))
    return Peak(system.over_grid(gain), system.over_grid(omega))
