"""Both surfaces driven by torques: limits of torque and power, and of the rate as of a motor that a governor holds."""

from __future__ import annotations

import numpy as np

from design.simulation.contact import UPPER, Contact, Holders
from design.simulation.dynamics import Dynamics, Flown, friction_torques, last, limit_or_infinite, stops
from design.simulation.request import SURFACES
from model.arrays import FloatArray


class TorqueDynamics(Dynamics):
    """The loop of concurrent actuation.

    A torque is the smaller of what is commanded and what the actuator can give: its limit, and its power over the rate
    of its surface. A torque loop with a lag is given no more than that to follow, so that it does not wind up.
    The limit of a rate is hard: whatever torque it takes keeps a surface at it until something pulls it back. To the
    integrals what a stop or that limit takes from a torque is a torque that the actuator cannot give.
    """

    def __init__(self, flown: Flown) -> None:
        super().__init__(flown)
        at, request, model = self.at, flown.request, flown.plant.model
        if request.freeplay is not None:
            raise ValueError(
                "freeplay is simulated between a tab and an actuator whose deflection or rate is commanded"
            )
        self.angles, self.rates = (at["dt"], at["da"]), (at["dt_rate"], at["da_rate"])
        self._rate_rows = slice(at["dt_rate"], at["da_rate"] + 1, at["da_rate"] - at["dt_rate"])
        self.mobility = last(np.asarray(np.linalg.inv(model.inertia)))
        upper, lower = stops(flown)
        rate = np.array([[limit_or_infinite(request, name, "rate")] for name in SURFACES])
        self.holders = Holders(last(model.inertia), *friction_torques(request, SURFACES), upper, lower, rate)
        self.trim_torque = np.ascontiguousarray(model.input_offset.T)
        self.torque_limit = np.array([[limit_or_infinite(request, name, "torque")] for name in SURFACES])
        self.power_limit = np.array([[limit_or_infinite(request, name, "power")] for name in SURFACES])
        self._limited = bool(np.isfinite([self.torque_limit, self.power_limit]).any())
        self._powered = bool(np.isfinite(self.power_limit).any())
        self._lagged = [i for i, name in enumerate(SURFACES) if f"{name}_torque" in at]
        self._torque_states = [at[f"{SURFACES[i]}_torque"] for i in self._lagged]
        integral = np.zeros((self.points, self.n, self.m))
        integral[:, self.integrals] = flown.anti_windup
        self._mixed = last(np.concatenate([flown.loop.B, integral], axis=-1))
        self._commands = last(flown.loop.B)

    def capacity(self, speed: FloatArray) -> FloatArray:
        """The largest torques [N m] that the actuators give at rates (..., 2, P) without sign [rad/s]."""
        if not self._powered:
            return self.torque_limit
        return np.asarray(np.minimum(self.torque_limit, self.power_limit / np.maximum(speed, 1e-300)))

    def applied(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Torques (M, 2, P) [N m] on the surfaces, totals, at states (M, n, P) and arriving commands (M, 2, P)."""
        asked = v + self.trim_torque
        for i, state in zip(self._lagged, self._torque_states, strict=True):
            asked[:, i] = x[:, state] + self.trim_torque[i]
        most = self.capacity(np.abs(x[:, self._rate_rows]))
        return np.asarray(np.minimum(np.maximum(asked, -most), most))

    def actuate(self, x: FloatArray, rate: FloatArray, v: FloatArray, contact: Contact | None) -> FloatArray | None:
        """Torques as the limits leave them; see `Dynamics.actuate`."""
        extra = None
        if self._limited:
            most = self.capacity(np.abs(x[self._rate_rows]))
            given = np.minimum(np.maximum(v, -most - self.trim_torque), most - self.trim_torque)
            if self.winds_up:
                rate += np.einsum("ijp,jp->ip", self._mixed, np.concatenate([given, given - v]))
            else:
                rate += np.einsum("ijp,jp->ip", self._commands, given)
            if self._powered and self._lagged:
                extra = np.zeros((2, self.points))
                held = x[self._torque_states] + self.trim_torque[self._lagged]
                bound = np.broadcast_to(most, extra.shape)[self._lagged]
                extra[self._lagged] = np.clip(held, -bound, bound) - held
        else:
            rate += np.einsum("ijp,jp->ip", self._commands, v)
        if not self.air.is_zero:
            beyond = self.beyond_linear(x, x[self.at["dt_rate"]])
            extra = beyond if extra is None else extra + beyond
        if extra is not None:
            rate[self._rate_rows] += np.einsum("ijp,jp->ip", self.mobility, extra)
        if contact is None:
            return None
        free = self.holders.free_acceleration(rate[self._rate_rows], contact.slide)
        found = self.holders.hold(free, contact.mode)
        rate[self._rate_rows] = found.acceleration
        if self.winds_up:
            stopped = np.where(contact.mode >= UPPER, found.torque, 0.0)
            rate[self.integrals] += np.einsum("ijp,jp->ip", self.back_calculation, stopped)
        return found.torque
