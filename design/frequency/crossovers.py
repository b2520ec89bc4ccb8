"""Where a loop crosses the unit circle and the negative real axis, to the last digit.

Crossings start from the roots of polynomials in ``x = w^2`` (or, for the real axis with a delay in the loop,
from brackets on a grid) and end with Newton steps on the state-space response.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.frequency.delayed import real_axis_brackets
from design.frequency.feedback import ClosedLoop, complementary, log_slope, open_loop_value
from design.frequency.polynomials import imaginary_cross, roots, squared_magnitude
from model.arrays import ComplexArray, FloatArray, GridArrays

#: A root counts as real when its imaginary part is below this part of its size (the curve touches).
NEARLY_REAL = 1e-6
#: A Newton step from a root of the polynomials is never longer than this part of the frequency.
SETTLED = 1e-5
#: Gain ratios outside this range are no margins but the trace of a pole at the origin, or of no loop at all.
RATIO_RANGE = (1e-6, 1e6)
#: With a delay, how many crossings of the real axis are kept.
DELAYED_CROSSINGS = 16

#: Real function of T and dT/dw that is zero at the crossing, and its derivative with respect to w.
Residual = Callable[[ComplexArray, ComplexArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class Crossings(GridArrays):
    """Frequencies (N, M) in units of the loop's scale, rising, nan padded, with T and dT/dw there."""

    omega: FloatArray
    value: ComplexArray
    slope: ComplexArray


def gain_crossings(loop: ClosedLoop) -> Crossings:
    """All frequencies where ``|L| = 1`` (N, n). A delay has no part in them; T is the one without it."""
    ratio = loop.transfer
    x = positive_roots(squared_magnitude(ratio.denominator) - squared_magnitude(ratio.numerator))
    return _polished(loop, np.sqrt(x), _log_magnitude, delayed=False)


def phase_crossings(loop: ClosedLoop) -> Crossings:
    """All frequencies where L is real and negative, zero frequency included, (N, n).

    With a delay (N, `DELAYED_CROSSINGS`): those whose critical gain ratio is nearest to 1.
    """
    if loop.delayed:
        start, width = real_axis_brackets(loop, DELAYED_CROSSINGS), DELAYED_CROSSINGS
    else:
        start, width = real_axis_frequencies(loop.transfer.numerator, loop.transfer.denominator), None
    found = _polished(loop, start, _imaginary, loop.delayed)
    distance = np.abs(np.log(critical_ratio(found.value)))
    nearest = np.argsort(distance, axis=-1)[:, :width]
    omega = np.where(np.isnan(distance), np.nan, found.omega)
    value, slope = (np.take_along_axis(v, nearest, axis=-1) for v in (found.value, found.slope))
    return _sorted(np.take_along_axis(omega, nearest, axis=-1), value, slope)


def critical_ratio(T: ComplexArray) -> FloatArray:
    """``-1/L``: gain over the gain flown that puts a closed-loop pole there; nan outside `RATIO_RANGE`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (1.0 - 1.0 / T).real
        return np.where((ratio > RATIO_RANGE[0]) & (ratio < RATIO_RANGE[1]), ratio, np.nan)


def positive_roots(p: FloatArray) -> FloatArray:
    """Positive real roots of (N, m+1), (N, m) nan padded; of a pair that rounding took off the axis, one."""
    x = roots(p)
    with np.errstate(invalid="ignore"):
        real = (x.real > 0.0) & (x.imag >= 0.0) & (x.imag <= NEARLY_REAL * np.abs(x))
    return np.where(real, x.real, np.nan)


def real_axis_frequencies(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    """Zero, and the frequencies where the ratio of two (N, n+1) polynomials is real: (N, n), nan padded."""
    x = positive_roots(imaginary_cross(numerator, denominator))
    return np.concatenate([np.zeros((x.shape[0], 1)), np.sqrt(x)], axis=-1)


def _log_magnitude(T: ComplexArray, slope: ComplexArray) -> tuple[FloatArray, FloatArray]:
    return np.log(np.abs(open_loop_value(T))), log_slope(T, slope)


def _imaginary(T: ComplexArray, slope: ComplexArray) -> tuple[FloatArray, FloatArray]:
    return T.imag, slope.imag


def _polished(loop: ClosedLoop, start: FloatArray, residual: Residual, delayed: bool) -> Crossings:
    """One Newton step from `start` (N, M); what is not there already was no crossing and is dropped."""
    valid = ~np.isnan(start)
    rows = np.nonzero(valid)[0]
    w = start[valid]
    with np.errstate(divide="ignore", invalid="ignore"):
        error, rate = residual(*complementary(loop, rows, w, delayed))
        step = np.where(error == 0.0, 0.0, error / rate)
        close = np.abs(step) <= SETTLED * w
    w = np.where(close, w - step, w)
    T, T_slope = complementary(loop, rows, w, delayed)
    omega = np.full(start.shape, np.nan)
    value, slope = (np.full(start.shape, complex(np.nan, np.nan)) for _ in range(2))
    omega[valid], value[valid], slope[valid] = np.where(close, w, np.nan), T, T_slope
    return _sorted(omega, value, slope)


def _sorted(omega: FloatArray, value: ComplexArray, slope: ComplexArray) -> Crossings:
    order = np.argsort(omega, axis=-1)
    frequency = np.take_along_axis(omega, order, axis=-1)
    gone = np.isnan(frequency)
    T, T_slope = (np.where(gone, np.nan, np.take_along_axis(v, order, axis=-1)) for v in (value, slope))
    return Crossings(frequency, T, T_slope)
