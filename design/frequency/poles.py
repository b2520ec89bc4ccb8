"""Poles of a batch of state matrices, in a fixed order, and what is read off them."""

from __future__ import annotations

import numpy as np

from model.arrays import ComplexArray, FloatArray


def poles(A: FloatArray) -> ComplexArray:
    """Eigenvalues of `A`, (*G, n) [rad/s], each grid point sorted by `pole_order`.

    Parameters
    ----------
    A : (*G, n, n), finite

    Raises
    ------
    numpy.linalg.LinAlgError : an entry is not finite
    """
    return pole_order(np.linalg.eigvals(A).astype(complex))


def pole_order(values: ComplexArray) -> ComplexArray:
    """Sort the last axis by real part, then by distance from the real axis, then by imaginary part.

    The two of a conjugate pair have the same real part to the last bit, so they stay adjacent, the
    lower one first; pairs that share their real part (several on the axis) do not interleave.
    """
    order = np.lexsort((values.imag, np.abs(values.imag), values.real), axis=-1)
    return np.take_along_axis(values, order, axis=-1)


def natural_frequency(poles: ComplexArray) -> FloatArray:
    """Distance from the origin, same shape as `poles` [rad/s]."""
    return np.abs(poles)


def damping_ratio(poles: ComplexArray) -> FloatArray:
    """``-Re p / |p|``, same shape as `poles`: 1 for a stable real pole, negative for an unstable one.

    A pole at the origin has no direction. It neither decays nor grows, so its damping ratio is put
    at 0, the value every pole on the imaginary axis has.
    """
    magnitude = np.abs(poles)
    nonzero = np.where(magnitude > 0.0, magnitude, 1.0)
    return np.where(magnitude > 0.0, -poles.real / nonzero, 0.0)


def least_damping_ratio(poles: ComplexArray) -> FloatArray:
    """Smallest damping ratio of each grid point's poles (*G, n), (*G,)."""
    return np.asarray(damping_ratio(poles).min(axis=-1))


def largest_real_part(poles: ComplexArray) -> FloatArray:
    """Spectral abscissa of each grid point's poles (*G, n), (*G,) [rad/s]; negative when all are stable."""
    return np.asarray(poles.real.max(axis=-1))
