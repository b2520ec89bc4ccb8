"""Where a loop crosses the unit circle and the negative real axis, to the last digit.

Crossings start from the roots of polynomials in ``x = w^2`` (or, for the real axis with a delay in the loop,
from brackets on a grid) and end with a Newton step on the response itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.frequency.delayed import GridResponse, grid_response, real_axis_starts, unit_circle_starts
from design.frequency.feedback import MOST_STATES, ClosedLoop, complementary, log_slope, open_loop_value
from design.frequency.nearest import nearest_each_way
from design.frequency.polynomials import imaginary_cross, real_cross, squared_magnitude
from design.frequency.positive_roots import position_in_row, positive_roots
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

#: A Newton step from a root of the polynomials is never longer than this part of the frequency.
SETTLED = 1e-5
#: Gain ratios outside this range are no margins but the trace of a pole at the origin, or of no loop at all.
RATIO_RANGE = (1e-6, 1e6)
#: With a delay or very many states, how many crossings of the real axis are kept.
SEARCHED_CROSSINGS = 16

#: Real function of T and dT/dw that is zero at the crossing, and its derivative with respect to w.
Residual = Callable[[ComplexArray, ComplexArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class Crossings(GridArrays):
    """Frequencies (N, M) in units of the loop's scale, rising, nan padded, with T and dT/dw there."""

    omega: FloatArray
    value: ComplexArray
    slope: ComplexArray


def gain_crossings(loop: ClosedLoop, found: GridResponse | None = None) -> Crossings:
    """All frequencies where ``|L| = 1`` (N, n). A delay has no part in them; T is the one without it.

    Parameters
    ----------
    found : `design.frequency.delayed.grid_response` of the loop where it is at hand; of use for many states only
    """
    if loop.numerator.shape[1] - 1 > MOST_STATES:
        start = unit_circle_starts(loop, found or grid_response(loop))
    else:
        T, whole = loop.numerator, loop.characteristic
        start = np.sqrt(positive_roots(squared_magnitude(whole) - 2.0 * real_cross(T, whole)))
    rows, w, value, slope = _polished(loop, start, _log_magnitude, delayed=False)
    return _in_rows((start.shape[0], loop.numerator.shape[1] - 1), rows, w, value, slope)


def phase_crossings(loop: ClosedLoop, found: GridResponse | None = None) -> Crossings:
    """All frequencies where L is real and negative, zero frequency included, (N, n).

    Of a sampled loop half the sampling rate is one as well, so that there are (N, n+1).
    With a delay, or more than `MOST_STATES`, (N, `SEARCHED_CROSSINGS`): those whose critical gain ratio is
    nearest to 1, above and below it.

    Parameters
    ----------
    found : `design.frequency.delayed.grid_response` of the loop where it is at hand; of use where it is searched only
    """
    if loop.searched:
        start = real_axis_starts(loop, found or grid_response(loop), SEARCHED_CROSSINGS)
    else:
        start = real_axis_frequencies(loop.numerator, loop.characteristic)
    if loop.sample_time is not None:
        start = np.concatenate([start, np.full((start.shape[0], 1), np.inf)], axis=-1)
    width = SEARCHED_CROSSINGS if loop.searched else start.shape[1]
    rows, w, value, slope = _polished(loop, start, _imaginary, loop.delayed)
    ratio = critical_ratio(value)
    kept = ~np.isnan(ratio)
    if loop.searched:
        kept &= nearest_each_way(rows, ratio, start.shape[0], width)
    return _in_rows((start.shape[0], width), rows[kept], w[kept], value[kept], slope[kept])


def critical_ratio(T: ComplexArray) -> FloatArray:
    """``-1/L``: gain over the gain flown that puts a closed-loop pole there; nan outside `RATIO_RANGE`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (1.0 - 1.0 / T).real
        return np.where((ratio > RATIO_RANGE[0]) & (ratio < RATIO_RANGE[1]), ratio, np.nan)


def real_axis_frequencies(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Zero, and the frequencies where the ratio of two (N, n+1) polynomials is real: (N, n), rising, nan padded."""
    x = positive_roots(imaginary_cross(numerator, denominator))
    return np.concatenate([np.zeros((x.shape[0], 1)), np.sqrt(x)], axis=-1)


def _log_magnitude(T: ComplexArray, slope: ComplexArray) -> tuple[FloatArray, FloatArray]:
    return np.log(np.abs(open_loop_value(T))), log_slope(T, slope)


def _imaginary(T: ComplexArray, slope: ComplexArray) -> tuple[FloatArray, FloatArray]:
    return T.imag, slope.imag


def _polished(
    loop: ClosedLoop, start: FloatArray, residual: Residual, delayed: bool
) -> tuple[IntArray, FloatArray, ComplexArray, ComplexArray]:
    """Rows, frequencies, T and dT/dw (K,) one Newton step from `start` (N, M), row by row.

    What is not there already was no crossing and is dropped.
    """
    valid = ~np.isnan(start)
    rows, w = np.nonzero(valid)[0], start[valid]
    with np.errstate(divide="ignore", invalid="ignore"):
        error, rate = residual(*complementary(loop, rows, w, delayed))
        step = np.where(error == 0.0, 0.0, error / rate)
        close = np.abs(step) <= SETTLED * w
    if not close.all():
        rows, w, step = rows[close], w[close], step[close]
    w = w - step
    return rows, w, *complementary(loop, rows, w, delayed)


def _in_rows(
    shape: tuple[int, ...], rows: IntArray, w: FloatArray, value: ComplexArray, slope: ComplexArray
) -> Crossings:
    """Entries (K,) in the order of their `rows` (K,), put side by side in arrays of that shape (N, M)."""
    place = rows, position_in_row(rows, shape[0])
    omega = np.full(shape, np.nan)
    T, T_slope = (np.full(shape, complex(np.nan, np.nan)) for _ in range(2))
    omega[place], T[place], T_slope[place] = w, value, slope
    return Crossings(omega, T, T_slope)
