"""Signals that are sums of modes, ``v(t) = Re sum_i r_i exp(s_i t)``, with their derivatives in the gains.

A step response of the loop has the amplitudes ``r = y_i n(s) / (s p'(s))`` at the closed-loop poles s, where n is the
numerator from the reference to the signal over the product of gains y_i. Poles and amplitudes move with the gains, and

    dv/dz_k = sum exp(s t) (r_k + t r s_k),
    d2v/dz_k dz_l = sum exp(s t) (r_kl + t (r_k s_l + r_l s_k + r s_kl) + t^2 r s_k s_l).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.figure import outer
from design.classical.pole_figures import Poles, powers
from model.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class Moment:
    """A signal at E times of K candidates.

    Attributes
    ----------
    value, rate, bend : (E, K) the signal and its first two derivatives in time
    by_gain, rate_by_gain : (E, K, J) derivatives of value and rate in the unknowns, the time held
    curvature : (E, K, J, J) second derivatives of the value
    """

    value: FloatArray
    rate: FloatArray
    bend: FloatArray
    by_gain: FloatArray
    rate_by_gain: FloatArray
    curvature: FloatArray


@dataclass(frozen=True, eq=False)
class ModalSignal:
    """Modes of K candidates; time in units of 1 / omega_n.

    Attributes
    ----------
    poles : s and its derivatives
    r : (K, m) amplitudes
    first, second : (K, m, J), (K, m, J, J) their derivatives in the unknowns
    """

    poles: Poles
    r: ComplexArray
    first: ComplexArray
    second: ComplexArray

    @classmethod
    def of_step(cls, poles: Poles, numerator: FloatArray, gain: FloatArray, gain_rows: FloatArray) -> ModalSignal:
        """Response to a unit step, less its final value.

        Parameters
        ----------
        poles : of the closed loop
        numerator : (K, m + 1) n(s)
        gain, gain_rows : (K,), (K, J) y_i and its derivatives in the unknowns
        """
        s, s1, s2 = poles.s, poles.first, poles.second
        n = (numerator[:, None, :] @ powers(s, numerator.shape[-1], 2).reshape(*numerator.shape, -1))[:, 0]
        n, slope, bend = n.reshape(s.shape[0], 3, -1).swapaxes(0, 1)[..., None]
        # The logarithm of y_i / (s p'), but for its sign.
        down = 1.0 / np.where(poles.slopes[:, :, 0] == 0.0, 1e-300, poles.slopes[:, :, 0])[..., None]
        p2, p3 = poles.slopes[:, :, 1, None], poles.slopes[:, :, 2, None]
        y1 = (gain_rows / gain[:, None])[:, None]
        over = s1 / s[..., None]
        moved = (p2 * s1 + poles.row_slopes[:, :, 0]) * down
        mixed = poles.row_slopes[:, :, 1, :, None] * s1[..., None, :]
        mixed = mixed + mixed.swapaxes(-1, -2) + p3[..., None] * outer(s1) + p2[..., None] * s2
        u1 = y1 - over - moved
        u2 = outer(over) - s2 / s[..., None, None] - outer(y1) + outer(moved) - mixed * down[..., None]
        # Real signals: a pole above the axis stands for the one below it.
        size = (poles.weight * gain[:, None] / s)[..., None] * down
        n1 = slope * s1
        n2 = bend[..., None] * outer(s1) + slope[..., None] * s2
        cross = u1[..., :, None] * n1[..., None, :]
        second = n[..., None] * (outer(u1) + u2) + cross + cross.swapaxes(-1, -2) + n2
        return cls(poles, (size * n)[..., 0], size * (n * u1 + n1), size[..., None] * second)

    def differentiated(self) -> ModalSignal:
        """The signal's rate of change."""
        s, s1, s2 = self.poles.s, self.poles.first, self.poles.second
        r = self.r[..., None]
        mixed = self.first[..., :, None] * s1[..., None, :]
        second = s[..., None, None] * self.second + mixed + mixed.swapaxes(-1, -2) + r[..., None] * s2
        return ModalSignal(self.poles, self.r * s, s[..., None] * self.first + r * s1, second)

    def at(self, t: FloatArray) -> Moment:
        """The signal at times t (E, K)."""
        s, s1, s2 = self.poles.s[..., None], self.poles.first, self.poles.second
        (k, m), j = self.r.shape, s1.shape[-1]
        r = self.r[..., None]
        moving = r * s1
        mixed = self.first[..., :, None] * s1[..., None, :]
        flat = (k, m, j * j)
        columns = [
            r, r * s, r * s * s, self.first, moving, s * self.first + moving, s * moving,
            self.second.reshape(flat), (mixed + mixed.swapaxes(-1, -2) + r[..., None] * s2).reshape(flat),
            (moving[..., :, None] * s1[..., None, :]).reshape(flat),
        ]  # fmt: skip
        modes = np.exp(self.poles.s * t[..., None]).swapaxes(0, 1)
        found = (modes @ np.concatenate(columns, axis=-1)).real.swapaxes(0, 1)
        ends = np.cumsum([3, j, j, j, j, j * j, j * j, j * j])[:-1]
        now, fixed, grown, rate_fixed, rate_grown, c0, c1, c2 = np.split(found, ends, axis=-1)
        time = t[..., None]
        return Moment(
            now[..., 0], now[..., 1], now[..., 2],
            fixed + time * grown,
            rate_fixed + time * rate_grown,
            (c0 + time * (c1 + time * c2)).reshape(*t.shape, j, j),
        )  # fmt: skip

    def samples(self, modes: ComplexArray) -> FloatArray:
        """The signal (K, T) from ``exp(s t)`` (K, m, T)."""
        return np.asarray((self.r[:, None, :] @ modes)[:, 0].real)
