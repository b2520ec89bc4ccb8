"""The right-hand side of P points at once: the loop that is flown, with the surfaces' accelerations and the limits.

Arrays have the points last, so that every operation runs along them. A point's numbers do not depend on its company.
The loop's states stand in its own order; `at` knows the surfaces among them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from design.loop import Loop
from design.simulation.anti_windup import integral_states
from design.simulation.contact import Contact, Holders
from design.simulation.plant import AirResidual, NonlinearPlant
from design.simulation.request import SURFACES, SimulationRequest
from model.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Stage:
    """What one evaluation finds: rates (n, P), commands u and arriving v (m, P), what holds the surfaces (2, P)."""

    rate: FloatArray
    u: FloatArray
    v: FloatArray
    held: FloatArray | None


@dataclass(frozen=True, eq=False)
class Flown:
    """P points that are simulated together: plant and loop (P, ...), anti-windup gain (P, i, m), the request."""

    plant: NonlinearPlant
    loop: Loop
    anti_windup: FloatArray
    request: SimulationRequest

    def take(self, index: IntArray) -> Flown:
        """Some of the points."""
        return Flown(self.plant.take(index), self.loop.take(index), self.anti_windup[index], self.request)


class Dynamics(ABC):
    """``x' = A x + B v' + E r + J^-1 (R(x) + friction) + L (v' - v)``, v' what the actuators make of the command v.

    Attributes
    ----------
    n, m : numbers of states and inputs
    holders : friction, stops and limits of rate that hold a surface
    angles, rates : of the states, those of the surfaces that are held, order [tab, aileron]; None where the tab has
        no state for its rate
    """

    angles: tuple[int, int]
    rates: tuple[int | None, int]
    holders: Holders

    def __init__(self, flown: Flown) -> None:
        loop = flown.loop
        self.flown = flown
        self.n, self.m = loop.B.shape[-2:]
        self.points = loop.A.shape[0]
        self.at = {name: i for i, name in enumerate(loop.states)}
        self.air = AirResidual(flown.plant)
        self.surfaces = [self.at[name] for name in ("dt", "da")]
        self._trim_angles = np.ascontiguousarray(flown.plant.angles.T)
        self.integrals = [self.at[name] for name in integral_states(loop)]
        # [x'; u] = feedback x + forward r, but for what the command does through B.
        self.feedback = last(np.concatenate([loop.A, -loop.K], axis=-2))
        self.forward = last(np.concatenate([loop.E, loop.N], axis=-2))
        self.back_calculation = last(flown.anti_windup)
        self.winds_up = bool(np.any(flown.anti_windup != 0.0))

    def forced(self, reference: FloatArray) -> FloatArray:
        """What references (p, 1) or (p, P) drive, (n + m, P)."""
        return np.asarray(np.einsum("ijp,jp->ip", self.forward, np.broadcast_to(reference, self.forward.shape[1:])))

    def stage(
        self, x: FloatArray, forced: FloatArray, arriving: FloatArray | None = None, contact: Contact | None = None
    ) -> Stage:
        """One evaluation.

        Parameters
        ----------
        x : (n, P) states
        forced : (n + m, P), of `forced`
        arriving : (m, P) commands that come out of their delays now; None without delays
        contact : which surfaces are held; None where nothing can hold
        """
        y = np.einsum("ijp,jp->ip", self.feedback, x)
        y += forced
        rate, u = y[: self.n], y[self.n :]
        v = u if arriving is None else arriving
        return Stage(rate, u, v, self.actuate(x, rate, v, contact))

    def take(self, index: IntArray) -> Dynamics:
        """The right-hand side of some of the points."""
        return type(self)(self.flown.take(index))

    def confine(self, x: FloatArray) -> FloatArray:
        """States (n, P) with angles that have no rate of their own within their stops; in place."""
        return x

    @abstractmethod
    def actuate(self, x: FloatArray, rate: FloatArray, v: FloatArray, contact: Contact | None) -> FloatArray | None:
        """Add to ``A x + E r`` (n, P), in place, what commands (m, P), air and holders do; what holds (2, P)."""

    def beyond_linear(self, x: FloatArray, tab_rate: FloatArray) -> FloatArray:
        """R (2, P) at states (n, P)."""
        at = self.at
        return self.air.torque(x[at["dt"]], tab_rate, x[at["da"]], x[at["da_rate"]])

    def largest_angle(self, x: FloatArray) -> float:
        """Largest magnitude of any surface's angle [rad]; 0 without points."""
        return float(np.abs(self.total_angles(x)).max(initial=0.0))

    def total_angles(self, x: FloatArray) -> FloatArray:
        """(2, P) [rad], order [tab, aileron]."""
        return np.asarray(x[self.surfaces] + self._trim_angles)


def last(matrix: FloatArray) -> FloatArray:
    """(P, ...) with the points last."""
    return np.ascontiguousarray(np.moveaxis(matrix, 0, -1))


def limit_or_infinite(request: SimulationRequest, surface: str, what: str) -> float:
    """A limit, infinite where there is none."""
    found = request.limit(surface, what)
    return np.inf if found is None else found


def friction_torques(request: SimulationRequest, surfaces: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Static and kinetic friction (2, 1) [N m] of those surfaces among both, zero of the others."""
    static, kinetic = np.zeros((2, 1)), np.zeros((2, 1))
    for i, name in enumerate(SURFACES):
        if name in surfaces and name in request.friction:
            static[i], kinetic[i] = request.friction[name].static, request.friction[name].kinetic
    return static, kinetic


def stops(flown: Flown) -> tuple[FloatArray, FloatArray]:
    """Upper and lower stops (2, P) [rad from trim]; infinite without.

    A trim at or beyond a stop rests on it.
    """
    limits = np.array([limit_or_infinite(flown.request, name, "deflection") for name in SURFACES])[:, None]
    trim = flown.plant.angles.T
    return np.maximum(limits - trim, 0.0), np.minimum(-limits - trim, 0.0)
