"""A loop closed at the gain it is flown with, and its response on the imaginary axis.

Margins are read off the complementary sensitivity ``T = L / (1 + L) = c (sI - A + b c)^-1 b``, because it is
finite on the whole axis as soon as the closed loop has no pole there, while L itself is not when the open
loop has integrators. L is real where T is; the gain ratio that makes it -1 is ``-1/L = 1 - 1/T``; ``|L| = 1``
where ``Re T = 1/2``; the sensitivity is ``1 - T``. A delay multiplies L by ``exp(-j w delay)``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from design.frequency.polynomials import nearby_power_of_two, powers, with_roots
from design.frequency.transfer import Transfer, transfer
from design.loop import SisoLoop
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: Polynomials of the squared magnitude of more states than this lose their roots to rounding.
MOST_STATES = 20


@dataclass(frozen=True, eq=False)
class ClosedLoop(GridArrays):
    """The grid's N points in one row, every frequency in units of the point's own `scale`.

    Attributes
    ----------
    matrix : (N, n, n) state matrix of the closed loop, the delay left out, in units of its own
    numerator, characteristic : (N, n+1) ``T = numerator / characteristic`` without the delay; the latter monic
    scale : (N,) unit of frequency, in units of `matrix`
    delay : (N,) transport delay times `scale`
    sample_time : (N,) where the axis is the unit circle of z, ``s = (z - 1) / (z + 1)``: sample time [s].
        Infinite frequency is half the sampling rate then, and T need not vanish there. None: s in rad/s
    """

    matrix: FloatArray
    numerator: FloatArray
    characteristic: FloatArray
    scale: FloatArray
    delay: FloatArray
    sample_time: FloatArray | None = None

    @property
    def delayed(self) -> bool:
        """Whether there is a delay at all; it is the same for the whole grid."""
        return bool(np.any(self.delay > 0.0))

    @property
    def searched(self) -> bool:
        """Whether its crossings are to be searched on a grid: the roots of polynomials do not serve."""
        return self.delayed or self.matrix.shape[-1] > MOST_STATES

    @property
    def transfer(self) -> Transfer:
        """The open loop L without delay, (N, n+1) coefficients."""
        return Transfer(self.numerator, self.characteristic - self.numerator)

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles of the closed loop (N, n) without the delay."""
        return np.asarray(np.linalg.eigvals(self.matrix) / self.scale[:, None], dtype=complex)

    @cached_property
    def regular(self) -> BoolArray:
        """Mask (N,) of the points without a closed-loop pole on the axis."""
        return np.asarray(np.abs(self.poles.real).min(axis=-1) > 1e-12 * np.abs(self.poles).max(axis=-1))

    @cached_property
    def stable(self) -> BoolArray:
        """Mask (N,) of the points that are stable without their delay: all poles left of the axis, and off it."""
        return np.asarray(self.regular & (self.poles.real.max(axis=-1) < 0.0))

    def frequency(self, omega: FloatArray) -> FloatArray:
        """`omega` (N, m) in rad/s."""
        x = omega * self.scale[:, None]
        return x if self.sample_time is None else 2.0 * np.arctan(x) / self.sample_time[:, None]

    def quietened(self, kept: BoolArray) -> ClosedLoop:
        """``L = 0`` where the mask (N,) is False: points that have no margins must not stop the rest."""
        if kept.all():
            return self
        n = self.matrix.shape[-1]
        matrix = np.where(kept[:, None, None], self.matrix, -np.eye(n))
        numerator = np.where(kept[:, None], self.numerator, 0.0)
        characteristic = np.where(kept[:, None], self.characteristic, with_roots(-np.ones(n, dtype=complex)))
        scale = np.where(kept, self.scale, 1.0)
        return replace(self, matrix=matrix, numerator=numerator, characteristic=characteristic, scale=scale)


def closed_loop(loop: SisoLoop) -> ClosedLoop:
    """`loop` at the gain it is flown with; `ClosedLoop` says how it is held.

    Raises
    ------
    numpy.linalg.LinAlgError : an entry is not finite
    """
    n = loop.A.shape[-1]
    A, c = loop.A.reshape(-1, n, n), loop.c.reshape(-1, n)
    b = loop.b.reshape(-1, n) * (loop.sign * loop.gain.reshape(-1))[:, None]
    matrix = A - b[:, :, None] * c[:, None, :]
    if not np.all(np.isfinite(matrix)):
        raise np.linalg.LinAlgError("the closed loop has an entry that is not finite")
    found, scale = scaled(transfer(matrix, b, c))
    return ClosedLoop(matrix, found.numerator, found.denominator, scale, loop.delay * scale)


def scaled(ratio: Transfer) -> tuple[Transfer, FloatArray]:
    """The same transfer (N, n+1) in a unit of frequency (N,) such that no pole is large, and the unit."""
    n = ratio.denominator.shape[-1] - 1
    size = np.abs(ratio.denominator[:, 1:]) ** (1.0 / np.arange(1, n + 1))
    scale = nearby_power_of_two(size.max(axis=-1))
    return ratio.scaled(scale), scale


def complementary(
    loop: ClosedLoop, rows: IntArray, omega: FloatArray, delayed: bool
) -> tuple[ComplexArray, ComplexArray]:
    """T and dT/dw (K,) at the frequencies `omega` (K,) of the points `rows` (K,); infinity is one."""
    length = loop.numerator.shape[-1]
    with np.errstate(divide="ignore"):
        inverse = 1.0 / omega
    # Numerator and denominator both over w^n where w is large: nothing overflows, infinity included.
    large = omega > 1.0
    rising = powers(np.where(large, inverse, omega), length + 1)
    terms = np.where(large, rising[:0:-1], rising[1:])
    power = np.arange(length - 1.0, -1.0, -1.0)[:, None]
    shifted = np.where(large, rising[-2::-1], np.concatenate([rising[2:], np.zeros((1, omega.size))]))
    both = np.stack([loop.numerator, loop.characteristic])[:, rows].swapaxes(1, 2)
    parts = _axis(length) @ np.concatenate([both * terms, both * (power * shifted)])
    numerator, characteristic, numerator_slope, characteristic_slope = parts[:, 0] + 1j * parts[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        value = numerator / characteristic
        slope = (numerator_slope - value * characteristic_slope) / characteristic
    if not delayed:
        return value, slope
    delay = loop.delay[rows]
    turn = np.exp(-1j * omega * delay)
    top, bottom = turn * value, 1.0 + (turn - 1.0) * value
    top_slope = turn * (slope - 1j * delay * value)
    bottom_slope = (turn - 1.0) * slope - 1j * delay * top
    return top / bottom, (top_slope * bottom - top * bottom_slope) / bottom**2


@cache
def _axis(length: int) -> FloatArray:
    """Real and imaginary parts (2, length) of the powers of j, highest first."""
    power = np.arange(length - 1, -1, -1)
    return np.array([1.0, 0.0, -1.0, 0.0])[np.stack([power, power - 1]) % 4]


def open_loop_value(T: ComplexArray) -> ComplexArray:
    """``L = T / (1 - T)``; nan where T is, infinite where it is 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return T / (1.0 - T)


def log_slope(T: ComplexArray, slope: ComplexArray) -> FloatArray:
    """``d log|L| / dw`` from T and dT/dw; nan where they are."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return (slope / (T * (1.0 - T))).real
