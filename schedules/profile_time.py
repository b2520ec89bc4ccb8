"""When a flight over a profile is smooth: from knot to knot, from grid line to grid line, from layer to layer.

Gains that are multilinear in the grid's axes bend where the profile crosses a grid line, and the plant's load bends
where the profile itself does. Steps end there, so that the order of the integration is that of smooth equations.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from design.manoeuvre import Manoeuvre
from design.simulation.time_grid import LARGEST_COUNT, Segment
from model.arrays import FloatArray
from model.flight import FlightCondition, GridAxis
from schedules.profile import FlightProfile, ProfileRefused

#: Altitudes at which the gradient of temperature jumps (ISO 2533) [m].
LAYERS = (11_000.0, 20_000.0)
#: Places at which a straight piece of the profile is searched for crossings.
_SEARCHED = 16
_BISECTIONS = 50
#: Times closer than this part of the duration are one.
_SAME = 1e-12


def coordinates(axes: tuple[GridAxis, ...], condition: FlightCondition) -> tuple[FloatArray, ...]:
    """Coordinates of flight conditions in the axes of a grid, one array an axis."""
    of = {name: getattr(condition, name) for name in ("dynamic_pressure", "airspeed", "mach")}
    of["altitude"] = condition.air.altitude
    return tuple(of[axis.name] for axis in axes)


def flight_segments(
    profile: FlightProfile, axes: tuple[GridAxis, ...], manoeuvre: Manoeuvre, duration: float, samples: int
) -> tuple[Segment, ...]:
    """Segments that end where the references, the profile or the gains bend or jump.

    The samples are ``duration / (samples - 1)`` apart at most.

    Raises
    ------
    ProfileRefused : more crossings of grid lines than a simulation may have steps
    """
    marks = np.concatenate([manoeuvre.times, profile.times, _crossings(profile, axes, duration), [0.0, duration]])
    marks = np.unique(marks[marks <= duration])
    marks = marks[np.append(True, np.diff(marks) > _SAME * duration)]
    marks[-1] = duration
    made = []
    for begin, end in pairwise(marks.tolist()):
        count = max(1, int(np.ceil((end - begin) / duration * (samples - 1) * (1.0 - 1e-9))))
        knot = int(np.searchsorted(manoeuvre.times, 0.5 * (begin + end), side="right")) - 1
        made.append(Segment(begin, end, count, knot))
    return tuple(made)


def _crossings(profile: FlightProfile, axes: tuple[GridAxis, ...], duration: float) -> FloatArray:
    """Times at which the profile crosses a line of the grid, or a layer of the air."""
    knots = np.append(profile.times[profile.times < duration], min(duration, max(profile.times[-1], 0.0)))
    knots = np.unique(knots)
    parts = np.linspace(knots[:-1], knots[1:], _SEARCHED, endpoint=False).T.ravel()
    nodes = np.append(parts, knots[-1])
    found = [np.zeros(0)]
    lines = [*((axis, np.array(axis.values)) for axis in axes), (GridAxis("altitude", "m", LAYERS), np.array(LAYERS))]
    for axis, values in lines:
        (place,) = coordinates((axis,), profile.condition(nodes))
        cell = np.searchsorted(values, place, side="right")
        lower, count = np.minimum(cell[:-1], cell[1:]), np.abs(np.diff(cell))
        if count.sum() > LARGEST_COUNT:
            raise ProfileRefused(f"the profile crosses grid lines {count.sum()} times, more than {LARGEST_COUNT}")
        interval = np.repeat(np.arange(len(count)), count)
        within = np.arange(len(interval)) - np.repeat(np.cumsum(count) - count, count)
        level = values[lower[interval] + within]
        found.append(_bisected(profile, axis, nodes[interval], nodes[interval + 1], level))
    return np.concatenate(found)


def _bisected(
    profile: FlightProfile, axis: GridAxis, begin: FloatArray, end: FloatArray, level: FloatArray
) -> FloatArray:
    """Times (P,) between `begin` and `end` at which the coordinate passes `level`."""
    if not len(level):
        return level
    (first,) = coordinates((axis,), profile.condition(begin))
    above = np.asarray(first >= level)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (begin + end)
        (place,) = coordinates((axis,), profile.condition(middle))
        same = (place >= level) == above
        begin, end = np.where(same, middle, begin), np.where(same, end, middle)
    return end
