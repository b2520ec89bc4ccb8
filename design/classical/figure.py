"""A figure of merit as a function of the unknown gains: its value with its first and second derivatives."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np

from design.classical.log_response import LogResponse
from model.arrays import BoolArray, ComplexArray, FloatArray

AnyArray = TypeVar("AnyArray", FloatArray, ComplexArray)


@dataclass(frozen=True, eq=False)
class Figure:
    """E figures of K candidates.

    Attributes
    ----------
    value : (E, K)
    gradient : (E, K, J)
    curvature : (E, K, J, J) second derivatives
    exists : (E, K) mask; of the others the numbers mean nothing
    """

    value: FloatArray
    gradient: FloatArray
    curvature: FloatArray
    exists: BoolArray

    def mapped(self, value: FloatArray, first: FloatArray, second: FloatArray | None = None) -> Figure:
        """A function of the figure: its value and its derivatives in the figure's value, each (E, K) or (K,)."""
        gradient, curvature = first[..., None] * self.gradient, first[..., None, None] * self.curvature
        if second is not None:
            curvature += second[..., None, None] * outer(self.gradient)
        return Figure(value, gradient, curvature, self.exists)

    def take(self, part: slice) -> Figure:
        """Some of the figures."""
        return Figure(self.value[part], self.gradient[part], self.curvature[part], self.exists[part])

    def exponential(self) -> Figure:
        """The exponential of the figure."""
        value = np.exp(self.value)
        return self.mapped(value, value, value)


def joined(figures: list[Figure]) -> Figure:
    """Figures of the same candidates, one after the other."""
    parts = ([getattr(figure, f.name) for figure in figures] for f in fields(Figure))
    return Figure(*(np.concatenate(part) for part in parts))


def nothing(count: int, like: Figure) -> Figure:
    """So many figures of the same candidates that do not exist."""
    k, j = like.gradient.shape[1:]
    value, exists = np.zeros((count, k)), np.zeros((count, k), dtype=bool)
    return Figure(value, np.zeros((count, k, j)), np.zeros((count, k, j, j)), exists)


@dataclass(frozen=True, eq=False)
class Crossing:
    """Where ``Im(turn F)`` has a given value: ``Re(turn F)`` there, and how the frequency moves with the gains.

    Attributes
    ----------
    figure : ``Re(turn F)``
    x : (E, K) the frequency
    dx, dxx : (E, K, J), (E, K, J, J) its derivatives
    """

    figure: Figure
    x: FloatArray
    dx: FloatArray
    dxx: FloatArray


def at_crossing(
    F: LogResponse, x: FloatArray, turn: ComplexArray, level: FloatArray, ends: FloatArray, exists: BoolArray
) -> Crossing:
    """Crossings next to the frequencies x (E, K), between `ends` (2, E, K); `turn` and `level` are (E, 1)."""
    f, slope, bend = turn * F.value, turn * F.dx, turn * F.dxx
    first = (level - f.imag) / _not_zero(slope.imag)
    step = np.clip((level - f.imag) / _not_zero(slope.imag + 0.5 * bend.imag * first), ends[0] - x, ends[1] - x)
    f = f + step * (slope + 0.5 * step * bend)
    slope = slope + step * bend
    by, mixed = turn[..., None] * F.dz, turn[..., None] * F.dxz
    by = by + step[..., None] * mixed
    down = 1.0 / _not_zero(slope.imag)
    dx = -by.imag * down[..., None]
    along = mixed[..., :, None] * dx[..., None, :]
    total = turn[..., None, None] * F.dzz + along + along.swapaxes(-1, -2) + bend[..., None, None] * outer(dx)
    dxx = -total.imag * down[..., None, None]
    speed = slope.real
    gradient = by.real + speed[..., None] * dx
    curvature = total.real + speed[..., None, None] * dxx
    return Crossing(Figure(f.real, gradient, curvature, exists), x + step, dx, dxx)


def at_summit(F: LogResponse, x: FloatArray, ends: FloatArray, exists: BoolArray) -> tuple[Figure, FloatArray]:
    """``Re F`` at its maximum over the frequency next to x (E, K), between `ends` (2, E, K); and that frequency."""
    slope, bend = F.dx.real, np.where(F.dxx.real < 0.0, F.dxx.real, -np.inf)
    step = np.clip(-slope / bend, ends[0] - x, ends[1] - x)
    mixed = F.dxz.real
    value = F.value.real + step * (slope + 0.5 * step * F.dxx.real)
    curvature = F.dzz.real - outer(mixed) / bend[..., None, None]
    return Figure(value, F.dz.real + step[..., None] * mixed, curvature, exists), x + step


def outer(v: AnyArray) -> AnyArray:
    """``v v'`` along the last axis."""
    result: AnyArray = v[..., :, None] * v[..., None, :]
    return result


def _not_zero(slope: FloatArray) -> FloatArray:
    return np.where(np.abs(slope) > 1e-9, slope, 1e-9)
