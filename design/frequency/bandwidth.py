"""Bandwidth of a transfer function in state space: the first frequency where it has lost 3 dB of its DC gain.

Every frequency with ``|H(j w)| = g`` is an imaginary eigenvalue of one Hamiltonian matrix (the test of Boyd,
Balakrishnan and Kabamba for the H-infinity norm, at a level below the peak), so that none is missed between the
points of a frequency grid.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray

#: -3 dB as everybody means it: half the power.
LEVEL = np.sqrt(0.5)
_NEWTON_PASSES = 2
#: An eigenvalue is looked at when it is this near the imaginary axis, relative to its size.
_AXIS = 1e-4
#: A candidate is a crossing when the gain there is the level to this part.
_CROSSING_TOLERANCE = 1e-9


def bandwidth(A: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, dc_gain: FloatArray) -> FloatArray:
    """Lowest frequency where ``|c (jwI - A)^-1 b + d|`` is down by 3 dB from `dc_gain`.

    Parameters
    ----------
    A : (*G, n, n); b, c : (*G, n); d : (*G,)
    dc_gain : (*G,) the gain at zero frequency; nan or 0 where there is none

    Returns
    -------
    (*G,) [rad/s]; nan where there is no DC gain or the gain never falls that far
    """
    level = LEVEL * np.abs(dc_gain)
    usable = np.isfinite(level) & (level > 0.0) & (np.abs(level - np.abs(d)) > 1e-9 * level)
    result = np.full(level.shape, np.nan)
    if np.any(usable):
        A, b, c, d, level = A[usable], b[usable], c[usable], d[usable], level[usable]
        result[usable] = _lowest_crossing(A, b, c, d, level)
    return result


def _candidates(A: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, level: FloatArray) -> FloatArray:
    """(N, 2n) frequencies near which every crossing of the level lies, ascending; inf where there are fewer."""
    n = A.shape[-1]
    scale = (1.0 / (level**2 - d**2))[:, None, None]
    drift = A + scale * d[:, None, None] * b[:, :, None] * c[:, None, :]
    H = np.empty((len(A), 2 * n, 2 * n))
    H[:, :n, :n] = drift
    H[:, n:, n:] = -drift.swapaxes(-1, -2)
    H[:, :n, n:] = level[:, None, None] * scale * b[:, :, None] * b[:, None, :]
    H[:, n:, :n] = -level[:, None, None] * scale * c[:, :, None] * c[:, None, :]
    poles = np.linalg.eigvals(H)
    on_axis = (poles.imag > 0.0) & (np.abs(poles.real) <= _AXIS * np.abs(poles))
    return np.sort(np.where(on_axis, poles.imag, np.inf), axis=-1)


def _lowest_crossing(A: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, level: FloatArray) -> FloatArray:
    """(N,) the lowest candidate that Newton's method confirms; nan where it confirms none."""
    candidates = _candidates(A, b, c, d, level)
    result = np.full(level.shape, np.nan)
    for omega in candidates.T:
        open_ = np.isnan(result) & np.isfinite(omega)
        if not np.any(open_):
            break
        refined = omega[open_]
        system = A[open_], b[open_], c[open_], d[open_], level[open_]
        for _ in range(_NEWTON_PASSES):
            refined = refined - np.clip(_newton_step(*system, refined)[1], -0.5 * refined, 0.5 * refined)
        confirmed = np.abs(_newton_step(*system, refined)[0]) < _CROSSING_TOLERANCE
        result[open_] = np.where(confirmed, refined, np.nan)
    return result


def _newton_step(
    A: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, level: FloatArray, omega: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(N,) how far ``log |H(jw)|`` is above the level, and the step in w that Newton's method takes."""
    resolvent = np.linalg.inv(1j * omega[:, None, None] * np.eye(A.shape[-1]) - A)
    state = resolvent @ b[:, :, None]
    both = c[:, None, :] @ np.concatenate([state, resolvent @ state], axis=-1)
    gain = both[:, 0, 0] + d
    excess = np.log(np.abs(gain) / level)
    slope = (-1j * both[:, 0, 1] / gain).real
    return excess, excess / np.where(slope == 0.0, np.inf, slope)
