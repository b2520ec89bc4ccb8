"""Closed-loop poles of candidates, and their damping, with their derivatives in the gains.

The closed-loop polynomial p is affine in the unknown gains, with rows n_k, so a simple pole s moves by

    ds/dz_k = - n_k / p',    d2s/dz_k dz_l = - (n_k' s_l + n_l' s_k + p'' s_k s_l) / p'.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.classical.figure import Figure, outer
from design.delay.damping import DECAY_PER_DELAY
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: Oscillatory modes whose damping is followed, least damped first.
MODES = 3
#: Two poles are close when half their difference is less than this part of their mean.
CLOSE = 0.3


@dataclass(frozen=True, eq=False)
class Poles:
    """Closed-loop poles of K candidates on and above the real axis, in units of omega_n, and how they move.

    Attributes
    ----------
    s : (K, m) repeated where a candidate has fewer of them than others
    weight : (K, m) how many poles each stands for: 2 above the axis, 1 on it, 0 for one that is repeated
    first, second : (K, m, J), (K, m, J, J) their derivatives in the unknowns
    counts : (K, m) mask of those that count in the damping ratio: with a delay, not those that decay too fast
    slopes : (K, m, 3) first to third derivative of p in s there
    row_slopes : (K, m, 2, J) first and second derivative in s of its rows n_k
    """

    s: ComplexArray
    weight: FloatArray
    first: ComplexArray
    second: ComplexArray
    counts: BoolArray
    slopes: ComplexArray
    row_slopes: ComplexArray

    @classmethod
    def of(cls, characteristic: FloatArray, delay: FloatArray, z: FloatArray) -> Poles:
        """From the rows of the closed-loop polynomial (K, 1 + J, m + 1), the delay (K,) and the unknowns (K, J)."""
        rows = characteristic.copy()
        rows[:, 0] += (z[:, None, :] @ rows[:, 1:])[:, 0]
        s, weight = _upper(companion_roots(rows[:, 0]))
        (k, m), length = s.shape, rows.shape[-1]
        values = (rows @ powers(s, length, 3).reshape(k, length, -1)).reshape(k, -1, 4, m).transpose(0, 3, 2, 1)
        slopes = values[:, :, 1:, 0]
        down = -1.0 / np.where(slopes[..., 0] == 0.0, 1e-300, slopes[..., 0])
        first = values[:, :, 0, 1:] * down[..., None]
        mixed = values[:, :, 1, 1:, None] * first[..., None, :]
        bend = mixed + mixed.swapaxes(-1, -2) + slopes[:, :, 1, None, None] * outer(first)
        counts = -s.real * delay[:, None] < DECAY_PER_DELAY
        return cls(s, weight, first, bend * down[..., None, None], counts, slopes, values[:, :, 1:3, 1:])

    @property
    def decay(self) -> FloatArray:
        """How fast the slowest mode dies out (K,); negative where the loop is unstable."""
        return np.asarray(-np.max(self.s.real, axis=-1))

    @property
    def damping_ratio(self) -> FloatArray:
        """The least of all poles (K,); 1 where all are real."""
        ratio = -self.s.real / np.maximum(np.abs(self.s), 1e-300)
        return np.asarray(np.min(np.where(self.counts, ratio, 1.0), axis=-1))

    @cached_property
    def _ratio(self) -> FloatArray:
        """Damping ratio (K, m) of the poles above the real axis; more than any of the others."""
        above = (self.s.imag > 0.0) & self.counts & (self.weight > 0.0)
        return np.where(above, -self.s.real / np.maximum(np.abs(self.s), 1e-300), 2.0)

    @cached_property
    def least(self) -> IntArray:
        """Places (MODES, K) of the least damped oscillatory modes, the least damped first."""
        return np.argsort(self._ratio, axis=-1)[:, :MODES].T

    @property
    def close(self) -> BoolArray:
        """Mask (K,): the two least damped oscillatory modes are close to each other."""
        row = np.arange(self.s.shape[0])
        one, two = self.s[row, self.least[:2]]
        return np.asarray((self._ratio[row, self.least[1]] < 1.5) & (np.abs(one - two) < CLOSE * np.abs(one + two)))

    def damping(self) -> Figure:
        """Damping ratio of the least damped oscillatory modes."""
        row, least = np.arange(self.s.shape[0]), self.least
        ratio = self._ratio[row, least]
        exists = ratio < 1.5
        s = np.where(exists, self.s[row, least], 1j)
        # log s = log |s| + j theta, and the ratio is -cos theta.
        first = self.first[row, least] / s[..., None]
        turn = first.imag
        second = (self.second[row, least] / s[..., None, None] - outer(first)).imag
        size = np.abs(s)
        sine, cosine = (s.imag / size)[..., None], (s.real / size)[..., None, None]
        return Figure(ratio, sine * turn, sine[..., None] * second + cosine * outer(turn), exists)


def _upper(s: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Those of the poles (K, m) that are not below the real axis, at least `MODES`, and how many each stands for."""
    upper = s.imag >= 0.0
    count = upper.sum(axis=-1)
    first = np.argsort(~upper, axis=-1, kind="stable")[:, : max(count.max(), MODES)]
    there = np.arange(first.shape[1]) < count[:, None]
    row = np.arange(s.shape[0])[:, None]
    s = s[row, np.where(there, first, first[:, :1])]
    return s, np.where(there, np.where(s.imag > 0.0, 2.0, 1.0), 0.0)


def powers(s: ComplexArray, length: int, derivatives: int) -> ComplexArray:
    """Powers ``s^(length-1) .. s, 1`` of s (K, m), and their derivatives: (K, length, 1 + derivatives, m)."""
    found = np.zeros((s.shape[0], length, 1 + derivatives, s.shape[1]), dtype=complex)
    found[:, -1, 0] = 1.0
    found[:, :-1, 0] = s[:, None, :]
    found[:, :, 0] = np.multiply.accumulate(found[:, ::-1, 0], axis=1)[:, ::-1]
    degree = np.arange(length - 1.0, 0.0, -1.0)[:, None]
    for k in range(derivatives):
        found[:, :-1, k + 1] = degree * found[:, 1:, k]
    return found


def companion_roots(polynomial: FloatArray) -> ComplexArray:
    """Roots of polynomials (K, m + 1) with leading coefficient not zero, as eigenvalues of companions."""
    m = polynomial.shape[-1] - 1
    companion = np.zeros((*polynomial.shape[:-1], m, m))
    companion[..., 0, :] = -polynomial[..., 1:] / polynomial[..., :1]
    companion[..., np.arange(1, m), np.arange(m - 1)] = 1.0
    return np.asarray(np.linalg.eigvals(companion), dtype=complex)
