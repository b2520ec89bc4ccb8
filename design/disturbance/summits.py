"""Summits of the largest singular value over frequency, climbed by Newton's method from places in their sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.disturbance.open_parts import Matrices
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

_NEWTON_PASSES = 8
#: A step of Newton's method that raises the square of the gain by less than this part of it is not taken.
_NO_RISE = 1e-14
#: A step is no longer than this part of the frequency.
_LONGEST_STEP = 0.25


@dataclass(frozen=True, eq=False)
class Summits(GridArrays):
    """Highest known summits of N transfers.

    Attributes
    ----------
    gain : (N,) largest singular value there
    omega : (N,) [rad/s]; inf where the gain is approached with growing frequency
    sharpness : (N,) ``-d^2 log(gain) / dw^2`` there [s^2], 0 where that is not known to be positive
    """

    gain: FloatArray
    omega: FloatArray
    sharpness: FloatArray

    @classmethod
    def at_infinity(cls, system: Matrices) -> Summits:
        """What is known before any search."""
        gain = largest_singular_value(system.D.astype(np.complex128))
        return cls(gain, np.full(gain.shape, np.inf), np.zeros(gain.shape))

    def raised(self, row: IntArray, other: Summits) -> Summits:
        """These, or where one of the `other` (K,) of these rows is higher, that."""
        order = np.argsort(other.gain, kind="stable")
        order = order[other.gain[order] > self.gain[row[order]]]
        fields = []
        for ours, theirs in ((self.gain, other.gain), (self.omega, other.omega), (self.sharpness, other.sharpness)):
            field = ours.copy()
            # Of several summits of a row the last written stays: the highest, so they are written in order.
            field[row[order]] = theirs[order]
            fields.append(field)
        return Summits(*fields)


def largest_singular_value(value: ComplexArray) -> FloatArray:
    """(...,) largest singular value of (..., o, p)."""
    if 1 in value.shape[-2:]:
        return np.asarray(np.linalg.norm(value, axis=(-2, -1)))
    return np.asarray(np.linalg.norm(value, 2, axis=(-2, -1)))


def climbed(system: Matrices, start: FloatArray) -> Summits:
    """The summits next to the starts (N,) [rad/s] of N stable systems.

    Rows leave as soon as the next step could not raise their gain any more.
    """
    every = np.arange(start.size)
    found = Summits(np.full(start.shape, -1.0), start, np.zeros(start.shape))
    climbing, at = every, start
    for _ in range(_NEWTON_PASSES):
        here, step = _newton(system, at)
        found = found.raised(climbing, here)
        onward = step**2 * here.sharpness > _NO_RISE
        if not onward.any():
            break
        limit = _LONGEST_STEP * at
        system, climbing = system.take(onward), climbing[onward]
        at = (at + np.clip(step, -limit, limit))[onward]
    return found


def _newton(system: Matrices, omega: FloatArray) -> tuple[Summits, FloatArray]:
    """What is at the frequencies (N,), and Newton's step to the summit (N,), 0 where the gain is not concave.

    With v the leading eigenvector of ``M = H*H`` and lambda its eigenvalue, ``lambda' = v*M'v`` and
    ``lambda'' = v*M''v + 2 sum |v_k* M' v|^2 / (lambda - lambda_k)``.
    """
    resolvent = np.linalg.inv(1j * omega[:, None, None] * np.eye(system.A.shape[-1]) - system.A)
    state = resolvent @ system.B
    H = system.C @ state + system.D
    state = resolvent @ state
    slope, curvature = -1j * (system.C @ state), -2.0 * (system.C @ (resolvent @ state))
    adjoint = H.mT.conj()
    values, vectors = np.linalg.eigh(adjoint @ H)
    leading = vectors[..., -1:]
    cross = adjoint @ slope
    rate = (vectors.mT.conj() @ ((cross + cross.mT.conj()) @ leading))[..., 0]
    bend = leading.mT.conj() @ (adjoint @ curvature + slope.mT.conj() @ slope) @ leading
    square, gaps = values[..., -1], values[..., -1:] - values[..., :-1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bend = 2.0 * (bend.real[..., 0, 0] + np.sum(np.abs(rate[..., :-1]) ** 2 / gaps, axis=-1))
        concave = (bend < 0.0) & np.isfinite(bend) & (square > 0.0)
        sharpness = np.where(concave, -0.5 * bend / square, 0.0)
        step = np.where(concave, -rate[..., -1].real / bend, 0.0)
    return Summits(np.sqrt(np.maximum(square, 0.0)), omega, sharpness), step
