"""The largest magnitude of a continuous signal, from samples that resolve it."""

from __future__ import annotations

import numpy as np

from design.response.interpolant import local_maxima
from model.arrays import FloatArray

#: A sampled maximum lies above this part of the maximum it stands for.
SAMPLED_PART = 0.9
#: A sample that stands out by less than this part of the largest is rounding.
NOISE = 1e-10


def largest_magnitudes(signals: FloatArray) -> FloatArray:
    """Largest magnitude of each signal at and between the samples.

    Parameters
    ----------
    signals : (..., S, m+1) blocks of even samples; the last sample of a block is the first of the next

    Returns
    -------
    (...) never below the largest sample; 1e-8 of the continuous maximum on samples that resolve the signal
    """
    blocks, samples = signals.shape[-2:]
    size = np.abs(signals)
    top = np.max(size, axis=(-2, -1))
    peaks: FloatArray = top.reshape(-1)
    found = local_maxima(
        size.reshape(-1, blocks, samples),
        SAMPLED_PART * peaks,
        NOISE * peaks,
        signed=signals.reshape(-1, blocks, samples),
    )
    np.maximum.at(peaks, found.row // blocks, found.value)
    return peaks.reshape(top.shape)
