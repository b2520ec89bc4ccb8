"""The closed loop from outside signals (references, disturbances, sensor noise) to outputs and commands."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Self, TypeVar

import numpy as np

from design.delay.delayed_poles import delayed_poles
from design.disturbance.open_parts import Matrices, OpenParts
from design.loop import Loop
from design.response.final_value import decaying
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

Arrays = TypeVar("Arrays", bound=GridArrays)


@dataclass(frozen=True, eq=False)
class StablePoints(GridArrays):
    """The points of a grid where the loop is stable for certain, N of them in one row.

    Attributes
    ----------
    matrices : A (N, n, n), B (N, n, p), C (N, o, n), D (N, o, p), every delay left out
    R : (N, o, p) what outputs take of the rate of w
    linked : (N, o, p) mask of the outputs that an input reaches through the states
    poles : (N, k) rightmost poles [rad/s], with a delay nan padded; without one all of them
    parts : see `ClosedSystem`
    """

    matrices: Matrices
    R: FloatArray
    linked: BoolArray
    poles: ComplexArray
    parts: OpenParts | None

    @property
    def direct(self) -> BoolArray:
        """(N, o, p) mask of the outputs that take an input, or its rate, at once or after a delay only."""
        return (self.matrices.D != 0.0) | (self.R != 0.0) if self.parts is None else self.parts.direct

    def response(self, omega: FloatArray) -> ComplexArray:
        """Transfer (N, W, o, p) with the delays at frequencies (N, W) [rad/s]."""
        return _response(self.matrices, self.R, self.parts, omega)


@dataclass(frozen=True, eq=False)
class ClosedSystem(GridArrays):
    """``x' = A x + B w``, ``y = C x + D w + R w'`` over the grid, all loops closed, every delay left out.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, p), C (*G, o, n), D (*G, o, p)
    R : (*G, o, p) what outputs take of the rate of w; zero unless a rate follows a jump of the command at once
    inputs, outputs : names of w and y
    parts : the same before the loop is closed, where a command has a transport delay; None where none has
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    R: FloatArray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parts: OpenParts | None = None

    @classmethod
    def of(cls, A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray) -> Self:
        """From matrices alone, without delay; the names are ``w0 w1 ..`` and ``y0 y1 ..``."""
        o, p = D.shape[-2:]
        inputs, outputs = (tuple(f"{letter}{i}" for i in range(size)) for letter, size in (("w", p), ("y", o)))
        return cls(A, B, C, D, np.zeros(D.shape), inputs, outputs)

    @property
    def grid(self) -> tuple[int, ...]:
        """Shape of the grid."""
        return self.A.shape[:-2]

    @cached_property
    def poles(self) -> ComplexArray:
        """(*G, k) rightmost poles [rad/s], nan padded, nan where a point is not finite; without a delay all of them."""
        if self.parts is not None:
            return delayed_poles(self.parts.as_loop).poles
        known = self._finite
        A = self.A if known.all() else np.where(known[..., None, None], self.A, 0.0)
        return np.where(known[..., None], np.linalg.eigvals(A).astype(np.complex128), complex(np.nan, np.nan))

    @cached_property
    def stable(self) -> BoolArray:
        """(*G,) mask of the points that are finite and whose modes all die out, for certain."""
        poles = self.poles
        if self.parts is not None:  # what is missing stands to the left of the others
            missing = np.isnan(poles)
            poles = np.where(missing & ~missing.all(axis=-1, keepdims=True), -1.0, poles)
        return np.asarray(self._finite & np.all(decaying(poles), axis=-1))

    @cached_property
    def stable_points(self) -> StablePoints:
        """The points that are stable, in one row."""
        row = self._in_one_row
        poles = self.poles.reshape(-1, self.poles.shape[-1])
        matrices = Matrices(row.A, row.B, row.C, row.D)
        linked = matrices.linked if row.parts is None else row.parts.linked
        return StablePoints(matrices, row.R, linked, poles, row.parts).take(self.stable.reshape(-1))

    def over_grid(self, values: FloatArray) -> FloatArray:
        """Values (N, ...) of the stable points, (*G, ...) with nan elsewhere."""
        whole = np.full((*self.grid, *values.shape[1:]), np.nan)
        whole[self.stable] = values
        return whole

    def response(self, omega: FloatArray) -> ComplexArray:
        """``C (jwI - A)^-1 B + D + jw R``, delays exact: (*G, W, o, p) at frequencies (*G, W) [rad/s].

        nan where a point is not finite, and exactly at a pole on the axis.
        """
        return _response(Matrices(self.A, self.B, self.C, self.D), self.R, self.parts, omega)

    @property
    def _finite(self) -> BoolArray:
        arrays = (self.A, self.B, self.C, self.D, self.R)
        return np.asarray(np.all([np.isfinite(M).all(axis=(-2, -1)) for M in arrays], axis=0))

    @property
    def _in_one_row(self) -> Self:
        """The same with the grid's points in one row (N, ...)."""
        return _in_one_row(self, len(self.grid))


def _response(matrices: Matrices, R: FloatArray, parts: OpenParts | None, omega: FloatArray) -> ComplexArray:
    along = (..., None, slice(None), slice(None))
    if parts is not None:
        return parts.take(along).response(omega)
    value = matrices.take(along).response(omega)
    return value + 1j * omega[..., None, None] * R[along] if R.any() else value


def closed_system(loop: Loop, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> ClosedSystem:
    """The loop from some of its references and disturbances to some of its outputs and commands.

    States on no way from these inputs to these outputs (an integral that no gain reads) are put to rest: they decay,
    driven by nothing and seen by nobody, so that they do not make the others look unstable.

    Parameters
    ----------
    loop : over any grid; points that carry nan keep it
    inputs : names of ``loop.references`` and ``loop.disturbances``
    outputs : names of ``loop.outputs``, as deviations from trim, and of ``loop.inputs``, which stand for the command u
        of that actuator, before its delay

    Raises
    ------
    ValueError : the loop has no such name, or a delay is negative
    """
    if min(loop.delay) < 0.0:
        raise ValueError(f"delays must not be negative, are {loop.delay} s")
    columns = [_index((*loop.references, *loop.disturbances), name, "reference or disturbance") for name in inputs]
    rows = [_index((*loop.outputs, *loop.inputs), name, "output or command") for name in outputs]
    W, M = (np.concatenate(pair, axis=-1)[..., columns] for pair in ((loop.E, loop.G), (loop.N, loop.M)))
    reading = {"C": (loop.C, -loop.K), "F": (loop.F, 0.0 * loop.K), "D": (loop.D, None), "H": (loop.H, None)}
    square = np.zeros((*loop.K.shape[:-1], len(loop.inputs)))
    C, F, D, H = (
        np.concatenate([ours, square if command is None else command], axis=-2)[..., rows, :]
        for ours, command in reading.values()
    )
    J = np.concatenate([np.zeros((*loop.C.shape[:-1], len(columns))), M], axis=-2)[..., rows, :]
    parts = OpenParts(loop.A, loop.B, W, loop.K, M, C, F, D, H, J, tuple(loop.delay))
    parts = parts.resting(parts.idle_states())
    closed, R = parts.undelayed()
    return ClosedSystem(
        closed.A, closed.B, closed.C, closed.D, R, tuple(inputs), tuple(outputs), parts if any(loop.delay) else None
    )  # fmt: skip


def _index(names: tuple[str, ...], name: str, what: str) -> int:
    if name not in names:
        raise ValueError(f"the loop has no {what} {name!r}; it has {', '.join(names)}")
    return names.index(name)


def _in_one_row(result: Arrays, axes: int) -> Arrays:
    """`result` with its first `axes` axes, the grid's, made one."""
    changed: dict[str, object] = {}
    for field in fields(result):  # type: ignore[arg-type]
        value = getattr(result, field.name)
        if isinstance(value, np.ndarray):
            changed[field.name] = value.reshape(-1, *value.shape[axes:])
        elif isinstance(value, GridArrays):
            changed[field.name] = _in_one_row(value, axes)
    return replace(result, **changed)  # type: ignore[type-var]
