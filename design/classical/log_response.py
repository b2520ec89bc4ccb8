"""Logarithms of frequency responses, with their derivatives in the frequency and in the gains.

Whatever margins, peaks and bandwidths are read off is a product of powers of factors that are affine in the unknown
gains z: the loop transfer ``q / d``, the sensitivity ``d / p``, the tracking ``t / p``. The logarithm of each factor
``A = row_0 + sum_k z_k row_k`` has

    d log A / dz_k = row_k / A,    d2 log A / dz_k dz_l = - (row_k / A) (row_l / A),

so that the first and second derivatives of a product are sums over its factors.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np

from design.classical.open_gains import OpenGains
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray


@dataclass(frozen=True, eq=False)
class Factors(GridArrays):
    """Factors of the responses of P points: rows of polynomials, those of the second kind times ``exp(-j x delay)``.

    Attributes
    ----------
    prompt, late : (P, M, 1 + J, n + 1)
    delay : (P,) in units of 1 / omega_n
    names : of the factors
    """

    prompt: FloatArray
    late: FloatArray
    delay: FloatArray
    names: tuple[str, ...]

    @classmethod
    def of(cls, family: OpenGains, names: tuple[str, ...]) -> Factors:
        """Factors of each point, of

        - ``d``, ``q``: denominator and numerator of the loop transfer, ``p = d + q``, ``m = d - q``
        - ``t = y_i n``: of the tracking ``r_a -> da = t / p``, without its delay
        - ``c``: of ``da noise -> dt_cmd = c / p``, of a rate command ``c g / (k p)``, where ``k`` is kappa_theta and
          ``g = D + k N`` the denominator of the inner loop, with ``D`` and ``N`` of the drive
        """
        form, (points, rows, length) = family.form, family.loop.shape
        prompt, late = np.zeros((2, points, len(names), rows, length))
        for m, name in enumerate(names):
            if name in ("d", "p", "m"):
                prompt[:, m, 0] = form.denominator
            if name in ("q", "p", "m"):
                late[:, m] = -family.loop if name == "m" else family.loop
            if name == "t":
                prompt[:, m] = family.products[:, :, -1:] * form.numerators[:, -1:]
            if name == "n":
                prompt[:, m, 0] = form.numerators[:, -1]
            if name == "c":
                prompt[:, m] = family.noise
            if name == "k":
                prompt[:, m, :, -1] = family.products[:, :, 0]
            if name in ("D", "g"):
                prompt[:, m, 0, -3:] = form.drive[:, :3]
            if name == "N":
                late[:, m, 0, -1] = form.drive[:, 3]
            if name == "g":
                late[:, m, :, -1] = family.products[:, :, 0] * form.drive[:, 3:]
        if form.without_delay:
            prompt += late
        return cls(prompt, late, form.delay, names)

    def at(self, x: FloatArray, derivatives: int) -> ComplexArray:
        """Every row at frequencies x (P, E), and its derivatives in x: (P, M, 1 + J, 1 + derivatives, E)."""
        points, factors, rows, length = self.prompt.shape
        powers = np.ones((points, length, 1 + derivatives, x.shape[1]), dtype=complex)
        powers[:, :-1, 0] = 1j * x[:, None, :]
        powers[:, :, 0] = np.multiply.accumulate(powers[:, ::-1, 0], axis=1)[:, ::-1]
        degree = 1j * np.arange(length - 1.0, 0.0, -1.0)[:, None]
        for k in range(derivatives):
            powers[:, :-1, k + 1] = degree * powers[:, 1:, k]
            powers[:, -1, k + 1] = 0.0
        value: Any = self.prompt.reshape(points, -1, length) @ powers.reshape(points, length, -1)
        if np.any(self.delay):
            late = _delayed(powers, x, self.delay)
            value = value + self.late.reshape(points, -1, length) @ late.reshape(points, length, -1)
        return np.asarray(value.reshape(points, factors, rows, 1 + derivatives, -1))


@dataclass(frozen=True, eq=False)
class LogResponse:
    """``F = log(A / B)`` of two factors at E frequencies of K candidates, and its derivatives.

    Attributes
    ----------
    value, dx, dxx : (E, K)
    dz, dxz : (E, K, J)
    dzz : (E, K, J, J)
    """

    value: ComplexArray
    dx: ComplexArray
    dxx: ComplexArray
    dz: ComplexArray
    dxz: ComplexArray
    dzz: ComplexArray

    def times(self, other: LogResponse) -> LogResponse:
        """Logarithm of the product of the two responses."""
        return LogResponse(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


def log_response(factors: Factors, ratios: tuple[tuple[str, str], ...], x: FloatArray, z: FloatArray) -> LogResponse:
    """Logarithm of a ratio of two factors, of its own at each of the frequencies.

    Parameters
    ----------
    factors : of K points
    ratios : (E,) names of the two factors
    x : (K, E) frequencies
    z : (K, J) unknowns
    """
    rows = factors.at(x, 2)
    pick = _places(factors.names, ratios)
    rows = rows[:, pick, :, :, np.arange(x.shape[1])]  # (2, E, K, 1 + J, 3)
    value = rows[..., 0, :] + (z[:, None, :] @ rows[..., 1:, :])[..., 0, :]
    inverse = 1.0 / value[..., 0]
    along, bend = value[..., 1] * inverse, value[..., 2] * inverse
    by = rows[..., 1:, :2] * inverse[..., None, None]
    dz, mixed = by[..., 0], by[..., 1] - by[..., 0] * along[..., None]
    bend -= along * along
    outer = dz[..., :, None] * dz[..., None, :]
    return LogResponse(
        np.log(value[0, ..., 0] * inverse[1]),
        along[0] - along[1], bend[0] - bend[1], dz[0] - dz[1], mixed[0] - mixed[1], outer[1] - outer[0],
    )  # fmt: skip


@cache
def _places(names: tuple[str, ...], ratios: tuple[tuple[str, str], ...]) -> IntArray:
    """(2, E) which factors the ratios are of."""
    return np.array([[names.index(name) for name in pair] for pair in ratios]).T


def _delayed(powers: ComplexArray, x: FloatArray, delay: FloatArray) -> ComplexArray:
    """Powers and their derivatives in x (P, n + 1, 1 to 3, E), all of ``exp(-j x delay)`` times the powers."""
    turn = np.exp(-1j * x * delay[:, None])[:, None]
    rate = -1j * delay[:, None, None]
    late = powers.copy()
    if powers.shape[2] > 1:
        late[:, :, 1] += rate * powers[:, :, 0]
    if powers.shape[2] > 2:
        late[:, :, 2] += rate * (2.0 * powers[:, :, 1] + rate * powers[:, :, 0])
    return np.asarray(late * turn[:, :, None])
