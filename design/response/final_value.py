"""Where the outputs of an undriven linear system settle: exact values, or nan where they do not."""

from __future__ import annotations

import numpy as np

from model.arrays import BoolArray, ComplexArray, FloatArray

#: A pole decays when its real part is below this part of the fastest pole's magnitude; rounding hides less.
DECAY_TOLERANCE = 1e-10
#: A mode that does not decay is out of an output's sight when its part of the output's slope is below this.
SIGHT_TOLERANCE = 1e-9


def decaying(poles: ComplexArray) -> BoolArray:
    """(*G, n) mask of the poles whose modes die out."""
    size = np.max(np.abs(poles), axis=-1, keepdims=True, initial=0.0)
    return np.asarray(poles.real < -DECAY_TOLERANCE * size)


def final_values(generator: FloatArray, rows: FloatArray, poles: ComplexArray) -> FloatArray:
    """Limits of ``y = rows z`` for ``z' = generator z`` from ``z(0) = [0, 1]``.

    Parameters
    ----------
    generator : (*G, n+1, n+1) ``[[A, b], [0, 0]]`` [1/s]
    rows : (*G, o, n+1) outputs
    poles : (*G, n) eigenvalues of A

    Returns
    -------
    (*G, o) ``c (-A^-1 b) + d`` where A is stable. Elsewhere an output still settles when no mode that
    does not decay reaches it (an integral nobody uses); otherwise it is nan.
    """
    A, b = generator[..., :-1, :-1], generator[..., :-1, -1]
    stable = np.all(decaying(poles), axis=-1)
    solvable = np.where(stable[..., None, None], A, -np.eye(A.shape[-1]))
    rest = np.linalg.solve(solvable, -b[..., None])[..., 0]
    values = np.einsum("...on,...n->...o", rows[..., :-1], rest) + rows[..., -1]
    if not np.all(stable):
        values[~stable] = _modal_values(A[~stable], b[~stable], rows[~stable])
    return np.asarray(values)


def _modal_values(A: FloatArray, b: FloatArray, rows: FloatArray) -> FloatArray:
    """(N, o) limits of loops that hold a mode which does not decay, mode by mode."""
    poles, V = np.linalg.eig(A)
    independent = np.linalg.cond(V) < 1e12  # repeated poles with one eigenvector grow like t: no limit
    V = np.where(independent[:, None, None], V, np.eye(A.shape[-1]))
    excited = np.linalg.solve(V, b[..., None].astype(complex))
    slopes = (rows[..., :-1] @ V) * excited.swapaxes(-1, -2)
    fades = decaying(poles)[:, None, :]
    modes = -slopes / np.where(fades, poles[:, None, :], -1.0)
    values = np.sum(np.where(fades, modes, 0.0), axis=-1).real + rows[..., -1]
    seen = np.max(np.where(fades, 0.0, np.abs(slopes)), axis=-1, initial=0.0)
    unseen = seen <= SIGHT_TOLERANCE * np.sum(np.abs(slopes), axis=-1)
    return np.asarray(np.where(unseen & independent[:, None], values, np.nan))
