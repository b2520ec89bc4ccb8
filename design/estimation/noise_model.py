"""White noise that a Kalman filter reckons with: torques on the surfaces, errors of the measured angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import Floats


@dataclass(frozen=True, eq=False)
class StateNoise:
    """White noise on the rate of one state of the plant.

    Attributes
    ----------
    state : its name
    intensity : [unit of the state squared per second], a number or (*G,)
    """

    state: str
    intensity: Floats


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Intensities W of white noises, ``E[w(t) w(s)] = W delta(t - s)``, independent of each other.

    A density that counts positive frequencies only, as data sheets do, is 2 W. Errors of independent samples of
    standard deviation e, one every T seconds, act on what is slower than the sampling like an intensity ``e^2 T``.
    Each is a number or (*G,).

    Attributes
    ----------
    tab_torque, aileron_torque : of the torques on the surfaces beside those of the actuators [(N m)^2 s], at least 0
    tab_angle, aileron_angle : of the errors of the measured angles [rad^2 s], positive
    states : further noise on the rates of states of the plant
    recovery : factor rho of loop-transfer recovery (Doyle and Stein 1979). The filter is made to believe in noise on
        the commands as well, rho times as strong as the torques' own. As rho grows, the loops opened at the actuators
        tend to those of the full-state feedback, and sensor noise in the commands grows. 0: a Kalman filter
    """

    tab_torque: Floats
    aileron_torque: Floats
    tab_angle: Floats
    aileron_angle: Floats
    states: tuple[StateNoise, ...] = ()
    recovery: Floats = 0.0

    def __post_init__(self) -> None:
        for name in ("tab_torque", "aileron_torque", "recovery"):
            _refuse_unless(name, getattr(self, name), positive=False)
        for name in ("tab_angle", "aileron_angle"):
            _refuse_unless(name, getattr(self, name), positive=True)
        for noise in self.states:
            _refuse_unless(noise.state, noise.intensity, positive=False)

    @property
    def torques(self) -> tuple[Floats, Floats]:
        """Intensities of the torques, order [tab, aileron]."""
        return self.tab_torque, self.aileron_torque

    @property
    def angles(self) -> tuple[Floats, Floats]:
        """Intensities of the errors of the angles, order [tab, aileron]."""
        return self.tab_angle, self.aileron_angle


def _refuse_unless(name: str, intensity: Floats, *, positive: bool) -> None:
    values = np.asarray(intensity, dtype=float)
    if not np.all(np.isfinite(values) & ((values > 0.0) if positive else (values >= 0.0))):
        wanted = "positive" if positive else "at least 0"
        raise ValueError(f"{name}: an intensity must be finite and {wanted}, is {intensity}")
