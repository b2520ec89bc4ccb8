"""Simultaneous margins of a sampled loop, by the bilinear map of the unit circle to the imaginary axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.robustness.input_loop import InputLoop
from design.robustness.simultaneous import SimultaneousMargins, closed_or_zero, margins_of, peaks_of, stacked
from model.arrays import FloatArray


def simultaneous_margins_sampled(
    Ad: FloatArray, Bd: FloatArray, K: FloatArray, sample_time: float
) -> SimultaneousMargins:
    """Margins against simultaneous changes at both inputs of ``x[k+1] = Ad x[k] + Bd u[k]``, ``u = -K x``.

    With ``z = (1 + s) / (1 - s)``, that is ``s = j tan(w sample_time / 2)`` on the unit circle, the complementary
    sensitivity ``K (zI - Ad + Bd K)^-1 Bd`` has a state space of the same order again, and a value at infinity: that at
    half the sample rate. Peaks and proofs are therefore those of a continuous loop.

    Parameters
    ----------
    Ad (*G, n, n), Bd (*G, n, 2), K (*G, 2, n) : delays of whole samples are states of Ad
    sample_time : > 0 [s]

    Returns
    -------
    Frequencies in [0, pi / sample_time] [rad/s]; nan where the closed loop is not stable. A worst factor puts a pole at
    ``exp(j disk_omega sample_time)``.

    Raises
    ------
    ValueError : the shapes do not fit, or the sample time is not positive
    """
    if not (np.isfinite(sample_time) and sample_time > 0.0):
        raise ValueError(f"sample time must be positive, is {sample_time} s")
    A, B, K, grid = stacked(Ad, Bd, K)
    closed, finite = closed_or_zero(A, B, K)
    stable = finite & (np.abs(np.linalg.eigvals(closed)).max(axis=-1) < 1.0 - 1e-12)
    # The others are not looked at, and must not stop the rest.
    closed = np.where(stable[:, None, None], closed, 0.0)
    identity = np.eye(closed.shape[-1])
    inverse = np.linalg.inv(identity + closed)
    mapped, outputs, inputs = inverse @ (closed - identity), K @ inverse, inverse @ B
    poles = np.linalg.eigvals(mapped).astype(complex)
    D = np.where(stable[:, None, None], -outputs @ B, 0.0)
    loop = InputLoop(mapped, inputs, 2.0 * outputs, D, poles, np.zeros((len(A), 2)))
    found = peaks_of(loop, stable)
    return margins_of(replace(found, omega=2.0 / sample_time * np.arctan(found.omega)), grid)
