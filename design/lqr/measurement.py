"""What a state feedback measures: every state, or the two angles alone (seed 6.3, 7.3).

Without either of these requests the controller reads all the states, rates included.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RateFilters:
    """Rates from filtered derivatives ``w s / (s + w)`` of the measured angles.

    Attributes
    ----------
    cutoff : w of both filters [rad/s], positive

    Raises
    ------
    ValueError : a cut-off that is not positive and finite
    """

    cutoff: float

    def __post_init__(self) -> None:
        _refuse_unless("cutoff", self.cutoff, positive=True)


@dataclass(frozen=True)
class KalmanMeasurement:
    """States estimated from the two measured angles by a steady Kalman filter.

    The noises are white and independent. Each is given by the root of its intensity W, where
    ``E[w(t) w(s)] = W delta(t - s)``: the root of a spectral density that counts negative frequencies too. One that
    counts positive frequencies only, as data sheets do, is larger by ``sqrt(2)``.

    Attributes
    ----------
    tab_torque_noise, aileron_torque_noise : of the torques on the surfaces beside those of the actuators
        [N m sqrt(s)], at least 0
    tab_angle_noise, aileron_angle_noise : of the errors of the measured angles [rad sqrt(s)], positive
    recovery : factor rho of loop-transfer recovery (Doyle and Stein 1979): the filter is made to believe in noise on
        the commands as well, rho times as strong (in intensity) as that of the torques. As it grows the loops opened
        at the actuators tend to those of the full-state feedback; 0 is the Kalman filter of the noises themselves

    Raises
    ------
    ValueError : a noise or a factor that is not finite, is negative, or is zero where it must be positive
    """

    tab_torque_noise: float
    aileron_torque_noise: float
    tab_angle_noise: float
    aileron_angle_noise: float
    recovery: float = 0.0

    def __post_init__(self) -> None:
        for name in ("tab_torque_noise", "aileron_torque_noise", "recovery"):
            _refuse_unless(name, getattr(self, name), positive=False)
        for name in ("tab_angle_noise", "aileron_angle_noise"):
            _refuse_unless(name, getattr(self, name), positive=True)


Measurement = RateFilters | KalmanMeasurement


def _refuse_unless(name: str, value: float, *, positive: bool) -> None:
    if not (np.isfinite(value) and (value > 0.0 if positive else value >= 0.0)):
        raise ValueError(f"{name}: must be finite and {'positive' if positive else 'at least 0'}, not {value}")
