"""The bandwidth that an actuator needs at small amplitude, where none of its limits is met."""

from __future__ import annotations

import numpy as np

from design.delay.with_pade import without_delay
from design.disturbance.closed_system import closed_system
from design.loop import Loop
from design.response.actuator_signals import LETTERS
from design.response.final_value import decaying
from model.arrays import ComplexArray, FloatArray

#: Part of the integral of the squared rate that lies below the bandwidth.
SHARE = 0.9
#: A sum that is this part of its largest terms is rounding.
_ROUNDING = 1e-12
#: Where modes are so nearly parallel that they say nothing, the matrix is moved by this part of itself.
_PARALLEL, _NUDGE = 1e9, 1e-11
#: Frequencies are looked for from this part of the slowest mode to that multiple of the fastest, so often halved.
_SLOWEST, _FASTEST, _HALVINGS = 1e-6, 1e9, 55


def needed_bandwidths(loop: Loop, actuators: tuple[str, ...]) -> FloatArray:
    """Frequency below which 90 % lies of what a step of a reference asks of the actuator's rate.

    That is, of the integral of the squared rate of its deflection after a step, which by Parseval's theorem is that of
    ``|H(jw)|^2`` over frequency, H leading from the reference to the deflection. Of several references the one that
    asks for most counts. It changes smoothly over a grid, and needs no gain at rest; the frequency where |H| is down by
    3 dB does neither: with a shelf near that level it jumps (of the example's tab, from 143 to 18 rad/s between 20 and
    25 m/s, where this one goes from 362 to 294).

    Parameters
    ----------
    loop : closed loops over the grid, delays as chains of states
    actuators : names, of ``tab`` and ``aileron``

    Returns
    -------
    (*G, a) [rad/s]; inf where the deflection follows its command at once; nan where the loop is not stable, or where
    no reference moves the actuator
    """
    outputs = tuple(f"d{LETTERS[name]}" for name in actuators)
    system = closed_system(without_delay(loop), loop.references, outputs)
    found = np.full((*loop.A.shape[:-2], len(outputs)), np.nan)
    stable = np.asarray(np.isfinite(system.A).all(axis=(-2, -1)))
    stable[stable] = decaying(np.linalg.eigvals(system.A[stable]).astype(complex)).all(axis=-1)
    if np.any(stable) and loop.references:
        A, B, C, D = (each[stable] for each in (system.A, system.B, system.C, system.D))
        of_pairs = np.where(D != 0.0, np.inf, _share_frequencies(*_terms(A, B, C)))
        most = np.max(np.nan_to_num(of_pairs, nan=-1.0, posinf=np.inf), axis=-1)
        found[stable] = np.where(most < 0.0, np.nan, most)
    return found


def _terms(A: FloatArray, B: FloatArray, C: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Poles p (N, n) and weights (N, o, p, n) ``r_i H(-p_i)`` of ``H = C (sI - A)^-1 B = sum_i r_i / (s - p_i)``."""
    poles, V = (each.astype(np.complex128) for each in np.linalg.eig(A))
    with np.errstate(divide="ignore", invalid="ignore"):
        parallel = ~(np.linalg.cond(V) < _PARALLEL)
    if np.any(parallel):
        n = A.shape[-1]
        # Anything that is not a symmetry of the matrix tells equal poles apart.
        nudge = np.cos(np.arange(1.0, n * n + 1.0) ** 2).reshape(n, n) * _NUDGE
        size = np.abs(A[parallel]).max(axis=(-2, -1), keepdims=True)
        poles[parallel], V[parallel] = np.linalg.eig(A[parallel] + nudge * size)
    residues = (C @ V)[..., :, None, :] * np.linalg.solve(V, B.astype(V.dtype)).swapaxes(-1, -2)[..., None, :, :]
    # Not from the residues: those of poles close together are large and of opposite sign.
    mirrored = -poles[..., None, None] * np.eye(A.shape[-1]) - A[:, None]
    values = C[:, None] @ np.linalg.solve(mirrored, np.broadcast_to(B[:, None], (*poles.shape, *B.shape[1:])))
    return poles, residues * np.moveaxis(values, 1, -1)


def _share_frequencies(poles: ComplexArray, weights: ComplexArray) -> FloatArray:
    """(N, o, p) where the integral of ``|H(jw)|^2`` reaches its share [rad/s]; nan where it is zero.

    ``|H|^2 = 2 Re sum_i r_i H(-p_i) / (jw - p_i)``, each term a logarithm when integrated from -w to w.
    """
    whole = np.pi * np.sum(weights, axis=-1).real
    size = np.abs(poles)
    low = np.broadcast_to(np.log(_SLOWEST * size.min(axis=-1))[:, None, None], whole.shape).copy()
    high = np.broadcast_to(np.log(_FASTEST * size.max(axis=-1))[:, None, None], whole.shape).copy()
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        jw = 1j * np.exp(middle)[..., None]
        part = np.log(jw - poles[:, None, None, :]) - np.log(-jw - poles[:, None, None, :])
        below = np.sum(weights * -1j * part, axis=-1).real < SHARE * whole
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(whole > _ROUNDING * np.sum(np.abs(weights), axis=-1), np.exp(low), np.nan)
