"""The fastest mode of the surfaces: the one that shows whether the aerodynamic model is quick enough."""

from __future__ import annotations

import numpy as np

from model.arrays import ComplexArray, FloatArray
from model.modes import modes


def fastest_surface_mode(
    A: FloatArray, states: tuple[str, ...], surfaces: tuple[str, ...], sample_time: float | None = None
) -> ComplexArray:
    """Eigenvalue of largest modulus among the modes that are motion of given surfaces (*G,) [rad/s].

    The share of a mode that is theirs is the participation (`model.modes`) of their angles and rates. A mode
    counts when its share is at least half of the largest one: so one always does, and modes of filters,
    integrals, actuators and of the circulation do not. One whose share cannot be told (a repeated eigenvalue)
    counts. Of a pair the one with positive imaginary part is given.

    Parameters
    ----------
    A : (*G, n, n) finite
    states : names of its rows, of the first ones at least
    surfaces : ``dt``, ``da`` or both: those that the air moves; a tab whose position is imposed is not one
    sample_time : of ``x_(k+1) = A x_k`` [s], whose modes are at ``ln z / T``; commands on their way, whose share cannot
        be told, do not count. None: of ``x' = A x``
    """
    found = modes(A, np.zeros((1, A.shape[-1])))
    rows = [states.index(name) for surface in surfaces for name in (surface, f"{surface}_rate")]
    share = np.sum(found.participation[..., rows, :], axis=-2)
    share = np.where(np.isnan(share), 1.0 if sample_time is None else 0.0, share)
    counts = share >= 0.5 * np.max(share, axis=-1, keepdims=True)
    values = (
        found.eigenvalues if sample_time is None else np.log(found.eigenvalues + np.finfo(float).tiny) / sample_time
    )
    size = np.where(counts, np.abs(values), -1.0)
    pick = np.argmax(size, axis=-1)[..., None]
    fastest = np.take_along_axis(values, pick, axis=-1)[..., 0]
    return np.asarray(fastest.real + 1j * np.abs(fastest.imag))
