"""Where within a step a surface comes to rest under friction, meets a stop, or reaches its limit of rate.

A step that ends beyond such a place is gone only so far (a root of the Hermite cubic through both ends of the step);
there the surface is caught, exactly, and the point goes on from there. What is let go is so from the next step on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.simulation.contact import FASTEST, FREE, LOWER, SLOWEST, STUCK, UPPER, Contact
from design.simulation.dynamics import Dynamics
from model.arrays import BoolArray, FloatArray, IntArray

_BISECTIONS = 45
_KINDS = (STUCK, UPPER, LOWER, FASTEST, SLOWEST)


@dataclass(frozen=True, eq=False)
class Place:
    """Where P points are caught first: part of the step (P,), surface (P,) 0 or 1, and mode (P,) by what."""

    part: FloatArray
    surface: IntArray
    kind: IntArray


def crossings(dynamics: Dynamics, end: FloatArray, contact: Contact) -> BoolArray:
    """(5, 2, P) which surface has gone beyond what would hold it, kinds in the order of modes 1 to 5."""
    holders, found = dynamics.holders, np.zeros((len(_KINDS), *contact.mode.shape), dtype=bool)
    for i, (angle, rate) in enumerate(zip(dynamics.angles, dynamics.rates, strict=True)):
        if rate is None:
            continue
        free = contact.mode[i] == FREE
        moving = free | (contact.mode[i] >= FASTEST)
        if holders.static[i, 0] > 0.0:
            found[0, i] = free & (end[rate] * contact.slide[i] < 0.0)
        found[1, i] = moving & (end[angle] > holders.upper[i])
        found[2, i] = moving & (end[angle] < holders.lower[i])
        if np.isfinite(holders.rate[i, 0]):
            found[3, i] = free & (end[rate] > holders.rate[i])
            found[4, i] = free & (end[rate] < -holders.rate[i])
    return found


def first_place(
    dynamics: Dynamics,
    x: FloatArray,
    end: FloatArray,
    slopes: tuple[FloatArray, FloatArray],
    crossed: BoolArray,
    step: FloatArray,
) -> Place:
    """The first place at which each of the points is caught.

    Parameters
    ----------
    x, end : (n, P) states at both ends of the step, slopes their rates
    crossed : (5, 2, P), at least one of each point
    step : (P,) [s]
    """
    points = x.shape[-1]
    part = np.full((len(_KINDS), 2, points), np.inf)
    for kind, i in zip(*np.nonzero(crossed.any(axis=-1)), strict=True):
        level, state = _level(dynamics, int(kind), int(i))
        where = crossed[kind, i]
        ends = x[state] - level, end[state] - level
        root = _root(ends[0], ends[1], slopes[0][state] * step, slopes[1][state] * step)
        part[kind, i, where] = root[where]
    flat = part.reshape(-1, points)
    first = np.argmin(flat, axis=0)
    kind, surface = np.divmod(first, 2)
    return Place(np.take_along_axis(flat, first[None], axis=0)[0], surface, kind + 1)


def catch(dynamics: Dynamics, x: FloatArray, contact: Contact, place: Place) -> FloatArray:
    """States (n, P) with each point's surface caught, in place; so is the contact."""
    crossed = np.zeros((len(_KINDS), 2, x.shape[-1]), dtype=bool)
    crossed[place.kind - 1, place.surface, np.arange(x.shape[-1])] = True
    return put_back(dynamics, x, contact, crossed)


def put_back(dynamics: Dynamics, x: FloatArray, contact: Contact, crossed: BoolArray) -> FloatArray:
    """States (n, P) with all that has `crossed` (5, 2, P) at the place where it is held; in place, as the contact."""
    stopped = crossed[UPPER - 1] | crossed[LOWER - 1]
    if stopped.any():
        _stop(dynamics, x, contact, stopped)
    for kind, i in zip(*np.nonzero(crossed.any(axis=-1)), strict=True):
        level, state = _level(dynamics, int(kind), int(i))
        where = crossed[kind, i]
        x[state, where] = level[where]
        contact.mode[i, where] = kind + 1
        if kind + 1 < FASTEST:
            contact.slide[i, where] = 0.0
    return x


def _stop(dynamics: Dynamics, x: FloatArray, contact: Contact, stopped: BoolArray) -> None:
    """Rates after stops have caught surfaces, and the energy that it costs."""
    rows = [rate if rate is not None else 0 for rate in dynamics.rates]
    before, J = x[rows], dynamics.holders.J
    after = dynamics.holders.impact(before, stopped)
    for i, rate in enumerate(dynamics.rates):
        if rate is not None:
            hit = stopped.any(axis=0) & (stopped[i] | (contact.mode[i] == FREE))
            x[rate] = np.where(hit, after[i], x[rate])
            contact.slide[i] = np.where(hit, np.sign(x[rate]), contact.slide[i])
    energy = [0.5 * np.einsum("ip,ijp,jp->p", d, J, d) for d in (before, x[rows])]
    contact.lost[:] += np.where(stopped.any(axis=0), energy[0] - energy[1], 0.0)


def _level(dynamics: Dynamics, kind: int, i: int) -> tuple[FloatArray, int]:
    """The value (P,) at which a surface is caught, and the state whose it is."""
    holders, rate = dynamics.holders, dynamics.rates[i]
    assert rate is not None
    if kind + 1 in (UPPER, LOWER):
        return (holders.upper if kind + 1 == UPPER else holders.lower)[i], dynamics.angles[i]
    limit = float(holders.rate[i, 0])
    level = {STUCK: 0.0, FASTEST: limit, SLOWEST: -limit}[kind + 1]
    return np.full(dynamics.points, level), rate


def _root(begin: FloatArray, end: FloatArray, slope: FloatArray, last: FloatArray) -> FloatArray:
    """Where (P,) in [0, 1] a Hermite cubic comes to the sign of its end; slopes by the unit interval."""
    low, high = np.zeros_like(begin), np.ones_like(begin)
    sign = np.sign(end)
    for _ in range(_BISECTIONS):
        s = 0.5 * (low + high)
        rest = 1.0 - s
        value = (1.0 + 2.0 * s) * rest**2 * begin + s**2 * (3.0 - 2.0 * s) * end
        value += s * rest * (rest * slope - s * last)
        beyond = value * sign > 0.0
        low, high = np.where(beyond, low, s), np.where(beyond, s, high)
    return high
