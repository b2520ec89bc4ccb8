"""Gains between the grid points and outside them, by the schedule's own rules (`schedules.rules`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from design.gains import Gain
from model.arrays import BoolArray, FloatArray, Floats, GridArrays, IntArray
from model.flight import GridAxis
from schedules.monotone_cubic import monotone_cubic, slopes
from schedules.schedule import GainSchedule


@dataclass(frozen=True, eq=False)
class Interpolated(GridArrays):
    """Gains of a schedule at flight conditions that need not be grid points.

    Attributes
    ----------
    gains : the schedule's gains, names and units as there, each (*P,) where ``P`` is the shape of
        the conditions; nan where a grid point that carries weight is not ok, and where `refused`
    clipped : (*P,) True where a coordinate lay outside its axis and the nearest edge was taken
    held : (*P,) True where that edge stands for the gains that were last inside, which one evaluation does not know: a
        controller in flight keeps its own
    refused : (*P,) True where a coordinate lay outside its axis and the schedule has no gains there
    """

    gains: tuple[Gain, ...]
    clipped: BoolArray
    held: BoolArray
    refused: BoolArray


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
    outside: BoolArray


def interpolate(schedule: GainSchedule, coordinates: Sequence[Floats]) -> Interpolated:
    """Gains at flight conditions, by the schedule's rules between the points and outside them.

    At a grid point the answer is that point's gain exactly. A failed grid point spoils only the
    conditions that it carries weight for: the node beside it keeps its gain. Of a monotone cubic those are the cells
    that touch it and, along every axis, the next ones. An axis of one breakpoint says nothing about change along it:
    the gains are constant there, and a coordinate that is not that breakpoint counts as outside.

    Outside, ``clip`` takes the nearest edge, each coordinate by itself. ``hold`` does the same and marks it: what it
    means needs the conditions before. ``refuse`` has no gains there, nan, and marks that.

    Parameters
    ----------
    schedule : GainSchedule
        gains (*G,) with the axes and outcomes that belong to them
    coordinates : sequence of floats or arrays
        one per axis of the schedule, in its order and in the axis's unit, that broadcast to a
        common shape ``P``; infinities are outside like any other number beyond the breakpoints

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
    outside = np.zeros(shape, dtype=bool)
    for bracket in brackets:
        outside = np.asarray(outside | bracket.outside)
    policy, nowhere = schedule.rules.out_of_range, np.zeros(shape, dtype=bool)
    refused = outside if policy == "refuse" else nowhere
    between = _monotone_cubic if schedule.rules.interpolation == "monotone_cubic" else _multilinear
    tables = [np.where(schedule.outcomes.ok, gain.values, np.nan) for gain in schedule.gains]
    found = between(schedule.axes, tables, brackets, shape)
    gains = tuple(
        Gain(gain.name, gain.unit, np.where(refused, np.nan, values))
        for gain, values in zip(schedule.gains, found, strict=True)
    )
    clipped = nowhere if policy == "refuse" else outside
    return Interpolated(gains, clipped, outside if policy == "hold" else nowhere, refused)


def _bracket(axis: GridAxis, x: FloatArray) -> _Bracket:
    if np.any(np.isnan(x)):
        raise ValueError(f"{axis.name} [{axis.unit}] must be a number, not nan")
    breakpoints = np.asarray(axis.values, dtype=float)
    inside = np.clip(x, breakpoints[0], breakpoints[-1])
    outside = np.asarray(inside != x)
    if breakpoints.size == 1:
        return _Bracket((np.zeros(x.shape, dtype=np.int64),), (np.ones(x.shape),), outside)
    lower = np.clip(np.searchsorted(breakpoints, inside, side="right") - 1, 0, breakpoints.size - 2)
    lower = np.asarray(lower, dtype=np.int64)
    # At a breakpoint the fraction is exactly 0 or 1, so that the nodes come back as they are.
    fraction = (inside - breakpoints[lower]) / (breakpoints[lower + 1] - breakpoints[lower])
    return _Bracket((lower, lower + 1), (1.0 - fraction, np.asarray(fraction)), outside)


def _multilinear(
    axes: Sequence[GridAxis], tables: Sequence[FloatArray], brackets: Sequence[_Bracket], shape: tuple[int, ...]
) -> list[FloatArray]:
    vertices = list(_vertices(brackets, shape))
    return [_weighted(table, vertices) for table in tables]


def _monotone_cubic(
    axes: Sequence[GridAxis], tables: Sequence[FloatArray], brackets: Sequence[_Bracket], shape: tuple[int, ...]
) -> list[FloatArray]:
    breakpoints = [np.asarray(axis.values, dtype=float) for axis in axes]
    lower = [bracket.indices[0].ravel() for bracket in brackets]
    # Of an axis of one breakpoint there is no way to go.
    fraction = [b.weights[1].ravel() if len(b.weights) > 1 else np.zeros(b.weights[0].size) for b in brackets]
    return [monotone_cubic(table, breakpoints, lower, fraction).reshape(shape) for table in tables]


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


def node_slopes(schedule: GainSchedule, axis: int) -> tuple[Gain, ...]:
    """How the gains change along an axis at the grid's points, below and above each: (*G, 2), per unit of the axis.

    Between the points that is the rule's own derivative: of multilinear gains it jumps there, of a monotone cubic both
    sides are the same. Beyond the first and the last breakpoint the gains are constant, unless the schedule refuses to
    have any: then there is no slope. It is nan too where the point or another that has a part in it is not ok.
    """
    breakpoints = np.asarray(schedule.axes[axis].values, dtype=float)
    edge = np.nan if schedule.rules.out_of_range == "refuse" else 0.0
    found = []
    for gain in schedule.gains:
        table = np.moveaxis(np.where(schedule.outcomes.ok, gain.values, np.nan), axis, -1)[..., None]
        sides = np.full((*table.shape[:-1], 2), edge)
        if breakpoints.size > 1 and schedule.rules.interpolation == "monotone_cubic":
            sides[..., 1:, 0] = slopes(table, breakpoints)[..., 1:, 0]
            sides[..., :-1, 1] = slopes(table, breakpoints)[..., :-1, 0]
        elif breakpoints.size > 1:
            secant = np.diff(table[..., 0], axis=-1) / np.diff(breakpoints)
            sides[..., 1:, 0], sides[..., :-1, 1] = secant, secant
        sides[np.isnan(table[..., 0])] = np.nan
        found.append(Gain(gain.name, f"{gain.unit} per {schedule.axes[axis].unit}", np.moveaxis(sides, -2, axis)))
    return tuple(found)
