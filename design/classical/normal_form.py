"""Tab-only loops made non-dimensional: one family of polynomials for the whole grid.

Time is counted in 1/omega_n, the square root of the aileron's static stiffness, and each gain is multiplied by what
it works on, so that

- ``kappa_p = K_p |K_ss|``, ``kappa_f = K_f |K_ss|`` (f, the stiffness cancelled), ``kappa_d = K_d |K_ss| omega_n``,
  ``kappa_i = K_i |K_ss| / omega_n``, and of the inner tab loop ``kappa_theta = K_theta / omega_n``;
- plant ``b / a``, 1 at rest: ``(b x + 1) / (x^2 + 2 zeta x + 1)``, or with the lags of unsteady damping a cubic over a
  quartic; tab drive ``N / D``: ``r^2 / (x^2 + 2 z r x + r^2)``, ``r / (x + r)`` or 1, and of a rate command
  ``r / (x (x + r))`` or ``1 / x``; rate filter ``phi x / (x + phi)``; transport delay ``exp(-x delay)``.

The margins are taken at the actuator's command. There the loop transfer is linear in the `products` y of the gains,

    L = sum_j y_j n_j / d exp(-x delay),

with ``y = kappa`` where the tab is commanded by deflection. A rate command has its inner loop inside,
``L = kappa_theta N/D (1 + P C)``, and ``y = (kappa_theta, kappa_theta kappa_d, kappa_theta kappa_p, ...)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_drive import TabDrive
from model.arrays import FloatArray, GridArrays
from model.polynomial_product import times
from model.servo_tab import ServoTab

#: Numerator of the Pade approximant of ``exp(-x)`` of order five, highest power first; its denominator is that of -x.
#: At ``|x| = 3`` it is wrong by 2e-5.
_PADE = np.array([-1.0 / 30240.0, 1.0 / 1008.0, -1.0 / 72.0, 1.0 / 9.0, -0.5, 1.0])


@dataclass(frozen=True, eq=False)
class NormalForm(GridArrays):
    """Polynomials in x = s / omega_n, coefficients from the highest power down, all of one length n + 1.

    Attributes
    ----------
    denominator : (*G, n + 1) d(x), of the loop transfer at the actuator
    numerators : (*G, Y, n + 1) n_j(x), one for each product in the order of closure. The last is the integrator's, and
        of ``r_a -> da = y_i n_i exp(-x delay) / p``, where ``p = d + sum_j y_j n_j exp(-x delay)``
    tab : (*G, n + 1) of ``r_a -> dt = sigma / |K_ss| y_i tab exp(-x delay) / p``
    noise : (*G, Y, n + 1) of ``da noise -> dt_cmd``: ``sum_j y_j noise_j / (|K_ss| p)``, and of a rate command that
        times ``D / kappa_theta + N exp(-x delay)``
    noise_top : (*G, Y) what that tends to at high frequency, over each kappa and times |K_ss|
    drive : (*G, 4) coefficients of D(x), padded in front, and N as the last
    delay : (*G,) transport delay times omega_n
    gain_units : (*G, Y) what one kappa is worth as a gain in SI
    frequency : (*G,) omega_n [rad/s]
    dc_gain : (*G,) K_ss
    lag : (*G,) how long the drive and its delay lag behind what is commanded, times omega_n; of a rate command the
        lag of its rate loop
    drag : (*G,) twice the damping ratio of the aileron, the coefficient of x in a
    order : number of states of the drive
    rate_command, positive : structure of the controller
    """

    denominator: FloatArray
    numerators: FloatArray
    tab: FloatArray
    noise: FloatArray
    noise_top: FloatArray
    drive: FloatArray
    delay: FloatArray
    gain_units: FloatArray
    frequency: FloatArray
    dc_gain: FloatArray
    lag: FloatArray
    drag: FloatArray
    order: int
    rate_command: bool
    positive: bool

    @classmethod
    def of(cls, servo: ServoTab, drive: TabDrive, controller: ClassicalController) -> NormalForm:
        """Normal form of each point; the servo-tab model must be statically stable."""
        w = np.sqrt(servo.static_stiffness)
        one, none = np.ones_like(w), np.zeros_like(w)
        b, a = _plant(servo, w)
        D, N = _drive(drive, w)
        x = np.stack([one, none], axis=-1)
        rate, positive = drive.command == "rate", controller.kind == "positive_feedback"
        phi = None if not controller.filtered_rate else np.asarray(controller.rate_filter) / w
        f = one[..., None] if phi is None else np.stack([one, phi], axis=-1)
        # C = c(x) / (x f), law by law: what each gain feeds back, and what of it is noise of the measured angle.
        if positive:
            laws, heard, units = [-x, one[..., None]], [0, 1], [one, w]
            noise_top = [one, none]
        else:
            derivative = times(x, x) if phi is None else times(x, x) * phi[..., None]
            laws, units = [derivative, times(x, f), f], [1.0 / w, one, w]
            heard = [1, 2] if phi is None else [0, 1, 2]
            noise_top = [none if phi is None else phi, one, none]
        d = times(x, times(a, times(D, f)))
        lead = b * N[..., None]
        numerators = [times(lead, c) for c in laws]
        noise = [times(a if rate else times(a, D), c) if j in heard else none[..., None] for j, c in enumerate(laws)]
        gain_units = np.stack(units, axis=-1) / np.abs(servo.dc_gain)[..., None]
        if rate:
            numerators.insert(0, times(times(x, a), f) * N[..., None])
            noise.insert(0, none[..., None])
            noise_top.insert(0, none)
            gain_units = np.concatenate([w[..., None], gain_units], axis=-1)
        length = d.shape[-1]
        delay = drive.delay * w
        lag = delay if drive.bandwidth is None else delay + (1.0 if rate else D[..., -2]) / N
        return cls(
            denominator=d,
            numerators=np.stack([_padded(p, length) for p in numerators], axis=-2),
            tab=_padded(times(a, f) * N[..., None], length),
            noise=np.stack([_padded(p, length) for p in noise], axis=-2),
            noise_top=np.stack(noise_top, axis=-1),
            drive=np.concatenate([_padded(D, 3), N[..., None]], axis=-1),
            delay=delay,
            gain_units=gain_units,
            frequency=w,
            dc_gain=servo.dc_gain,
            lag=lag,
            drag=a[..., -2],
            order=drive.order,
            rate_command=rate,
            positive=positive,
        )

    @property
    def without_delay(self) -> bool:
        """Whether no point has a transport delay."""
        return not np.any(self.delay)

    def kappas(self, products: FloatArray) -> FloatArray:
        """Non-dimensional gains (*G, Y) from their products."""
        if not self.rate_command:
            return products
        return np.concatenate([products[..., :1], products[..., 1:] / products[..., :1]], axis=-1)

    def gains(self, kappa: FloatArray) -> FloatArray:
        """Gains in SI from the non-dimensional ones (*G, Y)."""
        return kappa * self.gain_units

    def late(self, p: FloatArray) -> FloatArray:
        """Polynomials (*G, ..., m) times the numerator of the delay's Pade approximant; as they are without delay."""
        return p if self.without_delay else self._times_pade(p, 1.0)

    def prompt(self, p: FloatArray) -> FloatArray:
        """Polynomials (*G, ..., m) times the denominator of the delay's Pade approximant; as they are without delay."""
        return p if self.without_delay else self._times_pade(p, -1.0)

    def _times_pade(self, p: FloatArray, sign: float) -> FloatArray:
        powers = (sign * self.delay)[..., None] ** np.arange(_PADE.size - 1, -1, -1)
        factor = _PADE * powers
        return times(p, factor.reshape(*self.delay.shape, *(1,) * (p.ndim - 1 - self.delay.ndim), -1))


def _plant(servo: ServoTab, frequency: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of the servo-tab model in ``x = s / frequency``, both 1 at rest."""
    top, bottom = servo.numerator, servo.denominator
    powers = frequency[..., None] ** np.arange(bottom.shape[-1] - 1, -1, -1)
    return top * powers[..., 1:] / top[..., -1:], bottom * powers / bottom[..., -1:]


def _drive(drive: TabDrive, frequency: FloatArray) -> tuple[FloatArray, FloatArray]:
    """D (*G, order + 1) and N (*G,) in ``x = s / frequency``; of a rate command in the unit that kappa_theta has."""
    powers = np.arange(drive.order + 1)
    D = np.array(drive.denominator) / frequency[..., None] ** powers
    return D, drive.numerator / frequency ** (drive.order - (drive.command == "rate"))


def _padded(p: FloatArray, length: int) -> FloatArray:
    return np.concatenate([np.zeros((*p.shape[:-1], length - p.shape[-1])), p], axis=-1)
