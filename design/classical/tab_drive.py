"""How the tab follows what its actuator is commanded (seed 4.1, 4.2): the drive, as one transfer function."""

from __future__ import annotations

from dataclasses import dataclass

from design.classical.controller import TabCommand
from model.actuators import Actuator


@dataclass(frozen=True)
class TabDrive:
    """``dt = numerator / denominator(s) exp(-s delay) u``, u the command of the actuator.

    ========== =============================== =========================
    command    actuator                        dt / u
    ========== =============================== =========================
    deflection servo of second order           w^2 / (s^2 + 2 z w s + w^2)
    deflection servo of first order            w / (s + w)
    deflection ideal                           1
    rate       rate loop with a lag            w / (s (s + w))
    rate       ideal rate loop                 1 / s
    ========== =============================== =========================

    Attributes
    ----------
    command : what u is
    denominator : coefficients from the highest power down, the first 1; SI
    numerator : one number; SI
    delay : transport delay [s]
    """

    command: TabCommand
    denominator: tuple[float, ...]
    numerator: float
    delay: float

    @property
    def order(self) -> int:
        """Number of states, 0 for an ideal deflection."""
        return len(self.denominator) - 1

    @property
    def bandwidth(self) -> float | None:
        """Natural frequency or corner [rad/s] of what the drive adds to an ideal one; None when it is ideal."""
        if self.command == "rate":
            return self.numerator if self.order == 2 else None
        return None if self.order == 0 else float(self.numerator ** (1.0 / self.order))


def tab_drive(actuator: Actuator, command: TabCommand) -> TabDrive:
    """The drive of an actuator that is commanded in this way; a bandwidth of None is ideal.

    Raises
    ------
    ValueError : a damping ratio without a bandwidth
    """
    if command == "rate":
        w = actuator.rate_loop_bandwidth
        denominator, numerator = ((1.0, 0.0), 1.0) if w is None else ((1.0, w, 0.0), w)
        return TabDrive(command, denominator, numerator, actuator.delay)
    w, z = actuator.servo_bandwidth, actuator.servo_damping_ratio
    if w is None and z is not None:
        raise ValueError("a servo with a damping ratio needs a bandwidth")
    if w is None:
        return TabDrive(command, (1.0,), 1.0, actuator.delay)
    if z is None:
        return TabDrive(command, (1.0, w), w, actuator.delay)
    return TabDrive(command, (1.0, 2.0 * z * w, w**2), w**2, actuator.delay)
