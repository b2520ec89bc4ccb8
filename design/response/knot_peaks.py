"""The largest magnitudes of signals that may jump and bend at knots, refined between the samples."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from design.response.driven import SampledSignals
from design.response.extremes import NOISE, SAMPLED_PART
from design.response.interpolant import local_maxima
from model.arrays import FloatArray


def largest_between_knots(parts: Iterable[SampledSignals], shape: tuple[int, ...]) -> FloatArray:
    """(*G, q) = `shape`: largest magnitude of each signal, limits just before and after the knots included."""
    peaks = np.zeros(shape)
    for part in parts:
        peaks = raised(peaks, part.values)
    return peaks


def raised(peaks: FloatArray, values: FloatArray) -> FloatArray:
    """Peaks (*G, q) so far, or those of signals (*G, q, c, S, m+1) where these are larger.

    Each of the c stretches is a signal of its own, so that nothing is compared across a knot.
    """
    size = np.abs(values)
    with np.errstate(invalid="ignore"):
        raised_to: FloatArray = np.maximum(peaks, np.max(size, axis=(-3, -2, -1)))
        tops = np.repeat(raised_to.reshape(-1), values.shape[-3])
        shape = (-1, *values.shape[-2:])
        found = local_maxima(
            size.reshape(shape), SAMPLED_PART * tops, NOISE * tops, signed=np.ascontiguousarray(values).reshape(shape)
        )
    per_signal = values.shape[-3] * values.shape[-2]
    np.maximum.at(raised_to.reshape(-1), found.row // per_signal, found.value)
    return raised_to
