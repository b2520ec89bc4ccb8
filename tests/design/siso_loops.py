"""Loops to test with: of a given transfer function, and random ones that feedback stabilises."""

import numpy as np
from scipy.signal import tf2ss

from design.loop import SisoLoop


def of_transfer(numerator, denominator, gain=1.0, sign=1, delay=0.0):
    """The loop with this transfer function, in controllable form."""
    A, B, C, _ = tf2ss(np.atleast_1d(numerator), np.atleast_1d(denominator))
    return SisoLoop("test", A, B[:, 0], C[0], np.array(float(gain)), sign, delay)


def stabilised(count, order, seed, sign=1, gain=1.0, delay=0.0):
    """Random loops: the closed loop is stable by construction, about half of the open loops are not."""
    rng = np.random.default_rng(seed)
    closed = rng.standard_normal((count, order, order))
    growth = np.linalg.eigvals(closed).real.max(axis=-1) + rng.uniform(0.05, 1.0, count)
    closed -= growth[:, None, None] * np.eye(order)
    b = rng.standard_normal((count, order))
    c = rng.standard_normal((count, order)) * rng.choice([0.3, 1.0, 3.0], (count, 1))
    A = closed + b[:, :, None] * c[:, None, :]
    return SisoLoop("test", A, sign * b / gain, c, np.full(count, gain), sign, delay)


def abscissa(loop, gain):
    """Largest real part of the closed loop's eigenvalues at the gains (*G,)."""
    return np.linalg.eigvals(loop.closed(np.asarray(gain))).real.max(axis=-1)


def same(a, b, tolerance=1e-9):
    """Equal to a relative tolerance, infinities and missing values included."""
    a, b = np.asarray(a), np.asarray(b)
    scale = np.maximum(1.0, np.abs(np.where(np.isfinite(b), b, 0.0)))
    np.testing.assert_allclose(a / scale, b / scale, rtol=0.0, atol=tolerance)


def in_other_states(loop, seed):
    """The same loop in random states: what was exactly zero is only zero within rounding."""
    n = loop.A.shape[-1]
    T = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
    return SisoLoop(loop.name, T.T @ loop.A @ T, T.T @ loop.b, loop.c @ T, loop.gain, loop.sign, loop.delay)
