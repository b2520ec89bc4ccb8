"""Flight conditions with the gains that belong to them, for files that can check themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from model.arrays import FloatArray
from schedules.interpolate import interpolate
from schedules.schedule import GainSchedule

#: At most so many points of each sort (nodes, centres), spread evenly over the grid.
MOST = 16


@dataclass(frozen=True)
class CheckPoint:
    """One condition: coordinates and gains in the order of the schedule's axes and gains, units as there."""

    name: str
    coordinates: tuple[float, ...]
    gains: tuple[float, ...]
    clipped: bool


def check_points(schedule: GainSchedule) -> list[CheckPoint]:
    """Grid nodes, centres of cells, and one condition beyond each edge with its gains clipped.

    `schedule` has a gain at every point; whatever its rule outside them, the gains there are the edge's.
    """
    schedule = replace(schedule, rules=replace(schedule.rules, out_of_range="clip"))
    axes = [np.asarray(axis.values, dtype=float) for axis in schedule.axes]
    middle = [0.5 * (x[0] + x[-1]) for x in axes]
    rows = [("node", row) for row in _some(axes)]
    rows += [("centre", row) for row in _some([0.5 * (x[:-1] + x[1:]) if x.size > 1 else x for x in axes])]
    for k, values in enumerate(axes):
        step = 0.25 * (values[-1] - values[0]) or max(1.0, abs(values[0]))
        for side, beyond in (("below", values[0] - step), ("above", values[-1] + step)):
            rows.append((f"{side} {schedule.axes[k].name}", np.array([*middle[:k], beyond, *middle[k + 1 :]])))
    found = interpolate(schedule, tuple(np.array([row for _, row in rows]).T))
    gains = np.stack([gain.values for gain in found.gains], axis=-1)
    return [
        CheckPoint(f"{n}: {name}", tuple(row.tolist()), tuple(gains[n].tolist()), bool(found.clipped[n]))
        for n, (name, row) in enumerate(rows)
    ]


def magnitudes(schedule: GainSchedule) -> list[float]:
    """Of each gain the number that its rounding errors are in proportion to, in its unit.

    The largest value, and the largest change over the table times the largest ratio of a coordinate to the
    width of its cell: a coordinate that is rounded moves within its cell by so much.
    """
    axes = [np.asarray(axis.values, dtype=float) for axis in schedule.axes]
    ratios = [float(np.max(np.abs(x)) / np.min(np.diff(x))) for x in axes if x.size > 1]
    found = []
    for gain in schedule.gains:
        large = float(np.max(np.abs(gain.values)))
        change = float(np.max(gain.values) / 2 - np.min(gain.values) / 2) * 2.0
        found.append(min(large + change * sum(ratios), 1e300))
    return found


def _some(axes: list[FloatArray]) -> FloatArray:
    """(at most `MOST`, number of axes) points of the grid of these axes, first and last among them."""
    count = int(np.prod([x.size for x in axes]))
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST)).round().astype(int))
    index = np.unravel_index(chosen, [x.size for x in axes])
    return np.stack([x[i] for x, i in zip(axes, index, strict=True)], axis=-1)
