"""The search for the smoothest table of gains, each point of which keeps its limits.

Each round is a step of sequential programming. The table's errors and the points' limits are linearised about the
present gains, the limits by judging a small change of every gain; the smoothest table under these limits, in a
region about the present one in which the lines are believed, comes from `constrained_least_squares`. It is judged
exactly, the bending of the limits that this shows is put into the lines, and the step is sought once more. A point
that still exceeds a limit goes only a part of its way. So every table on the way is one of gains that were judged,
and each is smoother than the one before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, csr_array, eye_array, vstack

from model.arrays import BoolArray, FloatArray
from schedules.constrained_least_squares import constrained_least_squares
from schedules.point_limits import PointLimits, kept
from schedules.roughness import LEAST_SIZE, Stencils, rms

_ROUNDS = 12
#: A table whose errors are this small is smooth; and a round that gains less than this part of them is the last.
_SMOOTH, _WORTH_A_ROUND = 1e-3, 0.01
#: Size of the first region, of the largest, and of one in which nothing is left to be gained, as parts of a gain.
_FIRST, _LARGEST, _LEAST = 0.1, 0.3, 1e-3
#: Change of a gain by which limits are linearised, as a part of it.
_CHANGE = 1e-3
#: Part of the region that is kept from the linearised limits, for what their solution leaves.
_INSIDE = 2e-3
#: Parts of its way that a point is tried at when all of it exceeds a limit.
_PARTS = (0.6, 0.3, 0.1)
#: Weight that holds gains where they are as long as the table does not care.
_STAY = 1e-3


@dataclass(frozen=True, eq=False)
class _Table:
    """Gains (P, J) of the points, and their room inside each limit (P, c), none of which is exceeded."""

    values: FloatArray
    room: FloatArray


@dataclass(frozen=True, eq=False)
class _Lines:
    """The table's errors and the points' limits linearised, in steps d (P, J) that are parts of `unit` (P, J).

    ``errors + bend d`` are the errors (E,) of the whole table, d flattened; ``room + slope d`` the room (P, c), with
    slope (P, c, J).
    """

    unit: FloatArray
    errors: FloatArray
    bend: csr_array
    slope: FloatArray


def smoothest_table(limits: PointLimits, stencils: Stencils, start: FloatArray, open_: BoolArray) -> FloatArray:
    """Gains (P, J) of the smoothest table found from `start` (P, J); only the columns of `open_` (J,) move.

    Parameters
    ----------
    limits : what each point must keep
    stencils : triples of neighbours among the points
    start : gains that keep their limits, at least 0
    """
    room = limits.room(start, np.arange(len(start)))
    # A point of no triple has nothing to gain, and one without a bandwidth, or without a value of a spec, nothing to
    # give: both stay, and the others see them.
    seen = np.isin(np.arange(len(start)), [stencils.before, stencils.here, stencils.after])
    free = (seen & kept(room))[:, None] & open_
    if not np.any(free):
        return start
    table = _Table(start, np.where(np.isfinite(room), room, 0.0))
    first = best = _errors(stencils, start, open_)
    radius = np.full(len(start), _FIRST)
    for _ in range(_ROUNDS):
        if _size(best) < _SMOOTH or np.max(radius) < _LEAST:
            break
        lines = _linearised(limits, stencils, table, free)
        moved, part = _moved(limits, table, lines, radius)
        errors = _errors(stencils, moved.values, open_)
        gained = 1.0 - _size(errors) / _size(best)
        if gained <= 0.0 or np.max(np.abs(errors)) > np.max(np.abs(first)):
            radius = 0.4 * radius
            continue
        table, best = moved, errors
        grown = np.where(part == 1.0, 1.5, np.where(part >= 0.3, 0.7, 0.4)) * radius
        radius = np.clip(grown, 2.0 * _LEAST, _LARGEST)
        if gained < _WORTH_A_ROUND:
            break
    return table.values


def _errors(stencils: Stencils, values: FloatArray, open_: BoolArray) -> FloatArray:
    """Errors (E,) of the table of the gains that are open."""
    return stencils.errors(values.T[open_]).ravel()


def _size(errors: FloatArray) -> float:
    return rms(errors) or 0.0


def _linearised(limits: PointLimits, stencils: Stencils, table: _Table, free: BoolArray) -> _Lines:
    values, (P, J) = table.values, table.values.shape
    unit, open_ = np.where(free, _units(stencils, values), 0.0), np.any(free, axis=0)
    changed = [values + _CHANGE * unit * (np.arange(J) == j) for j in range(J) if open_[j]]
    room = limits.room(np.concatenate(changed), np.tile(np.arange(P), len(changed))).reshape(len(changed), P, -1)
    slope = np.zeros((P, room.shape[-1], J))
    slope[:, :, open_] = np.moveaxis(room - table.room, 0, -1) / _CHANGE
    # A limit that ceases to exist has no slope to believe: the judgement of the step will tell.
    slope = np.where(np.isfinite(slope), slope, 0.0)
    return _Lines(unit, _errors(stencils, values, open_), _bend(stencils, values, unit, open_), slope)


def _units(stencils: Stencils, values: FloatArray) -> FloatArray:
    """Size of each gain (P, J), no less than a part of its neighbours', so that a gain of nothing can grow."""
    unit = np.abs(values)
    for one, other in ((stencils.here, stencils.before), (stencils.here, stencils.after)):
        for at, beside in ((one, other), (other, one)):
            np.maximum.at(unit, at, LEAST_SIZE * np.abs(values[beside]))
    return unit


def _bend(stencils: Stencils, values: FloatArray, unit: FloatArray, open_: BoolArray) -> csr_array:
    """How the errors change with steps of the gains (E, P J)."""
    P, J = values.shape
    rows = np.arange(stencils.here.size)
    parts = []
    for j in np.flatnonzero(open_):
        gain = values[:, j]
        size, here = stencils.sizes(gain), gain[stencils.here]
        own = np.asarray((np.abs(here) >= size) & (here != 0.0))
        scale = np.where(size > 0.0, size, 1.0)
        # Of g_interpolated / g - 1 where the size is the gain itself, of (g_interpolated - g) / size elsewhere.
        by_here = np.where(own, -stencils.interpolated(gain) / scale**2, -1.0 / scale)
        entries = [stencils.share / scale, by_here, (1.0 - stencils.share) / scale]
        points = [stencils.before, stencils.here, stencils.after]
        data = np.concatenate([entry * unit[at, j] for entry, at in zip(entries, points, strict=True)])
        where = np.tile(rows, 3), np.concatenate(points) * J + j
        parts.append(csr_array((data, where), shape=(rows.size, P * J)))
    return csr_array(vstack(parts))


def _moved(limits: PointLimits, table: _Table, lines: _Lines, radius: FloatArray) -> tuple[_Table, FloatArray]:
    """The table after a step, and the part (P,) of its way that each point has gone."""
    every = np.arange(len(radius))
    bent = np.zeros_like(table.room)
    for attempt in ("straight", "bent"):
        step = _step(table, lines, radius, bent)
        there = np.maximum(table.values + step * lines.unit, 0.0)
        room = limits.room(there, every)
        good = kept(room)
        if np.all(good) or attempt == "bent":
            break
        believed = table.room + np.einsum("pcj,pj->pc", lines.slope, step)
        bent = np.clip(believed - room, 0.0, 0.5 * radius[:, None] * _steepness(lines))
    part = np.where(good, 1.0, 0.0)
    short = np.flatnonzero(~good)
    values, room = np.where(good[:, None], there, table.values), np.where(good[:, None], room, table.room)
    if short.size:
        way = there[short] - table.values[short]
        tried = np.concatenate([table.values[short] + p * way for p in _PARTS])
        found = limits.room(tried, np.tile(short, len(_PARTS)))
        shapes = ((len(_PARTS), short.size, -1),) * 2
        tried, found = tried.reshape(shapes[0]), found.reshape(shapes[1])
        for k in range(len(_PARTS) - 1, -1, -1):
            reached = kept(found[k])
            at = short[reached]
            values[at], room[at], part[at] = tried[k, reached], found[k, reached], _PARTS[k]
    return _Table(values, room), part


def _steepness(lines: _Lines) -> FloatArray:
    """Largest change of each limit's room (P, c) that a step of one in every gain can make; 1 where there is none."""
    size = np.sum(np.abs(lines.slope), axis=-1)
    return np.where(size > 0.0, size, 1.0)


def _step(table: _Table, lines: _Lines, radius: FloatArray, bent: FloatArray) -> FloatArray:
    """Step (P, J) to the smoothest table under the linearised limits, with what they were seen to be `bent` by."""
    P, J = table.values.shape
    steep = _steepness(lines)
    room = np.where(np.any(lines.slope != 0.0, axis=-1), table.room, np.inf)
    within = (bent - room) / steep + _INSIDE * radius[:, None]
    region = np.repeat(radius, J)
    unit = lines.unit.ravel()
    falls = np.where(unit > 0.0, table.values.ravel() / np.where(unit > 0.0, unit, 1.0), 0.0)
    rows = csr_array(block_diag(list(lines.slope / steep[..., None])))
    step = constrained_least_squares(
        lines.bend,
        -lines.errors,
        csr_array(vstack([rows, eye_array(P * J)])),
        np.concatenate([within.ravel(), -np.minimum(region, falls)]),
        np.concatenate([np.full(within.size, np.inf), region]),
        _STAY,
    )
    return step.reshape(P, J)
