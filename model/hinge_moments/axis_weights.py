"""Interpolation along one axis of a grid: which levels count, with what weight, and the weights' derivative."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from model.arrays import FloatArray, IntArray
from model.hinge_moments.levels import SAME_ANGLE

InterpolationKind = Literal["multilinear", "cubic"]


@dataclass(frozen=True, eq=False)
class AxisWeights:
    """For each of m positions: s levels (m, s), their weights (m, s) and the weights' derivatives (m, s)."""

    level: IntArray
    weight: FloatArray
    slope: FloatArray


class Axis(Protocol):
    """Levels of one angle and the way between them."""

    def at(self, x: FloatArray) -> AxisWeights:
        """Weights at positions x (m,) [rad]; beyond the ends the function goes on straight."""
        ...


def axis_of(levels: FloatArray, kind: InterpolationKind) -> Axis:
    """Axis through increasing levels (n,); two are joined straight whatever the kind, one is constant."""
    if len(levels) == 1:
        return ConstantAxis()
    return CubicAxis(levels) if kind == "cubic" and len(levels) > 2 else LinearAxis(levels)


class ConstantAxis:
    """One level: nothing varies along it."""

    def at(self, x: FloatArray) -> AxisWeights:
        """Weight one, derivative zero."""
        return AxisWeights(np.zeros((len(x), 1), dtype=np.int64), np.ones((len(x), 1)), np.zeros((len(x), 1)))


@dataclass(frozen=True, eq=False)
class LinearAxis:
    """Straight lines between levels. At a level itself the derivative is the mean of both sides.

    That is the limit of the central difference; either side alone would hang on the last bit of the angle.
    """

    levels: FloatArray

    def at(self, x: FloatArray) -> AxisWeights:
        """Weights of the level before the nearest inner level, of that and of the one after it."""
        if len(self.levels) == 2:
            return self._between_two(x)
        middles = 0.5 * (self.levels[1:] + self.levels[:-1])
        centre = np.clip(np.searchsorted(middles, x), 1, len(self.levels) - 2)
        before, after = (self.levels[centre + k] - self.levels[centre + k - 1] for k in (0, 1))
        away = x - self.levels[centre]
        at_level = np.abs(away) <= SAME_ANGLE
        rising = np.where(at_level, 0.5, np.where(away > 0, 1.0, 0.0))
        left, right = (1.0 - rising) / before, rising / after
        slope = np.stack([-left, left - right, right], axis=-1)
        left, right = np.minimum(away, 0.0) / before, np.maximum(away, 0.0) / after
        weight = np.stack([-left, 1.0 + left - right, right], axis=-1)
        return AxisWeights(centre[:, None] + np.array([-1, 0, 1]), weight, slope)

    def _between_two(self, x: FloatArray) -> AxisWeights:
        width = self.levels[1] - self.levels[0]
        u = (x - self.levels[0]) / width
        slope = np.broadcast_to(np.array([-1.0, 1.0]) / width, (len(x), 2))
        return AxisWeights(np.broadcast_to(np.array([0, 1]), (len(x), 2)), np.stack([1.0 - u, u], axis=-1), slope)


@dataclass(frozen=True, eq=False)
class CubicAxis:
    """Hermite cubics with the slopes of parabolas through three levels: continuous slope, exact for parabolas.

    Weights depend on the position only, not on what is interpolated, so axes can be combined in any order.
    """

    levels: FloatArray

    def at(self, x: FloatArray) -> AxisWeights:
        """Weights of three or four neighbouring levels."""
        inside = np.clip(x, self.levels[0], self.levels[-1])
        interval = np.clip(np.searchsorted(self.levels, inside, side="right") - 1, 0, len(self.levels) - 2)
        width = (self.levels[interval + 1] - self.levels[interval])[:, None]
        u = (inside - self.levels[interval])[:, None] / width
        c = self._cubics[interval]
        slope = (c[..., 1] + u * (2.0 * c[..., 2] + u * (3.0 * c[..., 3]))) / width
        weight = c[..., 0] + u * (c[..., 1] + u * (c[..., 2] + u * c[..., 3])) + slope * (x - inside)[:, None]
        level = self._first_level[interval][:, None] + np.arange(c.shape[1])
        return AxisWeights(level, weight, slope)

    @cached_property
    def _first_level(self) -> IntArray:
        """First of the levels that each interval (n - 1,) uses: one before it, where there is one."""
        n = len(self.levels)
        return np.clip(np.arange(n - 1) - 1, 0, n - min(4, n))

    @cached_property
    def _cubics(self) -> FloatArray:
        """Weight of each level used (n - 1, 3 or 4, 4): coefficients of 1, u, u^2, u^3 over the interval."""
        n, intervals = len(self.levels), np.arange(len(self.levels) - 1)
        width, slopes = np.diff(self.levels), _parabola_slopes(self.levels)
        cubics = np.zeros((n - 1, min(4, n), 4))
        for end in (0, 1):
            level = intervals + end
            cubics[intervals, level - self._first_level] += _HERMITE_VALUES[end]
            for k in range(3):
                place = np.clip(level - 1, 0, n - 3) + k - self._first_level
                cubics[intervals, place] += (slopes[level, k] * width)[:, None] * _HERMITE_SLOPES[end]
        return cubics


#: Hermite's cubics in powers of u: unit value, and unit slope, at the beginning and the end of [0, 1].
_HERMITE_VALUES = np.array([[1.0, 0.0, -3.0, 2.0], [0.0, 0.0, 3.0, -2.0]])
_HERMITE_SLOPES = np.array([[0.0, 1.0, -2.0, 1.0], [0.0, 0.0, -1.0, 1.0]])


def _parabola_slopes(levels: FloatArray) -> FloatArray:
    """Weights (n, 3) that give the slope at each level of the parabola through it and its neighbours.

    At the ends: through the three outermost levels.
    """
    n = len(levels)
    nodes = levels[np.clip(np.arange(n) - 1, 0, n - 3)[:, None] + np.arange(3)]
    slopes = np.empty((n, 3))
    for k in range(3):
        a, b = nodes[:, (k + 1) % 3], nodes[:, (k + 2) % 3]
        slopes[:, k] = (2.0 * levels - a - b) / ((nodes[:, k] - a) * (nodes[:, k] - b))
    return slopes
