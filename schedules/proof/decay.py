"""The rate that a Lyapunov matrix proves, and how far arithmetic may be off: the verdict, whatever a solver says.

With ``P = L L'`` and ``A~ = L' A L^-T``, ``A' P + P A + 2 alpha P <= 0`` says that the largest eigenvalue of the
symmetric part of A~ is at most ``-alpha``. The rounding of ``L' A L^-T`` and of A itself is bounded entry by entry by a
few units in the last place of ``|L'| |A| |L^-T|``, A taken as the sum of the sizes of its parts, times the condition of
L. The margin is `SAFETY` times that to first order.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray

SAFETY = 4.0


def decay_rates(A: FloatArray, P: FloatArray) -> FloatArray:
    """Rates (*G,) [1/s] at which ``x' P x`` (twice as fast) surely decays: A and P (*G, n, n), broadcasting.

    Raises
    ------
    numpy.linalg.LinAlgError : a P that is not positive definite
    """
    L = np.linalg.cholesky(P)
    turned = np.swapaxes(L, -1, -2) @ A @ np.swapaxes(np.linalg.inv(L), -1, -2)
    return np.asarray(-np.linalg.eigvalsh(0.5 * (turned + np.swapaxes(turned, -1, -2)))[..., -1])


def rounding(sizes: FloatArray, P: FloatArray, parts: int) -> FloatArray:
    """Margin (*G,) [1/s] above the arithmetic's own error in `decay_rates`.

    Parameters
    ----------
    sizes : (*G, n, n) sums of the absolute values of the parts of A
    P : (*G, n, n)
    parts : how many parts each entry of A is added up from
    """
    L = np.linalg.cholesky(P)
    left, right = np.abs(np.swapaxes(L, -1, -2)), np.abs(np.swapaxes(np.linalg.inv(L), -1, -2))
    condition = np.max(np.sum(left @ right, axis=-1), axis=-1)
    size = np.sqrt(np.sum((left @ sizes @ right) ** 2, axis=(-2, -1)))
    units = sizes.shape[-1] * 3.0 + parts + 8.0
    return np.asarray(SAFETY * units * float(np.finfo(float).eps) * condition * size)


def slowest(A: FloatArray) -> FloatArray:
    """Decay rate (*G,) [1/s] of the slowest mode of A (*G, n, n); negative where it grows."""
    return np.asarray(-np.max(np.linalg.eigvals(A).real, axis=-1))
