"""Integration of a flight: Runge and Kutta's method of order four, the loop made anew at every stage."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import cos

import numpy as np

from design.manoeuvre import Manoeuvre
from design.simulation.plant import NonlinearPlant
from design.simulation.time_grid import Segment, needed_substeps
from design.simulation.trajectory import LARGEST_ANGLE
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from schedules.profile_instants import Course, Instants, times_vector

#: Steps whose instants are made in one batch.
_BATCH = 1024
#: Even parts of the duration at which the loop's speed is looked at, beside the ends of the segments.
_LOOKED_AT = 256
#: A settled beginning is found when nothing is left of the rates but this part of their terms.
_AT_REST = 1e-12
_NEWTON = 40

Rates = Callable[[int, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Nodes(GridArrays):
    """What is known at M nodes of a flight; where a segment ends and the next one begins there are two at one time.

    Attributes
    ----------
    time, segment : (M,) [s], and the number of the segment
    states, rates : (M, n) totals and their rates
    commands : (M, m) v, deviations from the plant's trim
    reference : (M, p) deviations from the controller's trim [rad]
    instants : (M,) the loops there
    diverged_at : time at which a surface is beyond a right angle behind these nodes [s]; nan where none is
    """

    time: FloatArray
    segment: IntArray
    states: FloatArray
    rates: FloatArray
    commands: FloatArray
    reference: FloatArray
    instants: Instants
    diverged_at: float


@dataclass(frozen=True, eq=False)
class Steps:
    """Even steps through segments: begin and length (S,) [s], knot of the manoeuvre and number of the segment (S,)."""

    begin: FloatArray
    end: FloatArray
    knot: IntArray
    segment: IntArray

    @classmethod
    def through(cls, segments: tuple[Segment, ...], substeps: IntArray) -> Steps:
        """Steps, `substeps` (segments,) in each interval of a segment."""
        times = [segment.times(int(count)) for segment, count in zip(segments, substeps, strict=True)]
        lengths = [len(t) - 1 for t in times]
        return cls(
            np.concatenate([t[:-1] for t in times]), np.concatenate([t[1:] for t in times]),
            np.repeat([segment.knot for segment in segments], lengths), np.repeat(np.arange(len(segments)), lengths),
        )  # fmt: skip

    def part(self, begin: int, end: int) -> Steps:
        """Some of them in a row."""
        rows = slice(begin, end)
        return Steps(self.begin[rows], self.end[rows], self.knot[rows], self.segment[rows])


def substeps_of(
    course: Course, segments: tuple[Segment, ...], tolerance: float, omega: float, given: int | None
) -> IntArray:
    """Steps between two samples in each segment (segments,): what its fastest loop needs for the tolerance.

    Parameters
    ----------
    tolerance : as in `design.simulation.time_grid`
    omega : frequency of the references [rad/s]
    given : so many, whatever is needed; None: what is needed
    """
    if given is not None:
        return np.full(len(segments), given)
    marks = np.array([segments[0].begin, *(segment.end for segment in segments)])
    looked = np.union1d(marks, np.linspace(0.0, marks[-1], _LOOKED_AT + 1))
    loop = course.at(looked).loop
    speed = needed_substeps(loop.closed, loop.A, tolerance, 1.0, ())
    moved = needed_substeps(np.array([[omega]]), np.array([[omega]]), tolerance, 1.0, ())
    found = []
    for segment in segments:
        rows = slice(*np.searchsorted(looked, [segment.begin, segment.end], side="left"))
        fastest = max(int(speed[rows].max()), int(speed[rows.stop]), int(moved))
        found.append(int(np.ceil(fastest * (segment.end - segment.begin) / segment.intervals - 1e-9)))
    return np.maximum(np.array(found, dtype=np.int64), 1)


def references(manoeuvre: Manoeuvre, knot: IntArray, time: FloatArray) -> FloatArray:
    """(P, p) references at times (P,), those from a knot (P,) on."""
    found = manoeuvre.values[knot] + manoeuvre.slopes[knot] * (time - manoeuvre.times[knot])[:, None]
    return np.asarray(found + manoeuvre.amplitude * np.sin(manoeuvre.omega * time)[:, None])


def settled(course: Course) -> FloatArray:
    """Where the loop rests at the first instant, references at trim (n,): the trim itself, if the controller knows it.

    Raises
    ------
    ValueError : no rest is found
    """
    first = course.at(np.zeros(1))
    rates = _rates(first, first.constant, np.zeros(1, dtype=np.int64))
    closed = first.closed[0]
    x: FloatArray = first.trim[0]
    scale = np.abs(closed) @ np.abs(x) + np.abs(first.constant[0])
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON):
            left = rates(0, x)
            if not np.isfinite(left).all() or np.abs(x[0]) > LARGEST_ANGLE:
                break
            if np.all(np.abs(left) <= _AT_REST * (scale + np.abs(scale).max())):
                return x
            try:
                x = np.asarray(x - np.linalg.solve(closed, left))
            except np.linalg.LinAlgError:
                break
    raise ValueError(
        f"controller {course.designed.request.name} finds no rest at the beginning of the profile, with the trim "
        "that it works from"
    )


def fly(course: Course, manoeuvre: Manoeuvre, steps: Steps, start: FloatArray) -> Iterator[Nodes]:
    """Nodes of a flight, batch by batch: at the beginning of every step, and at the end of every segment.

    After a flight has diverged there are none.
    """
    x, total = start, len(steps.begin)
    for begin in range(0, total, _BATCH):
        end = min(begin + _BATCH, total)
        after = steps.segment[end] if end < total else -1
        ends = np.diff(np.append(steps.segment[begin:end], after)) != 0
        nodes, x = _batch(course, manoeuvre, steps.part(begin, end), ends, x)
        yield nodes
        if not np.isnan(nodes.diverged_at):
            return


def _batch(
    course: Course, manoeuvre: Manoeuvre, steps: Steps, ends: BoolArray, x: FloatArray
) -> tuple[Nodes, FloatArray]:
    """Nodes of some steps in a row, and the state behind them; `ends` (S,) marks the last steps of segments."""
    times = np.stack([steps.begin, 0.5 * (steps.begin + steps.end), steps.end], axis=-1).ravel()
    each, at = np.unique(times, return_inverse=True)
    instants = course.at(each)
    reference = references(manoeuvre, np.repeat(steps.knot, 3), times)
    forced = instants.constant[at] + times_vector(instants.loop.reference_input[at], reference)
    rates = _rates(instants, forced, at)
    surfaces = [course.loop.states.index(name) for name in ("dt", "da")]
    states, slopes, rows, diverged = [], [], [], np.nan
    with np.errstate(over="ignore", invalid="ignore"):
        for k, h in enumerate((steps.end - steps.begin).tolist()):
            first, half = 3 * k, 0.5 * h
            k1 = rates(first, x)
            states.append(x)
            slopes.append(k1)
            rows.append(first)
            k2 = rates(first + 1, x + half * k1)
            k3 = rates(first + 1, x + half * k2)
            k4 = rates(first + 2, x + h * k3)
            x = x + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)
            # No comparison with nan holds.
            if not all(abs(x[i]) <= LARGEST_ANGLE for i in surfaces):
                diverged = float(steps.end[k])
                break
            if ends[k]:
                states.append(x)
                slopes.append(rates(first + 2, x))
                rows.append(first + 2)
    chosen = np.array(rows)
    X, r, there = np.array(states), reference[chosen], instants.take(at[chosen])
    segment = np.repeat(steps.segment, 3)[chosen]
    return Nodes(times[chosen], segment, X, np.array(slopes), there.commands(X, r), r, there, diverged), x


def _rates(instants: Instants, forced: FloatArray, at: IntArray) -> Rates:
    """Rates of the states (n,) at a stage, of which there are S: terms that do not depend on them, and the instant.

    Parameters
    ----------
    forced : (S, n)
    at : (S,) places of the instants
    """
    closed, place, beyond = instants.closed, at.tolist(), _beyond(instants)

    def rates(stage: int, x: FloatArray) -> FloatArray:
        k = place[stage]
        rate: FloatArray = closed[k] @ x
        rate += forced[stage]
        if beyond is not None:
            beyond(k, x, rate)
        return rate

    return rates


def _beyond(instants: Instants) -> Callable[[int, FloatArray, FloatArray], None] | None:
    """Adds J^-1 R to rates (n,) of states (n,) at an instant, in place; None where the plant is linear."""
    plant, states = instants.plant, instants.loop.states
    if plant.linear_source and not plant.thesis:
        return None
    at = {name: i for i, name in enumerate(states)}
    both = instants.loop.inputs != ("tab",)
    J = plant.model.inertia
    # Of the servo-tab model the aileron moves alone, by its own inertia.
    mobility = np.linalg.inv(J) if both else np.stack([np.zeros(len(J)), 1.0 / J[:, 1, 1]], axis=-1)[:, None, :]
    moved = [at["dt_rate"], at["da_rate"]] if both else [at["da_rate"]]
    of_rate = at.get("dt_rate")
    tab, aileron, aileron_rate = at["dt"], at["da"], at["da_rate"]
    if plant.linear_source:
        direction = -(plant.load * plant.levers[:, 0])[:, None] * plant.gradient[..., 0]
        by_cosine = np.einsum("pij,pj->pi", mobility, direction).tolist()
        cosine = np.cos(plant.angles[:, 0]).tolist()

        def by_induced_angle(k: int, x: FloatArray, rate: FloatArray) -> None:
            change = (cos(x[tab]) - cosine[k]) * x[aileron_rate]
            for row, size in zip(moved, by_cosine[k], strict=True):
                rate[row] += size * change

        return by_induced_angle

    torque = _torque_of_source(plant)

    def by_source(k: int, x: FloatArray, rate: FloatArray) -> None:
        tab_rate = rate[tab] if of_rate is None else x[of_rate]
        rate[moved] += mobility[k] @ torque(k, x[tab], tab_rate, x[aileron], x[aileron_rate])

    return by_source


def _torque_of_source(plant: NonlinearPlant) -> Callable[[int, float, float, float, float], FloatArray]:
    """R (2,) [N m] of a source that is not linear in the angles, at one instant and total angles and rates."""
    cosine = np.cos(plant.angles[:, 0])

    def torque(k: int, tab: float, tab_rate: float, aileron: float, aileron_rate: float) -> FloatArray:
        linear_tab, linear_aileron = tab - plant.angles[k, 0], aileron - plant.angles[k, 1]
        if plant.thesis:
            lever, own, induced = plant.levers[k]
            linear_tab += cosine[k] * lever * aileron_rate + own * tab_rate
            linear_aileron += induced * aileron_rate
            tab, aileron = tab + cos(tab) * lever * aileron_rate + own * tab_rate, aileron + induced * aileron_rate
        found = plant.source.at(plant.alpha[k], np.asarray(tab), np.asarray(aileron)).value
        linear = plant.gradient[k, :, 0] * linear_tab + plant.gradient[k, :, 1] * linear_aileron
        return np.asarray(-plant.load[k] * (found - plant.value[k] - linear))

    return torque
