"""Actuators: one physical actuator a surface, commanded by deflection, rate or torque (seed 2.6)."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ActuatorLimits:
    """What the actuator can do; None is unlimited. [rad], [rad/s], [N m], [W]."""

    deflection: float | None = None
    rate: float | None = None
    torque: float | None = None
    power: float | None = None


@dataclass(frozen=True)
class Actuator:
    """Bandwidths of the actuator's own loops; None is ideal.

    Attributes
    ----------
    servo_bandwidth : natural frequency w of the deflection servo ``w^2 / (s^2 + 2 z w s + w^2)`` [rad/s]
    servo_damping_ratio : its damping ratio z [-]
    rate_loop_bandwidth : first-order lag of the rate loop [rad/s]
    torque_loop_bandwidth : first-order lag of the torque loop [rad/s]
    delay : transport delay of the command [s]
    """

    servo_bandwidth: float | None = None
    servo_damping_ratio: float | None = None
    rate_loop_bandwidth: float | None = None
    torque_loop_bandwidth: float | None = None
    delay: float = 0.0
    limits: ActuatorLimits = field(default_factory=ActuatorLimits)
