"""One step of Runge and Kutta's method of order four, for P points; with surfaces caught on the way, in pieces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.manoeuvre import Manoeuvre
from design.simulation.catching import catch, crossings, first_place, put_back
from design.simulation.contact import Contact
from design.simulation.delay_line import DelayLine
from design.simulation.dynamics import Dynamics, Stage
from model.arrays import FloatArray, IntArray

#: So often a point can be caught within one step; after that it is put back into its limits at the step's end.
_CATCHES = 6


@dataclass(frozen=True, eq=False)
class Drive:
    """What drives some points from outside: references by time, commands under way.

    Attributes
    ----------
    manoeuvre, knot : references, those from one knot on
    line : commands under way; None without delays
    points : which points of the line these are; None all of them
    """

    manoeuvre: Manoeuvre
    knot: int
    line: DelayLine | None
    points: IntArray | None = None

    def reference(self, time: FloatArray) -> FloatArray:
        """(p, P) or (p, 1) at times (P,) or (1,)."""
        m, k = self.manoeuvre, self.knot
        found = m.values[k][:, None] + m.slopes[k][:, None] * (time - m.times[k])
        return np.asarray(found + m.amplitude[:, None] * np.sin(m.omega * time) if m.omega else found)

    @property
    def steady(self) -> bool:
        """Whether the references rest."""
        return not (np.any(self.manoeuvre.slopes[self.knot]) or np.any(self.manoeuvre.amplitude))

    def take(self, index: IntArray) -> Drive:
        """The drive of some of the points."""
        return replace(self, points=index if self.points is None else self.points[index])


@dataclass(frozen=True, eq=False)
class Step:
    """States (n, P) at the end of a step, and their rates there as the last stage has them."""

    end: FloatArray
    rate: FloatArray


class Stepper:
    """Steps of some points under one drive."""

    def __init__(self, dynamics: Dynamics, drive: Drive) -> None:
        self.dynamics, self.drive = dynamics, drive
        self._resting = dynamics.forced(drive.reference(np.zeros(1))) if drive.steady else None

    def stage(self, time: FloatArray, side: float, step: FloatArray, x: FloatArray, contact: Contact | None) -> Stage:
        """One evaluation at times (P,) or (1,); `side` of a node as in `DelayLine.arriving`."""
        forced = self._resting if self._resting is not None else self.dynamics.forced(self.drive.reference(time))
        line, arriving = self.drive.line, None
        if line is not None:
            n = self.dynamics.n
            u = np.einsum("ijp,jp->ip", self.dynamics.feedback[n:], x) + forced[n:]
            arriving = line.arriving(time, side, float(np.max(step)), u, self.drive.points)
        return self.dynamics.stage(x, forced, arriving, contact)

    def begin(self, time: FloatArray, step: FloatArray, x: FloatArray, contact: Contact | None) -> Stage:
        """The first stage of a step; surfaces that cannot be held any longer are let go."""
        first = self.stage(time, +1.0, step, x, contact)
        if contact is None:
            return first
        for _ in range(2):
            assert first.held is not None
            gone = self.dynamics.holders.let_go(first.held, contact.mode)
            if not gone.any():
                break
            contact.release(gone, first.held)
            first = self.stage(time, +1.0, step, x, contact)
        return first

    def advance(
        self, time: FloatArray, step: FloatArray, x: FloatArray, contact: Contact | None, first: FloatArray,
        catches: int = 0,
    ) -> FloatArray:  # fmt: skip
        """States (n, P) a step (P,) or (1,) later; `contact` is changed in place.

        Parameters
        ----------
        time, step : [s]
        first : (n, P) rates of the first stage
        catches : how often these points have been caught within the step already
        """
        made = self._step(time, step, x, contact, first)
        end = self.dynamics.confine(made.end)
        if contact is None:
            return end
        crossed = crossings(self.dynamics, end, contact)
        if not crossed.any():
            return end
        if catches >= _CATCHES:
            return put_back(self.dynamics, end, contact, crossed)
        index = np.flatnonzero(crossed.any(axis=(0, 1)))
        part, sub = contact.take(index), Stepper(self.dynamics.take(index), self.drive.take(index))
        begin, whole = (np.broadcast_to(t, end.shape[-1])[index] for t in (time, step))
        slopes = first[:, index], made.rate[:, index]
        place = first_place(sub.dynamics, x[:, index], end[:, index], slopes, crossed[..., index], whole)
        to = place.part * whole
        there = sub._step(begin, to, x[:, index], part, first[:, index]).end
        caught = catch(sub.dynamics, there, part, place)
        rest = whole - to
        again = sub.begin(begin + to, rest, caught, part)
        end[:, index] = sub.advance(begin + to, rest, caught, part, again.rate, catches + 1)
        contact.put(index, part)
        return end

    def _step(self, time: FloatArray, step: FloatArray, x: FloatArray, contact: Contact | None, k1: FloatArray) -> Step:
        """A step without regard to what is caught within it."""
        half = 0.5 * step
        k2 = self.stage(time + half, 0.0, step, x + half * k1, contact).rate
        k3 = self.stage(time + half, 0.0, step, x + half * k2, contact).rate
        k4 = self.stage(time + step, -1.0, step, x + step * k3, contact).rate
        k2 += k3
        k2 *= 2.0
        k2 += k1
        k2 += k4
        k2 *= step / 6.0
        k2 += x
        return Step(k2, k4)
