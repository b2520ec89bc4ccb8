"""Gains between the grid points: multilinear in the grid's own axes, clipped outside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from design.gains import Gain
from model.arrays import BoolArray, FloatArray, Floats, GridArrays, IntArray
from model.flight import GridAxis
from schedules.schedule import GainSchedule


@dataclass(frozen=True, eq=False)
class Interpolated(GridArrays):
    """Gains of a schedule at flight conditions that need not be grid points.

    Attributes
    ----------
    gains : the schedule's gains, names and units as there, each (*P,) where ``P`` is the shape of
        the conditions; nan where a grid point that carries weight is not ok
    clipped : (*P,) True where a coordinate lay outside its axis and the nearest edge was taken
    """

    gains: tuple[Gain, ...]
    clipped: BoolArray


@dataclass(frozen=True, eq=False)
class _Vertex:
    """One corner of the cells that the conditions lie in: its index in the grid and its weight (*P,)."""

    index: tuple[IntArray, ...]
    weight: FloatArray


@dataclass(frozen=True, eq=False)
class _Bracket:
    """Neighbours of the conditions along one axis, one (*P,) entry each: indices and weights."""

    indices: tuple[IntArray, ...]
    weights: tuple[FloatArray, ...]
    clipped: BoolArray


def interpolate(schedule: GainSchedule, coordinates: Sequence[Floats]) -> Interpolated:
    """Gains at flight conditions: multilinear in the grid's axes, clipped to the edges outside them.

    At a grid point the answer is that point's gain exactly. A failed grid point spoils only the
    conditions that it carries weight for: the node beside it keeps its gain. An axis of one
    breakpoint says nothing about change along it: the gains are constant there, and a coordinate that
    is not that breakpoint counts as clipped.

    Parameters
    ----------
    schedule : GainSchedule
        gains (*G,) with the axes and outcomes that belong to them
    coordinates : sequence of floats or arrays
        one per axis of the schedule, in its order and in the axis's unit, that broadcast to a
        common shape ``P``; infinities are clipped like any other number

    Returns
    -------
    Interpolated : gains (*P,) in the unit of each gain

    Raises
    ------
    ValueError : not one coordinate an axis, coordinates that do not broadcast, or a coordinate is nan
    """
    if len(coordinates) != len(schedule.axes):
        names = ", ".join(axis.name for axis in schedule.axes)
        raise ValueError(f"{len(coordinates)} coordinates for {len(schedule.axes)} axes ({names})")
    shape = np.broadcast_shapes(*(np.shape(x) for x in coordinates))
    points = (np.broadcast_to(np.asarray(x, dtype=float), shape) for x in coordinates)
    brackets = [_bracket(axis, x) for axis, x in zip(schedule.axes, points, strict=True)]
    vertices = list(_vertices(brackets, shape))
    ok = schedule.outcomes.ok
    gains = tuple(Gain(g.name, g.unit, _weighted(np.where(ok, g.values, np.nan), vertices)) for g in schedule.gains)
    clipped = np.zeros(shape, dtype=bool)
    for bracket in brackets:
        clipped = np.asarray(clipped | bracket.clipped)
    return Interpolated(gains, clipped)


def _bracket(axis: GridAxis, x: FloatArray) -> _Bracket:
    if np.any(np.isnan(x)):
        raise ValueError(f"{axis.name} [{axis.unit}] must be a number, not nan")
    breakpoints = np.asarray(axis.values, dtype=float)
    inside = np.clip(x, breakpoints[0], breakpoints[-1])
    clipped = np.asarray(inside != x)
    if breakpoints.size == 1:
        return _Bracket((np.zeros(x.shape, dtype=np.int64),), (np.ones(x.shape),), clipped)
    lower = np.clip(np.searchsorted(breakpoints, inside, side="right") - 1, 0, breakpoints.size - 2)
    lower = np.asarray(lower, dtype=np.int64)
    # At a breakpoint the fraction is exactly 0 or 1, so that the nodes come back as they are.
    fraction = (inside - breakpoints[lower]) / (breakpoints[lower + 1] - breakpoints[lower])
    return _Bracket((lower, lower + 1), (1.0 - fraction, np.asarray(fraction)), clipped)


def _vertices(brackets: Sequence[_Bracket], shape: tuple[int, ...]) -> Iterator[_Vertex]:
    for corner in product(*(range(len(b.indices)) for b in brackets)):
        weight = np.ones(shape)
        for bracket, side in zip(brackets, corner, strict=True):
            weight = weight * bracket.weights[side]
        yield _Vertex(tuple(b.indices[s] for b, s in zip(brackets, corner, strict=True)), weight)


def _weighted(values: FloatArray, vertices: Sequence[_Vertex]) -> FloatArray:
    total = np.zeros(vertices[0].weight.shape)
    for vertex in vertices:
        # A corner without weight takes no part, not even with its nan: 0 * nan would be nan.
        total = total + np.where(vertex.weight == 0.0, 0.0, vertex.weight * values[vertex.index])
    return np.asarray(total)
