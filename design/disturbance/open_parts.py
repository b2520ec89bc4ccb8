"""The parts of a loop before it is closed: where a delay turns the phase of the commands, frequency by frequency."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from design.disturbance.links import reaches, ways
from design.loop import Loop
from design.lqr.hamiltonian import solve_or_nan
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

#: A sum smaller than this part of its terms is zero but for rounding.
_ROUNDING = 16.0 * np.finfo(float).eps
AnyArray = TypeVar("AnyArray", FloatArray, ComplexArray)

#: Turns of a delay.
_QUARTERS = np.array([1.0, -1.0j, -1.0, 1.0j])


@dataclass(frozen=True, eq=False)
class Matrices(GridArrays):
    """``x' = A x + B w``, ``y = C x + D w``, each (..., rows, columns)."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray

    def response(self, omega: FloatArray) -> ComplexArray:
        """``C (jwI - A)^-1 B + D`` (..., o, p) at the frequencies (...) [rad/s]; nan exactly at a pole."""
        return _transfer(self.A, self.B, self.C, self.D, omega)

    @property
    def linked(self) -> BoolArray:
        """(..., o, p) mask of the outputs that an input reaches through the states."""
        return reaches(self.C, reaches(ways(self.A), self.B))


@dataclass(frozen=True, eq=False)
class TurnedMatrices(GridArrays):
    """`Matrices` of a loop in steady oscillation, complex because its commands arrive turned."""

    A: ComplexArray
    B: ComplexArray
    C: ComplexArray
    D: ComplexArray

    def response(self, omega: FloatArray) -> ComplexArray:
        """As `Matrices.response`."""
        return _transfer(self.A, self.B, self.C, self.D, omega)


def _transfer(A: AnyArray, B: AnyArray, C: AnyArray, D: AnyArray, omega: FloatArray) -> ComplexArray:
    n = A.shape[-1]
    shape: tuple[int, ...] = np.broadcast_shapes(A.shape[:-2], omega.shape)
    pencil = np.empty((*shape, n, n), dtype=np.complex128)
    np.negative(A, out=pencil)
    pencil[..., np.arange(n), np.arange(n)] += 1j * omega[..., None]
    drive: ComplexArray = np.broadcast_to(np.asarray(B, dtype=np.complex128), (*shape, *B.shape[-2:]))
    states: ComplexArray = solve_or_nan(pencil, drive)
    return np.asarray(np.asarray(C, dtype=np.complex128) @ states + D, dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class OpenParts(GridArrays):
    """``x' = A x + B v + W w``, ``u = -K x + M w``, ``v(t) = u(t - delay)``, ``y = C x + F x' + D v + H v' + J w``.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, m), W (*G, n, p), K (*G, m, n), M (*G, m, p)
    C (*G, o, n), F (*G, o, n), D (*G, o, m), H (*G, o, m), J (*G, o, p)
    delay : transport delay of each command [s]
    """

    A: FloatArray
    B: FloatArray
    W: FloatArray
    K: FloatArray
    M: FloatArray
    C: FloatArray
    F: FloatArray
    D: FloatArray
    H: FloatArray
    J: FloatArray
    delay: tuple[float, ...]

    def undelayed(self) -> tuple[Matrices, FloatArray]:
        """Matrices of the closed loop without its delays, and R (*G, o, p): what y takes of w'.

        An entry of D or R that is smaller than the rounding of its terms is exactly zero: a direct way from a noise to
        an output has infinite variance, so rounding must not open one.
        """
        rates, closed, drive = self.F - self.H @ self.K, self.A - self.B @ self.K, self.W + self.B @ self.M
        size = {name: np.abs(getattr(self, name)) for name in "BWKMFDHJ"}
        bound = size["J"] + size["D"] @ size["M"]
        bound = bound + (size["F"] + size["H"] @ size["K"]) @ (size["W"] + size["B"] @ size["M"])
        direct = self.J + rates @ drive + self.D @ self.M
        direct = np.where(np.abs(direct) <= _ROUNDING * bound, 0.0, direct)
        matrices = Matrices(closed, drive, self.C + rates @ closed - self.D @ self.K, direct)
        return matrices, self.H @ self.M

    def turned(self, turn: ComplexArray) -> TurnedMatrices:
        """The closed loop in a steady oscillation whose commands arrive times `turn` (..., m); y without ``R w'``."""
        BT, DT, HT = (M * turn[..., None, :] for M in (self.B, self.D, self.H))
        closed, drive, rates = self.A - BT @ self.K, self.W + BT @ self.M, self.F - HT @ self.K
        return TurnedMatrices(
            closed, drive, self.C + rates @ closed - DT @ self.K, self.J + rates @ drive + DT @ self.M
        )

    def turn(self, omega: FloatArray) -> ComplexArray:
        """``exp(-j w delay)`` (..., m) at the frequencies (...) [rad/s]."""
        return np.asarray(np.exp(-1j * omega[..., None] * np.array(self.delay)))

    def at_infinity(self) -> TurnedMatrices:
        """`turned` for every quarter turn of every delay (*G, k, ...): at infinite frequency they may have any."""
        some = [_QUARTERS if delay > 0.0 else _QUARTERS[:1] for delay in self.delay]
        turns = np.stack(np.meshgrid(*some, indexing="ij"), axis=-1).reshape(-1, len(self.delay))
        return self.take((..., None, slice(None), slice(None))).turned(turns)

    @property
    def direct(self) -> BoolArray:
        """(*G, o, p) mask of the outputs that take an input, or its rate, at once or after a delay only."""
        rates = (self.F != 0.0) | reaches(self.H, self.K)
        later = reaches(rates, self._drive) | reaches(self.D, self.M) | reaches(self.H, self.M)
        return np.asarray((self.J != 0.0) | later)

    def response(self, omega: FloatArray) -> ComplexArray:
        """Transfer from w to y (..., o, p) with the delays, at the frequencies (...) [rad/s]."""
        turn = self.turn(omega)
        rate = 1j * omega[..., None, None] * ((self.H * turn[..., None, :]) @ self.M)
        return self.turned(turn).response(omega) + rate

    def resting(self, idle: BoolArray) -> OpenParts:
        """The parts with some states (*G, n) cut off from everything, decaying at the mean rate of all of them."""
        if not idle.any():
            return self
        n = self.A.shape[-1]
        rate = np.abs(np.trace(self.A - self.B @ self.K, axis1=-2, axis2=-1)) / n
        rate = np.where(rate > 0.0, rate, 1.0)
        A = np.where(idle[..., :, None] | idle[..., None, :], 0.0, self.A)
        A[..., np.arange(n), np.arange(n)] -= np.where(idle, rate[..., None], 0.0)
        B, W = (np.where(idle[..., :, None], 0.0, matrix) for matrix in (self.B, self.W))
        K, C, F = (np.where(idle[..., None, :], 0.0, matrix) for matrix in (self.K, self.C, self.F))
        return replace(self, A=A, B=B, W=W, K=K, C=C, F=F)

    @cached_property
    def as_loop(self) -> Loop:
        """The loop whose references are the inputs w, for what is known of loops; J is left out."""
        n, m, p = self.A.shape[-1], self.B.shape[-1], self.W.shape[-1]
        o, grid = self.C.shape[-2], self.A.shape[:-2]
        states, inputs, references, outputs = (
            tuple(f"{letter}{i}" for i in range(size)) for letter, size in (("x", n), ("u", m), ("w", p), ("y", o))
        )
        return Loop(
            A=self.A, B=self.B, E=self.W, G=np.zeros((*grid, n, 0)), K=self.K, N=self.M, M=np.zeros((*grid, m, 0)),
            C=self.C, F=self.F, D=self.D, H=self.H, offset=np.zeros((*grid, o)), states=states, inputs=inputs,
            references=references, outputs=outputs, disturbances=(), stages=(), delay=self.delay,
        )  # fmt: skip

    def idle_states(self) -> BoolArray:
        """(*G, n) mask of the states on no way from w to y, by which entries are zero."""
        way = self._ways
        driven = reaches(way, self._drive).any(axis=-1)
        return np.asarray(~(driven & reaches(self._read, way).any(axis=-2)))

    @property
    def linked(self) -> BoolArray:
        """(*G, o, p) mask of the outputs that an input reaches through the states."""
        return reaches(self._read, reaches(self._ways, self._drive))

    @property
    def _ways(self) -> BoolArray:
        return ways((self.A != 0.0) | reaches(self.B, self.K))

    @property
    def _drive(self) -> BoolArray:
        return np.asarray((self.W != 0.0) | reaches(self.B, self.M))

    @property
    def _read(self) -> BoolArray:
        return np.asarray((self.C != 0.0) | (self.F != 0.0) | reaches(self.D, self.K) | reaches(self.H, self.K))
