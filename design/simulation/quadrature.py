"""Derivatives and integrals of samples that are even from segment to segment, by cubics through four of them."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, IntArray


def derivative(time: FloatArray, segment: IntArray, y: FloatArray) -> FloatArray:
    """Derivatives (M, P) [1/s] of samples (M, P) at times (M,), each segment (M,) by itself."""
    found = np.zeros_like(y)
    for rows, step in _runs(time, segment):
        part = y[rows]
        if len(part) < 5:
            found[rows] = np.gradient(part, step, axis=0, edge_order=1 if len(part) < 3 else 2)
            continue
        slope = found[rows]
        slope[2:-2] = (part[:-4] - 8.0 * part[1:-3] + 8.0 * part[3:-1] - part[4:]) / (12.0 * step)
        for sign, ends in ((1.0, part[:5]), (-1.0, part[:-6:-1])):
            at = 0 if sign > 0.0 else -1
            slope[at] = sign * (-25.0 * ends[0] + 48.0 * ends[1] - 36.0 * ends[2] + 16.0 * ends[3] - 3.0 * ends[4])
            slope[at + (1 if sign > 0.0 else -1)] = sign * (
                -3.0 * ends[0] - 10.0 * ends[1] + 18.0 * ends[2] - 6.0 * ends[3] + ends[4]
            )
        slope[[0, 1, -2, -1]] /= 12.0 * step
    return found


def running_integral(time: FloatArray, segment: IntArray, y: FloatArray) -> FloatArray:
    """Integrals (M, ..., P) from the first time on of samples (M, ..., P), each segment (M,) by itself."""
    found, so_far = np.zeros_like(y), np.zeros(y.shape[1:])
    for rows, step in _runs(time, segment):
        parts = interval_integrals(y[rows]) * step
        found[rows] = so_far + np.concatenate([np.zeros((1, *y.shape[1:])), np.cumsum(parts, axis=0)])
        so_far = found[rows][-1]
    return found


def interval_integrals(y: FloatArray) -> FloatArray:
    """Integrals (k - 1, ...) over each interval of even samples (k, ...), in steps."""
    if len(y) < 4:
        if len(y) == 3:
            first = (5.0 * y[0] + 8.0 * y[1] - y[2]) / 12.0
            return np.stack([first, (5.0 * y[2] + 8.0 * y[1] - y[0]) / 12.0])
        return np.asarray(0.5 * (y[1:] + y[:-1]))
    parts = np.empty((len(y) - 1, *y.shape[1:]))
    parts[1:-1] = (13.0 * (y[1:-2] + y[2:-1]) - y[:-3] - y[3:]) / 24.0
    parts[0] = (9.0 * y[0] + 19.0 * y[1] - 5.0 * y[2] + y[3]) / 24.0
    parts[-1] = (9.0 * y[-1] + 19.0 * y[-2] - 5.0 * y[-3] + y[-4]) / 24.0
    return parts


def runs(segment: IntArray) -> list[slice]:
    """The nodes of each segment, from the segments' numbers (M,)."""
    starts = np.flatnonzero(np.diff(segment, prepend=-1))
    return [slice(int(a), int(b)) for a, b in zip(starts, [*starts[1:], len(segment)], strict=True)]


def _runs(time: FloatArray, segment: IntArray) -> list[tuple[slice, float]]:
    return [(rows, float((time[rows][-1] - time[rows][0]) / (rows.stop - rows.start - 1))) for rows in runs(segment)]
