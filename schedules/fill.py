"""Gains for the points that have none, by a rule that has a name, for files that cannot say "no gain here".

A table in C, JSBSim, DAVE-ML or Simulink has a number everywhere. Where a point of the grid failed, that
number must come from somewhere, and the one who flies it must know: it comes from another point of the same
schedule, all gains together, and the point stays marked. A filled point is not a design: nothing was proved there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from design.outcome import Outcomes
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name

FillRule = Literal["nearest_ok", "hold_neighbour"]

#: What each rule does, word for word as the files state it.
FILL_RULES: dict[FillRule, str] = {
    "nearest_ok": "a point that is not ok has all gains of the nearest ok point, distances measured in parts of each "
    "axis's span; of several as near, the first in row-major order",
    "hold_neighbour": "a point that is not ok has all gains of the nearest ok point along the last axis, the other "
    "coordinates unchanged; of two as near, the lower",
}


class MissingGains(ValueError):
    """Points of the schedule carry no gains, and no rule was named or the rule finds none for them."""


@dataclass(frozen=True, eq=False)
class FilledSchedule(GridArrays):
    """A schedule with a gain at every point.

    Attributes
    ----------
    designed : the schedule as it was designed: its outcomes and reasons stay true
    complete : the same with every point filled and marked ok, for what only looks up tables
    rule : where the gains of the failed points come from; None when every point is ok
    source : (*G,) flat index, row-major, of the point that the gains were designed for
    """

    designed: GainSchedule
    complete: GainSchedule
    rule: FillRule | None
    source: IntArray

    @property
    def filled(self) -> BoolArray:
        """(*G,) mask of the points whose gains are another point's."""
        return np.asarray(~self.designed.outcomes.ok)


def filled(schedule: GainSchedule, rule: FillRule | None = None) -> FilledSchedule:
    """The schedule with the gains of failed points taken from other points by `rule`.

    A schedule whose points are all ok comes back as it is, whatever the rule.

    Raises
    ------
    MissingGains : points are not ok and no rule is named, or there is no ok point where the rule looks
    ValueError : there is no such rule
    """
    if rule is not None and rule not in FILL_RULES:
        raise ValueError(f"no fill rule {rule!r}; there are: {', '.join(get_args(FillRule))}")
    ok = schedule.outcomes.ok
    source = np.arange(ok.size, dtype=np.int64).reshape(ok.shape)
    if np.all(ok):
        return FilledSchedule(schedule, schedule, None, source)
    if rule is None:
        raise MissingGains(
            f"{schedule.controller} has no gains at {np.count_nonzero(~ok)} of {ok.size} points, the first of them "
            f"{_first(schedule, ~ok)}; a table needs a number everywhere: name a fill rule ({', '.join(FILL_RULES)})"
        )
    distance = _nearest_ok if rule == "nearest_ok" else _along_last_axis
    candidates = np.flatnonzero(ok)
    coordinates = _coordinates(schedule)
    for point in np.flatnonzero(~ok).tolist():
        far = distance(coordinates, point, candidates)
        if not np.any(np.isfinite(far)):
            where = "no point is ok" if rule == "nearest_ok" else "no point of its line along the last axis is ok"
            raise MissingGains(f"{rule} finds no gains of {schedule.controller} for {_at(schedule, point)}: {where}")
        source.flat[point] = candidates[np.argmin(far)]  # the first of the smallest
    gains = tuple(replace(gain, values=gain.values.ravel()[source]) for gain in schedule.gains)
    complete = replace(schedule, gains=gains, outcomes=Outcomes.all_ok(schedule.shape))
    return FilledSchedule(schedule, complete, rule, source)


def _coordinates(schedule: GainSchedule) -> FloatArray:
    """(number of points, number of axes) coordinates in parts of each axis's span; 0 on an axis of one breakpoint."""
    parts = []
    for axis in schedule.axes:
        values = np.asarray(axis.values, dtype=float)
        span = values[-1] - values[0]
        parts.append((values - values[0]) / (span if span > 0.0 else 1.0))
    grid = np.meshgrid(*parts, indexing="ij")
    return np.stack([x.ravel() for x in grid], axis=-1) if grid else np.zeros((1, 0))


def _nearest_ok(coordinates: FloatArray, point: int, candidates: IntArray) -> FloatArray:
    return np.asarray(np.sum((coordinates[candidates] - coordinates[point]) ** 2, axis=-1))


def _along_last_axis(coordinates: FloatArray, point: int, candidates: IntArray) -> FloatArray:
    same_line = np.all(coordinates[candidates, :-1] == coordinates[point, :-1], axis=-1)
    if coordinates.shape[1] == 0:
        return np.full(candidates.shape, np.inf)
    return np.where(same_line, np.abs(coordinates[candidates, -1] - coordinates[point, -1]), np.inf)


def _first(schedule: GainSchedule, where: BoolArray) -> str:
    point = int(np.flatnonzero(where)[0])
    reason = schedule.outcomes.reasons.flat[point]
    return f"{_at(schedule, point)} ({schedule.outcomes.codes.flat[point]}{f'; {reason}' if reason else ''})"


def _at(schedule: GainSchedule, point: int) -> str:
    index = np.unravel_index(point, schedule.shape)
    places = (f"{axis_name(a)} {a.values[i]:g}" for a, i in zip(schedule.axes, index, strict=True))
    return ", ".join(places) or "the only point"
