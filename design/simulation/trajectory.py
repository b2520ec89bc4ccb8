"""The states of P points over time, step by step; a point that diverges is left where it was, the others go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.manoeuvre import Manoeuvre
from design.simulation.contact import Contact
from design.simulation.delay_line import DelayLine
from design.simulation.dynamics import Dynamics, Flown
from design.simulation.stepping import Drive, Stepper
from design.simulation.tab_servo import TabDynamics
from design.simulation.time_grid import Segment
from design.simulation.torque_drives import TorqueDynamics
from model.arrays import BoolArray, FloatArray, IntArray

#: A surface beyond a right angle has diverged [rad]: no model of its air reaches so far.
LARGEST_ANGLE = np.pi / 2.0


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What a simulation leaves behind, at M nodes; where a segment ends and the next one begins there are two.

    Attributes
    ----------
    time : (M,) [s]
    segment : (M,) number of the segment of each node
    states, rates : (M, n, P); after a point has diverged those that it had then
    commands : (M, m, P) as they arrive at the actuators, before any limit
    holding : (M, 2, P) torques by which surfaces are held [N m]
    mode, slide : (M, 2, P) by what, and the direction in which they slide otherwise (`contact`)
    stop_loss : (M, P) energy that stops have taken so far [J]
    diverged_at : (P,) time at which a point had diverged [s]; nan where it has not
    sampled : (T,) nodes that are samples, later ones of two at one time
    """

    time: FloatArray
    segment: IntArray
    states: FloatArray
    rates: FloatArray
    commands: FloatArray
    holding: FloatArray
    mode: IntArray
    slide: FloatArray
    stop_loss: FloatArray
    diverged_at: FloatArray
    sampled: IntArray


def dynamics_of(flown: Flown) -> Dynamics:
    """The right-hand side of a loop: of both torques, or of a tab that is moved by its servo.

    Raises
    ------
    ValueError : a loop of other inputs
    """
    if flown.loop.inputs == ("tab", "aileron"):
        return TorqueDynamics(flown)
    if flown.loop.inputs == ("tab",):
        return TabDynamics(flown)
    raise ValueError(f"no simulation of a loop with the inputs {', '.join(flown.loop.inputs)}")


def trajectory(dynamics: Dynamics, manoeuvre: Manoeuvre, segments: tuple[Segment, ...], substeps: int) -> Trajectory:
    """Follow points from trim through the segments of a manoeuvre, with the same steps for all of them."""
    times = [segment.times(substeps) for segment in segments]
    nodes, points = sum(len(t) for t in times), dynamics.points
    made = _empty(times, dynamics, substeps)
    late = any(dynamics.flown.loop.delay)
    line = DelayLine(dynamics.flown.loop.delay, nodes, points) if late else None
    contact = Contact.at_rest(dynamics.holders) if dynamics.holders.any else None
    x, alive = np.zeros((dynamics.n, points)), np.ones(points, dtype=bool)
    node = 0
    with np.errstate(over="ignore", invalid="ignore"):
        for segment, t in zip(segments, times, strict=True):
            stepper = Stepper(dynamics, Drive(manoeuvre, segment.knot, line))
            step = np.array([(segment.end - segment.begin) / (len(t) - 1)])
            for k in range(len(t)):
                now, ends = t[k : k + 1], k == len(t) - 1
                first = stepper.stage(now, -1.0, step, x, contact) if ends else stepper.begin(now, step, x, contact)
                made.states[node], made.rates[node], made.commands[node] = x, first.rate, first.v
                if contact is not None and first.held is not None:
                    made.holding[node], made.mode[node], made.slide[node] = first.held, contact.mode, contact.slide
                    made.stop_loss[node] = contact.lost
                if line is not None:
                    line.push(float(t[k]), first.u, _command_rates(dynamics, manoeuvre, segment.knot, now, first.rate))
                node += 1
                if not ends:
                    last, x = x, stepper.advance(now, step, x, contact, first.rate)
                    x = _stopped(dynamics, last, x, alive, made.diverged_at, float(t[k + 1]))
    return made


def _empty(times: list[FloatArray], dynamics: Dynamics, substeps: int) -> Trajectory:
    nodes, points = sum(len(t) for t in times), dynamics.points
    starts = np.concatenate([[0], np.cumsum([len(t) for t in times])])[:-1]
    sampled = [start + np.arange(0, len(t) - 1, substeps) for start, t in zip(starts, times, strict=True)]
    return Trajectory(
        time=np.concatenate(times),
        segment=np.repeat(np.arange(len(times)), [len(t) for t in times]),
        states=np.empty((nodes, dynamics.n, points)),
        rates=np.empty((nodes, dynamics.n, points)),
        commands=np.empty((nodes, dynamics.m, points)),
        holding=np.zeros((nodes, 2, points)),
        mode=np.zeros((nodes, 2, points), dtype=np.int64),
        slide=np.zeros((nodes, 2, points)),
        stop_loss=np.zeros((nodes, points)),
        diverged_at=np.full(points, np.nan),
        sampled=np.concatenate([*sampled, [nodes - 1]]).astype(np.int64),
    )


def _command_rates(
    dynamics: Dynamics, manoeuvre: Manoeuvre, knot: int, time: FloatArray, rates: FloatArray
) -> FloatArray:
    """Rates (m, P) of the commands, from those of the states (n, P) and of the references."""
    swing = manoeuvre.omega * manoeuvre.amplitude * np.cos(manoeuvre.omega * time)
    n, slope = dynamics.n, (manoeuvre.slopes[knot] + swing)[:, None]
    return np.asarray(np.einsum("ijp,jp->ip", dynamics.feedback[n:], rates) + dynamics.forced(slope)[n:])


def _stopped(
    dynamics: Dynamics, before: FloatArray, after: FloatArray, alive: BoolArray, when: FloatArray, time: float
) -> FloatArray:
    """States (n, P) after a step, of points that have diverged those before it; marks them, in place."""
    # A number that is not finite makes the sum so, and no comparison with nan holds.
    if dynamics.largest_angle(after) <= LARGEST_ANGLE and np.isfinite(after.sum()) and alive.all():
        return after
    within = np.isfinite(after).all(axis=0) & (np.abs(dynamics.total_angles(after)) <= LARGEST_ANGLE).all(axis=0)
    when[alive & ~within] = time
    alive &= within
    return np.where(alive, after, before)
