"""A loop closed at the gain it is flown with, and its response on the imaginary axis.

Margins are read off the complementary sensitivity ``T = L / (1 + L) = c (sI - A + b c)^-1 b``, because it is
finite on the whole axis as soon as the closed loop has no pole there, while L itself is not when the open
loop has integrators. L is real where T is; the gain ratio that makes it -1 is ``-1/L = 1 - 1/T``; ``|L| = 1``
where ``Re T = 1/2``; the sensitivity is ``1 - T``. A delay multiplies L by ``exp(-j w delay)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from design.frequency.polynomials import nearby_power_of_two, with_roots
from design.frequency.transfer import Transfer, markov_parameters, response, transfer_of_poles
from design.loop import SisoLoop
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

AnyArray = TypeVar("AnyArray", FloatArray, ComplexArray)


@dataclass(frozen=True, eq=False)
class ClosedLoop(GridArrays):
    """The grid's N points in one row, every frequency in units of the point's own `scale`.

    Attributes
    ----------
    A, b, c : (N, n, n), (N, n), (N, n), closed loop and transfer ``T = c (sI - A)^-1 b``
    transfer : the open loop L, (N, n+1) coefficients
    poles : (N, n) of the closed loop, the delay left out
    scale : (N,) [rad/s]
    delay : (N,) transport delay times `scale`
    regular : (N,) mask of the points without a closed-loop pole on the axis. The others are replaced by
        ``L = 0``: they have no margins, and must not stop the rest
    """

    A: FloatArray
    b: FloatArray
    c: FloatArray
    transfer: Transfer
    poles: ComplexArray
    scale: FloatArray
    delay: FloatArray
    regular: BoolArray

    @property
    def delayed(self) -> bool:
        """Whether there is a delay at all; it is the same for the whole grid."""
        return bool(np.any(self.delay > 0.0))

    @property
    def characteristic(self) -> FloatArray:
        """Characteristic polynomial of the closed loop without delay (N, n+1)."""
        return self.transfer.denominator + self.transfer.numerator


def closed_loop(loop: SisoLoop) -> ClosedLoop:
    """`loop` at the gain it is flown with, sign and gain drawn into b; `ClosedLoop` says how it is held."""
    n = loop.A.shape[-1]
    A, c = loop.A.reshape(-1, n, n), loop.c.reshape(-1, n)
    b = loop.b.reshape(-1, n) * (loop.sign * loop.gain.reshape(-1))[:, None]
    closed = A - b[:, :, None] * c[:, None, :]
    poles: ComplexArray = np.linalg.eigvals(closed).astype(complex)
    open_poles: ComplexArray = np.linalg.eigvals(A).astype(complex)
    scale = nearby_power_of_two(np.maximum(np.abs(poles), np.abs(open_poles)).max(axis=-1))
    open_loop = transfer_of_poles(open_poles, poles, np.ones_like(scale), markov_parameters(A, b, c))
    ratio = open_loop.scaled(scale)
    closed, b = closed / scale[:, None, None], b / scale[:, None]
    poles = np.asarray(poles / scale[:, None], dtype=complex)
    regular = np.abs(poles.real).min(axis=-1) > 1e-12 * np.abs(poles).max(axis=-1)
    if not regular.all():
        closed, b = _replaced(closed, regular, -np.eye(n)), _replaced(b, regular, 0.0)
        poles = _replaced(poles, regular, -1.0)
        no_loop = (ratio.numerator, 0.0), (ratio.denominator, with_roots(-np.ones(n, dtype=complex)))
        ratio = Transfer(*(_replaced(v, regular, w) for v, w in no_loop))
    return ClosedLoop(closed, b, c, ratio, poles, scale, loop.delay * scale, regular)


def _replaced(values: AnyArray, kept: BoolArray, others: FloatArray | float) -> AnyArray:
    return np.where(kept.reshape(-1, *(1,) * (values.ndim - 1)), values, others)


def complementary(
    loop: ClosedLoop, rows: IntArray, omega: FloatArray, delayed: bool
) -> tuple[ComplexArray, ComplexArray]:
    """T and dT/dw (K,) at the frequencies `omega` (K,) of the points `rows` (K,), from the matrices."""
    at = response(loop.A[rows], loop.b[rows], loop.c[rows], np.asarray(1j * omega[:, None], dtype=complex))
    value, slope = at.value[:, 0], 1j * at.slope[:, 0]
    if not delayed:
        return value, slope
    delay = loop.delay[rows]
    turn = np.exp(-1j * omega * delay)
    top, bottom = turn * value, 1.0 + (turn - 1.0) * value
    top_slope = turn * (slope - 1j * delay * value)
    bottom_slope = (turn - 1.0) * slope - 1j * delay * top
    return top / bottom, (top_slope * bottom - top * bottom_slope) / bottom**2


def open_loop_value(T: ComplexArray) -> ComplexArray:
    """``L = T / (1 - T)``; nan where T is, infinite where it is 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return T / (1.0 - T)


def log_slope(T: ComplexArray, slope: ComplexArray) -> FloatArray:
    """``d log|L| / dw`` from T and dT/dw; nan where they are."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return (slope / (T * (1.0 - T))).real
