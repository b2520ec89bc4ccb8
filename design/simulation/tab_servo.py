"""The tab moved by a servo, the aileron following: limits inside the servo, the tab's torque by inverse dynamics.

Inside the servo of second order a position loop commands a rate loop, and the limits stand where they are in the real
one. Within them it is the servo of the linear loop exactly::

    v --> [stops] --> (v - dt) a_0/a_1 --> [rate limit] --> a_1 (rate - dt') --> [torque limit] --> dt'' --> [stops]

A rate loop begins at the limit of its rate, and a servo of first order, or an ideal rate, ends there: without an
acceleration of its own nothing in it can be held to a torque, and `unenforced` says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.simulation.contact import Contact, Holders
from design.simulation.dynamics import Dynamics, Flown, friction_torques, last, limit_or_infinite, stops
from design.simulation.freeplay import ACTUATOR, link_torque, trim_stretch
from model.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Servo:
    """The drive as the loop has it: ``dt'' = -a_1 dt' - a_0 dt + b v``, or ``dt' = -a_0 dt + b v`` of first order.

    Attributes
    ----------
    angle, rate : states of its angle and rate; no rate where it is of first order
    a_0, a_1, b : its numbers, the same at every point
    """

    angle: int
    rate: int | None
    a_0: float
    a_1: float
    b: float

    @property
    def commands_rate(self) -> bool:
        """Whether v is a rate."""
        return self.a_0 == 0.0

    @classmethod
    def of(cls, flown: Flown) -> Servo:
        """Read off the loop.

        Raises
        ------
        ValueError : a limited rate of a servo without damping
        """
        loop, linked = flown.loop, flown.request.freeplay is not None
        angle, rate = (ACTUATOR[name] if linked else name for name in ("dt", "dt_rate"))
        first = loop.states.index(angle)
        if rate not in loop.states:
            if not len(loop.A):
                return cls(first, None, np.nan, 0.0, np.nan)
            return cls(first, None, -float(loop.A[0, first, first]), 0.0, float(loop.B[0, first, 0]))
        second = loop.states.index(rate)
        row = loop.A[0, second] if len(loop.A) else np.full(len(loop.states), np.nan)
        b = float(loop.B[0, second, 0]) if len(loop.A) else np.nan
        servo = cls(first, second, -float(row[first]), -float(row[second]), b)
        if servo.a_1 <= 0.0 and flown.request.limit("tab", "rate") is not None:
            raise ValueError("the rate of a servo without damping has no loop that could limit it")
        return servo


class TabDynamics(Dynamics):
    """The loop of a tab-only controller.

    Attributes
    ----------
    servo : the drive
    unenforced : limits that its drive cannot be held to, and those of an aileron that has no actuator, but its stops
    own_friction : of the tab in motion, which its actuator overcomes [N m]
    """

    rates: tuple[int | None, int]

    def __init__(self, flown: Flown) -> None:
        super().__init__(flown)
        request, model = flown.request, flown.plant.model
        self.servo, self._link = Servo.of(flown), request.freeplay
        if self._link is not None and "tab" in request.friction:
            raise ValueError("with freeplay the friction of the tab is not simulated: its hinge and drive are two")
        self.angles, self.rates = (self.servo.angle, self.at["da"]), (self.servo.rate, self.at["da_rate"])
        self.inertia = last(model.inertia)
        self._air_row = last(model.air_torque[:, 0, :])
        self._by_tab_rate = last(_by_tab_rate(flown))
        self._model_states = [self.at.get(name, -1) for name in model.states]
        self.trim_torque = np.ascontiguousarray(model.input_offset.T)
        self._torque, self._power, self._speed = (
            limit_or_infinite(request, "tab", what) for what in ("torque", "power", "rate")
        )
        limits_torque = bool(np.isfinite(min(self._torque, self._power)))
        self._holds_torque = limits_torque and self.servo.rate is not None and self._link is None
        self.unenforced: tuple[str, ...] = ()
        if limits_torque and not self._holds_torque:
            self.unenforced = tuple(f"tab {what}" for what in ("torque", "power") if request.limit("tab", what))
        self.unenforced += tuple(
            f"aileron {what}" for what in ("rate", "torque", "power") if request.limit("aileron", what)
        )
        self.upper, self.lower = stops(flown)
        within = np.isinf(self._speed) and not np.isfinite(self.upper[0]).any()
        self._unlimited = bool(within and not self._holds_torque)
        static, kinetic = friction_torques(request, ("aileron",))
        self.own_friction = float(friction_torques(request, ("tab",))[1][0, 0])
        J = self.inertia.copy()
        J[0, 1] = J[1, 0] = 0.0  # of the servo-tab model: neither's acceleration moves the other
        upper, lower = self.upper.copy(), self.lower.copy()
        if self.servo.rate is None:
            upper[0], lower[0] = np.inf, -np.inf
        self.holders = Holders(J, static, kinetic, upper, lower, np.full((2, 1), np.inf))
        self._stretch = None if self._link is None else trim_stretch(self._link, self.trim_torque[0])
        self._b = last(flown.loop.B)[:, 0]

    def actuate(self, x: FloatArray, rate: FloatArray, v: FloatArray, contact: Contact | None) -> FloatArray | None:
        """The servo's motion as its limits leave it, and the aileron's; see `Dynamics.actuate`."""
        servo, at = self.servo, self.at
        command = v[0]
        rate += self._b * command
        if servo.rate is None:
            linear = rate[servo.angle].copy()
            rate[servo.angle] = moved = self._first_order(x, command)
            if self._link is None:
                rate += self._by_tab_rate * (moved - linear)
            elif self._link.damping:
                rate[at["dt_rate"]] += self._link.damping / self.inertia[0, 0] * (moved - linear)
        tab_rate = self.tab_rate(x, rate)
        if not self.air.is_zero or self._link is not None:
            self._free_surfaces(x, rate, tab_rate)
        mode, slide = (None, None) if contact is None else (contact.mode, contact.slide)
        by = None
        if contact is not None and mode is not None and slide is not None:
            alone = np.zeros((2, self.points))
            alone[1] = rate[at["da_rate"]]
            found = self.holders.hold(self.holders.free_acceleration(alone, slide), mode)
            rate[at["da_rate"]], by = found.acceleration[1], found.torque
        if servo.rate is None:
            if self.winds_up:
                rate[self.integrals] += self.back_calculation[:, 0] * ((moved - linear) / servo.b)
            return by
        linear = rate[servo.rate].copy()
        moved = linear if self._unlimited else self._second_order(x, rate, command)
        if mode is not None and by is not None:
            held = mode[0] != 0
            by[0] = np.where(held, -self.inertia[0, 0] * moved, 0.0)
            moved = np.where(held, 0.0, moved)
        rate[servo.rate] = moved
        if self.winds_up:
            rate[self.integrals] += self.back_calculation[:, 0] * ((moved - linear) / servo.b)
        return by

    def confine(self, x: FloatArray) -> FloatArray:
        """A drive without a rate of its own within its stops; see `Dynamics.confine`."""
        if self.servo.rate is None:
            np.clip(x[self.servo.angle], self.lower[0], self.upper[0], out=x[self.servo.angle])
        return x

    def tab_rate(self, x: FloatArray, rate: FloatArray) -> FloatArray:
        """Rate of the tab itself (P,) [rad/s] at states and their rates (n, P)."""
        return np.asarray(x[self.at["dt_rate"]] if "dt_rate" in self.at else rate[self.at["dt"]])

    def required_torque(self, x: FloatArray, tab_rate: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Torque of the tab's actuator (..., P) [N m], total: inverse dynamics (`model.motion.required_torque`).

        Parameters
        ----------
        x : (n, ..., P) states
        tab_rate : (..., P) of the tab
        acceleration : (2, ..., P) of tab and aileron
        """
        inertial = self.inertia[0, 0] * acceleration[0] + self.inertia[0, 1] * acceleration[1]
        friction = self.own_friction * np.sign(tab_rate)
        return np.asarray(self.trim_torque[0] + inertial - self.air_on_tab(x, tab_rate) + friction)

    def air_on_tab(self, x: FloatArray, tab_rate: FloatArray) -> FloatArray:
        """Torque of the air on the tab less that at trim (..., P) [N m]."""
        linear = sum(
            self._air_row[i] * (tab_rate if i == 1 else x[state]) for i, state in enumerate(self._model_states)
        )
        return np.asarray(linear + self.beyond_linear(x, tab_rate)[0])

    @property
    def linked(self) -> bool:
        """Whether the tab hangs on a link."""
        return self._link is not None

    @property
    def trim_stretch(self) -> FloatArray:
        """Actuator's angle less the tab's at trim (P,) [rad], of a tab on a link."""
        assert self._stretch is not None
        return self._stretch

    def link_torque(self, x: FloatArray, actuator_rate: FloatArray) -> FloatArray:
        """Torque (..., P) [N m] that the link bears in total, where there is one."""
        assert self._link is not None
        assert self._stretch is not None
        stretch = self._stretch + x[self.servo.angle] - x[self.at["dt"]]
        return link_torque(self._link, stretch, actuator_rate - x[self.at["dt_rate"]])

    def _first_order(self, x: FloatArray, command: FloatArray) -> FloatArray:
        """Rate (P,) of a drive that has no state for it."""
        servo, angle = self.servo, x[self.servo.angle]
        if not servo.commands_rate:
            command = self._within_stops(command)
        moved = np.clip(servo.b * command - servo.a_0 * angle, -self._speed, self._speed)
        outward = self._outward(angle, moved)
        return np.where(outward, 0.0, moved)

    def _second_order(self, x: FloatArray, rate: FloatArray, command: FloatArray) -> FloatArray:
        """Acceleration (P,) of a drive that has a rate; `rate` has the linear one."""
        servo = self.servo
        angle, speed = x[servo.angle], x[servo.angle if servo.rate is None else servo.rate]
        if servo.commands_rate:
            moved = servo.a_1 * (np.clip(command * (servo.b / servo.a_1), -self._speed, self._speed) - speed)
        elif servo.a_1 > 0.0:
            wanted = (servo.b * self._within_stops(command) - servo.a_0 * angle) / servo.a_1
            moved = servo.a_1 * (np.clip(wanted, -self._speed, self._speed) - speed)
        else:
            moved = servo.b * self._within_stops(command) - servo.a_0 * angle
        if not self._holds_torque:
            return np.asarray(moved)
        most = np.minimum(self._torque, self._power / np.maximum(np.abs(speed), 1e-300))
        J = self.inertia
        at_rest = self.required_torque(x, speed, np.stack([np.zeros_like(speed), rate[self.at["da_rate"]]]))
        return np.asarray(np.minimum(np.maximum(moved, (-most - at_rest) / J[0, 0]), (most - at_rest) / J[0, 0]))

    def _free_surfaces(self, x: FloatArray, rate: FloatArray, tab_rate: FloatArray) -> None:
        """Add what the air does beyond its linear part, and the slack of a link, to the accelerations (n, P)."""
        beyond, at, J = self.beyond_linear(x, tab_rate), self.at, self.inertia
        rate[at["da_rate"]] += beyond[1] / J[1, 1]
        if self._link is None:
            return
        linear_stretch = x[self.servo.angle] - x[at["dt"]]
        actuator_rate = rate[self.servo.angle]
        linear = self._link.stiffness * linear_stretch + self._link.damping * (actuator_rate - x[at["dt_rate"]])
        slack = self.link_torque(x, actuator_rate) - self.trim_torque[0] - linear
        rate[at["dt_rate"]] += (slack + beyond[0] - J[0, 1] / J[1, 1] * beyond[1]) / J[0, 0]

    def _within_stops(self, command: FloatArray) -> FloatArray:
        """A commanded deflection no farther than the stops."""
        gain = self.servo.b / self.servo.a_0
        return np.asarray(np.clip(command * gain, self.lower[0], self.upper[0]) / gain)

    def _outward(self, angle: FloatArray, moved: FloatArray) -> BoolArray:
        return np.asarray(((angle >= self.upper[0]) & (moved > 0.0)) | ((angle <= self.lower[0]) & (moved < 0.0)))


def _by_tab_rate(flown: Flown) -> FloatArray:
    """Rates of the states (P, n) by the rate of the tab: what the air makes of it, on the aileron and its lags."""
    loop, model = flown.loop, flown.plant.model
    by = np.zeros(loop.A.shape[:-1])
    by[:, loop.states.index("da_rate")] = model.air_torque[:, 1, 1] / model.inertia[:, 1, 1]
    for row, name in enumerate(model.states[4:], start=4):
        by[:, loop.states.index(name)] = model.A[:, row, 1]
    return by
