"""What holds a surface: Coulomb friction at rest, stops of deflection, and the limit of a torque motor's rate.

A surface is free or held. One that is held keeps its rate, zero or the limit, and a torque makes it do so; when that
torque is not one that the holder can give, the surface is let go. So a surface that sticks has a rate of exactly zero,
without chatter, until more than the break-away torque pulls at it. Stops are inelastic.

===== ================================ =====================
mode  held by                          torque it can give
===== ================================ =====================
1     friction, at rest                -static .. static
2 3   the upper, the lower stop        inwards, and static
4 5   the upper, the lower rate limit  against the motion
===== ================================ =====================
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray, IntArray

FREE, STUCK, UPPER, LOWER, FASTEST, SLOWEST = range(6)


@dataclass(frozen=True, eq=False)
class Holders:
    """What can hold the surfaces of P points, order [tab, aileron].

    Attributes
    ----------
    J : (2, 2, P) inertia by which they move together [kg m^2]; diagonal where they do not
    static, kinetic : (2, 1) friction [N m]
    upper, lower : (2, P) stops, deviations from trim [rad]; infinite without
    rate : (2, 1) rate limit [rad/s]; infinite without
    """

    J: FloatArray
    static: FloatArray
    kinetic: FloatArray
    upper: FloatArray
    lower: FloatArray
    rate: FloatArray

    @property
    def any(self) -> bool:
        """Whether anything can hold."""
        limits = np.isfinite(self.upper).any() or np.isfinite(self.rate).any()
        return bool(limits or np.any(self.static > 0.0))

    def take(self, index: IntArray) -> Holders:
        """Those of some points."""
        return Holders(
            self.J[..., index], self.static, self.kinetic, self.upper[:, index], self.lower[:, index], self.rate
        )

    def free_acceleration(self, acceleration: FloatArray, slide: FloatArray) -> FloatArray:
        """Accelerations (2, P) with kinetic friction against the direction of sliding (2, P), -1, 0 or 1."""
        if not np.any(self.kinetic):
            return acceleration
        J, (tab, aileron) = self.J, -self.kinetic * slide
        determinant = J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]
        by_tab, by_aileron = J[1, 1] * tab - J[0, 1] * aileron, J[0, 0] * aileron - J[1, 0] * tab
        return np.asarray(acceleration + np.stack([by_tab, by_aileron]) / determinant)

    def hold(self, acceleration: FloatArray, mode: IntArray) -> Held:
        """Accelerations of which those held are zero, from free ones (2, P), and what holds them."""
        held = mode != FREE
        if not held.any():
            return Held(acceleration, np.zeros_like(acceleration))
        J = self.J
        torque = np.einsum("ijp,jp->ip", J, acceleration)
        alone = torque / np.stack([J[0, 0], J[1, 1]])
        left = np.where(held[::-1], alone, acceleration)
        left[held] = 0.0
        by = np.where(held, np.einsum("ijp,jp->ip", J, left) - torque, 0.0)
        return Held(left, by)

    def let_go(self, by: FloatArray, mode: IntArray) -> BoolArray:
        """(2, P) the surfaces whose holder cannot give the torque by which they are held (2, P)."""
        slack = 1e-12 * np.abs(by)
        most = np.where((mode == LOWER) | (mode == SLOWEST), np.inf, np.where(mode == FASTEST, 0.0, self.static))
        least = np.where((mode == UPPER) | (mode == FASTEST), -np.inf, np.where(mode == SLOWEST, 0.0, -self.static))
        return np.asarray((mode != FREE) & ((by > most + slack) | (by < least - slack)))

    def impact(self, rate: FloatArray, stopped: BoolArray) -> FloatArray:
        """Rates (2, P) after those of `stopped` have been brought to zero by their stops; the other one gives way."""
        after = np.where(stopped, 0.0, rate)
        for i, j in ((0, 1), (1, 0)):
            pulled = stopped[i] & ~stopped[j]
            after[j] += np.where(pulled, self.J[j, i] / self.J[j, j] * rate[i], 0.0)
        return after


@dataclass(frozen=True, eq=False)
class Held:
    """Accelerations (2, P) [rad/s^2] and the torques that hold (2, P) [N m], zero where nothing does."""

    acceleration: FloatArray
    torque: FloatArray


@dataclass(frozen=True, eq=False)
class Contact:
    """Which surfaces are held, changed in place as they are caught and let go.

    Attributes
    ----------
    mode : (2, P) by what each is held
    slide : (2, P) direction in which it slides otherwise, -1, 0 or 1
    lost : (P,) energy that stops have taken so far [J]
    """

    mode: IntArray
    slide: FloatArray
    lost: FloatArray

    @classmethod
    def at_rest(cls, holders: Holders) -> Contact:
        """Surfaces at rest, those with friction held by it."""
        size = holders.upper.shape
        stuck = np.broadcast_to(holders.static > 0.0, size)
        return cls(np.where(stuck, STUCK, FREE).astype(np.int64), np.zeros(size), np.zeros(size[1]))

    def take(self, index: IntArray) -> Contact:
        """Those of some points, as copies."""
        return Contact(self.mode[:, index], self.slide[:, index], self.lost[index])

    def put(self, index: IntArray, part: Contact) -> None:
        """Those of some points as `part` has them."""
        self.mode[:, index], self.slide[:, index], self.lost[index] = part.mode, part.slide, part.lost

    def release(self, gone: BoolArray, by: FloatArray) -> None:
        """Let surfaces go: what had to be held back by a torque slides against that torque."""
        at_rest = gone & (self.mode < FASTEST)
        self.slide[at_rest] = -np.sign(by[at_rest])
        self.mode[gone] = FREE
