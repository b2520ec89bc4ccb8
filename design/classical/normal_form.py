"""Tab-only loops made non-dimensional: one family of polynomials for the whole grid.

Time is counted in 1/omega_n, the square root of the aileron's static stiffness, and each gain is multiplied by what
it works on, so that

- ``kappa_p = K_p |K_ss|``, ``kappa_f = K_f |K_ss|`` (f, the stiffness cancelled), ``kappa_d = K_d |K_ss| omega_n``,
  ``kappa_i = K_i |K_ss| / omega_n``;
- plant ``(b x + 1) / (x^2 + 2 zeta x + 1)``, or with the lags of unsteady damping a cubic over a quartic, 1 at rest;
  servo ``r^2 / (x^2 + 2 z r x + r^2)``, rate filter ``phi x / (x + phi)``.

What is left of the flight point is zeta, b, the lags, and the ratios r and phi. The loop transfer at the actuator is
linear in the gains, ``L = sum_j kappa_j n_j / d``, and so is the closed-loop polynomial ``d + sum_j kappa_j n_j``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.actuators import Actuator
from model.arrays import FloatArray, GridArrays
from model.polynomial_product import times
from model.servo_tab import ServoTab


@dataclass(frozen=True, eq=False)
class NormalForm(GridArrays):
    """Polynomials in x = s / omega_n, coefficients from the highest power down.

    Attributes
    ----------
    denominator : (*G, n + 1) d(x), of the loop transfer at the actuator
    numerators : (*G, J, n + 1) n_j(x), one for each gain in the order of closure; the last is the integrator's
    gain_units : (*G, J) what one kappa is worth as a gain in SI
    frequency : (*G,) omega_n [rad/s]
    servo_ratio : (*G,) r, servo bandwidth over omega_n
    kind : structure of the controller
    """

    denominator: FloatArray
    numerators: FloatArray
    gain_units: FloatArray
    frequency: FloatArray
    servo_ratio: FloatArray
    kind: Literal["negative_feedback", "positive_feedback"]

    @classmethod
    def of(
        cls,
        servo: ServoTab,
        actuator: Actuator,
        kind: Literal["negative_feedback", "positive_feedback"],
        rate_filter: float | None,
    ) -> NormalForm:
        """Normal form of each point; the servo-tab model must be statically stable, the servo second order.

        Raises
        ------
        ValueError : the actuator has no second-order servo
        """
        if actuator.servo_bandwidth is None or actuator.servo_damping_ratio is None:
            raise ValueError("a deflection command needs a servo with a bandwidth and a damping ratio")
        w = np.sqrt(servo.static_stiffness)
        one = np.ones_like(w)
        r = actuator.servo_bandwidth / w
        top, plant = _plant(servo, w)
        lag = np.stack([one, 2.0 * actuator.servo_damping_ratio * r, r**2], axis=-1)
        lead = top * (r**2)[..., None]
        x = np.stack([one, 0.0 * one], axis=-1)
        d = times(x, times(plant, lag))
        if kind == "positive_feedback":
            terms = [-times(lead, x), lead]
            units = [one, w]
        else:
            units = [1.0 / w, one, w]
            if rate_filter is None:
                terms = [times(times(lead, x), x), times(lead, x), lead]
            else:
                phi = rate_filter / w
                f = np.stack([one, phi], axis=-1)
                d = times(d, f)
                terms = [times(times(lead, x), x) * phi[..., None], times(times(lead, x), f), times(lead, f)]
        numerators = np.stack([_padded(t, d.shape[-1]) for t in terms], axis=-2)
        gain_units = np.stack(units, axis=-1) / np.abs(servo.dc_gain)[..., None]
        return cls(d, numerators, gain_units, w, r, kind)

    def gains(self, kappa: FloatArray) -> FloatArray:
        """Gains in SI from the non-dimensional ones (*G, J)."""
        return kappa * self.gain_units


def _plant(servo: ServoTab, frequency: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of the servo-tab model in ``x = s / frequency``, both 1 at rest."""
    top, bottom = servo.numerator, servo.denominator
    powers = frequency[..., None] ** np.arange(bottom.shape[-1] - 1, -1, -1)
    return top * powers[..., 1:] / top[..., -1:], bottom * powers / bottom[..., -1:]


def _padded(p: FloatArray, length: int) -> FloatArray:
    return np.concatenate([np.zeros((*p.shape[:-1], length - p.shape[-1])), p], axis=-1)
