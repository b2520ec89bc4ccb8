"""Monotone cubics (PCHIP) along one axis of a table after the other: no gain leaves the range of its cell's corners.

Slopes are those of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984): the weighted harmonic mean of the slopes
of both neighbouring intervals, zero where they differ in sign; at the ends of an axis the slope of the parabola
through three points, held within what keeps the interval monotone (Moler, Numerical Computing with MATLAB, 3.6). The
table is taken along its last axis first, then what comes of it along the axis before. Within a cell the gains are a
ratio of polynomials of the flight condition: a proof over whole cells does not hold for them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import FloatArray, IntArray


def monotone_cubic(
    values: FloatArray, breakpoints: Sequence[FloatArray], lower: Sequence[IntArray], fraction: Sequence[FloatArray]
) -> FloatArray:
    """The table at conditions (P,).

    At a breakpoint along an axis only that breakpoint counts. Elsewhere a value that is nan spoils every condition that
    it has a part in: along its axis, the two intervals on each side of it.

    Parameters
    ----------
    values : (n_1, .., n_d) table
    breakpoints : strictly increasing, (n_k,) each
    lower : (P,) each, index of the breakpoint below; of an axis of one breakpoint 0
    fraction : (P,) each, how far on the way to the breakpoint above, 0 to 1
    """
    data = values[..., None]
    for axis in reversed(range(len(breakpoints))):
        data = _along_last(data, breakpoints[axis], lower[axis], fraction[axis])
    return data


def slopes(values: FloatArray, breakpoints: FloatArray) -> FloatArray:
    """Slopes (.., n, P) of the cubic at the breakpoints (n,), n two or more, of data (.., n, P)."""
    width = np.diff(breakpoints)[:, None]
    secant = np.diff(values, axis=-2) / width
    if breakpoints.size == 2:
        return np.concatenate([secant, secant], axis=-2)
    before, after = secant[..., :-1, :], secant[..., 1:, :]
    w1, w2 = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    agree = before * after > 0.0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inner = (w1 + w2) / (w1 / before + w2 / after)
    inner = np.where(agree | np.isnan(before * after), inner, 0.0)
    first = _end(width[0], width[1], secant[..., 0, :], secant[..., 1, :])
    last = _end(width[-1], width[-2], secant[..., -1, :], secant[..., -2, :])
    return np.concatenate([first[..., None, :], inner, last[..., None, :]], axis=-2)


def _end(near_width: FloatArray, far_width: FloatArray, near: FloatArray, far: FloatArray) -> FloatArray:
    """Slope at an end from the interval there and the next one."""
    slope = ((2.0 * near_width + far_width) * near - near_width * far) / (near_width + far_width)
    turned = np.sign(slope) != np.sign(near)
    steep = (np.sign(near) != np.sign(far)) & (np.abs(slope) > 3.0 * np.abs(near))
    unknown = np.isnan(slope)
    return np.where(unknown, np.nan, np.where(turned, 0.0, np.where(steep, 3.0 * near, slope)))


def _along_last(data: FloatArray, breakpoints: FloatArray, lower: IntArray, fraction: FloatArray) -> FloatArray:
    """Data (.., n, 1 or P) along its last axis but one, at conditions (P,): (.., P)."""
    if breakpoints.size == 1:
        return np.broadcast_to(data[..., 0, :], (*data.shape[:-2], lower.size))
    data = np.broadcast_to(data, (*data.shape[:-1], lower.size)) if data.shape[-1] != lower.size else data
    slope = slopes(data, breakpoints)
    each = np.arange(lower.size)
    width = breakpoints[lower + 1] - breakpoints[lower]
    t = fraction
    far = t * t * (3.0 - 2.0 * t)
    parts = (
        (1.0 - far, data[..., lower, each]),
        (far, data[..., lower + 1, each]),
        (width * t * (1.0 - t) ** 2, slope[..., lower, each]),
        (width * t * t * (t - 1.0), slope[..., lower + 1, each]),
    )
    total = np.zeros((*data.shape[:-2], lower.size))
    for weight, part in parts:
        # What has no weight takes no part, not even with its nan.
        total = total + np.where(weight == 0.0, 0.0, weight * part)
    return np.asarray(total)
