"""Integrals of squared gains over frequency for loops with delays, by adaptive quadrature.

By Parseval's theorem ``int_0^inf y(t)^2 dt = 1/pi int_0^inf |H(jw)|^2 dw`` for an impulse response y. Where |H| falls
like ``h / w`` that converges slowly; ``h^2 / (w^2 + s^2)``, whose part is ``h^2 / (2 s)``, is taken off first.
"""

from __future__ import annotations

import numpy as np

from design.disturbance.closed_system import StablePoints
from design.disturbance.delayed_grid import delayed_grid
from design.disturbance.lyapunov import Variances
from design.disturbance.open_parts import OpenParts
from model.arrays import BoolArray, FloatArray, IntArray

#: The integral is refined, and taken further, until what that changes is below this part of it.
ACCURACY = 1e-8
#: Two rules differ by less than this part of the integral on a panel that is not halved; the better one is far better.
_AGREEMENT = 1e-8
#: A panel begins at every fourth frequency of the grid; above the grid an octave has four to begin with.
_EVERY, _AN_OCTAVE = 4, 4
#: How often a panel is halved, and how many octaves are added above the grid, at most.
_HALVINGS, _OCTAVES = 40, 12
#: Panels of one point that are halved at once, at most: beyond, rounding is all that is left of some transfer.
_MOST_PANELS = 2000
#: Panels that are worked on at once, so that memory does not grow with the grid.
_AT_ONCE = 2048
#: Gauss-Kronrod rule of 15 points on [-1, 1] (QUADPACK's qk15): nodes >= 0, their weights, those of Gauss among them.
_NODES = [
    0.0, 0.20778495500789847, 0.40584515137739717, 0.58608723546769113, 0.74153118559939444,
    0.86486442335976907, 0.94910791234275852, 0.99145537112081264,
]  # fmt: skip
_KRONROD = [
    0.20948214108472783, 0.20443294007529889, 0.19035057806478541, 0.16900472663926790, 0.14065325971552592,
    0.10479001032225018, 0.063092092629978553, 0.022935322010529225,
]  # fmt: skip
_GAUSS = [0.41795918367346939, 0.0, 0.38183005050511894, 0.0, 0.27970539148927667, 0.0, 0.12948496616886969, 0.0]


def _whole(values: list[float], sign: float) -> FloatArray:
    """(15,) of nodes (odd, `sign` -1) or weights (even, +1) from those at nodes >= 0."""
    half = np.array(values[1:])
    return np.concatenate([sign * half[::-1], values[:1], half])


_POINTS, _RULES = _whole(_NODES, -1.0), np.stack([_whole(_KRONROD, 1.0), _whole(_GAUSS, 1.0)])


def delayed_variances(points: StablePoints, parts: OpenParts) -> Variances:
    """``int_0^inf y^2 dt`` of the impulse responses y of stable systems (N, ...) with delays.

    Returns
    -------
    Variances (N, o, p), zero where the output takes the input at once or is not reached by it. The error is what the
    last octave of frequency has changed, inf where the integral does not come to an end
    """
    integrand = _Integrand(points, parts, ~parts.direct & points.linked)
    grid = delayed_grid(points, parts)
    edges = np.concatenate([grid[:, :-1:_EVERY], grid[:, -1:]], axis=-1)
    row = np.repeat(np.arange(len(edges)), edges.shape[-1] - 1)
    panels = integrand.integral(row, edges[:, :-1].reshape(-1), edges[:, 1:].reshape(-1), None)
    total = panels + integrand.taken_off
    error, top = np.full(total.shape, np.inf), edges[:, -1]
    active = np.arange(len(total))
    before = np.full(total.shape, np.inf)
    for _ in range(_OCTAVES):
        row = np.repeat(active, _AN_OCTAVE)
        place = np.tile(np.arange(_AN_OCTAVE), active.size) / _AN_OCTAVE
        octave = integrand.integral(row, top[row] * (1.0 + place), top[row] * (1.0 + place + 1.0 / _AN_OCTAVE), total)
        total[active] += octave[active]
        # What is left falls by more than half from octave to octave, so that it is less than the last one.
        size = np.abs(octave[active])
        error[active] = np.maximum(size, 0.25 * before[active]) + _AGREEMENT * ACCURACY * np.abs(total[active])
        before[active] = size
        top = 2.0 * top
        active = active[np.any(error[active] > ACCURACY * np.abs(total[active]), axis=(-2, -1))]
        if not active.size:
            break
    return Variances(total, np.where(error <= ACCURACY * np.abs(total), error, np.inf))


class _Integrand:
    """``(|H|^2 - h^2 / (w^2 + s^2)) / pi`` of the pairs that are wanted (N, o, p), zero for the others."""

    def __init__(self, points: StablePoints, parts: OpenParts, wanted: BoolArray) -> None:
        self.points, self.wanted = points, wanted
        # H ~ C B / jw + C A B / (jw)^2 + C A^2 B / (jw)^3, with the delays turned anyhow.
        far = parts.at_infinity()
        first, second, third = far.C @ far.B, far.C @ far.A @ far.B, far.C @ far.A @ far.A @ far.B
        square = np.mean(np.abs(first) ** 2, axis=1)
        fourth = np.mean(np.abs(second) ** 2 - 2.0 * (first * third.conj()).real, axis=1)
        slowest = np.nanmin(np.abs(points.poles), axis=-1)[:, None, None]
        self.square = np.where(wanted, square, 0.0)
        self.scale = np.sqrt(np.maximum(-fourth / np.where(square > 0.0, square, np.inf), slowest**2))
        self.taken_off = 0.5 * self.square / self.scale

    def integral(self, row: IntArray, low: FloatArray, high: FloatArray, total: FloatArray | None) -> FloatArray:
        """Integrals (N, o, p) over the panels (K,) from low to high [rad/s] of the rows.

        Panels are halved until the rules agree, in parts of `total`; without it, of what the panels give by themselves.
        """
        result = np.zeros(self.wanted.shape)
        for _ in range(_HALVINGS):
            kronrod, gauss = self._panels(row, low, high)
            if total is None:
                total = self.taken_off + result
                np.add.at(total, row, kronrod)
            rough = np.any(np.abs(kronrod - gauss) > _AGREEMENT * np.abs(total[row]), axis=(-2, -1))
            np.add.at(result, row[~rough], kronrod[~rough])
            if not rough.any():
                return result
            crowded = np.bincount(row[rough], minlength=len(result)) > _MOST_PANELS
            rough &= ~crowded[row]
            result[crowded] = np.inf
            row, low, high = row[rough], low[rough], high[rough]
            middle = 0.5 * (low + high)
            row, low, high = np.tile(row, 2), np.concatenate([low, middle]), np.concatenate([middle, high])
        result[np.unique(row)] = np.inf
        return result

    def _panels(self, row: IntArray, low: FloatArray, high: FloatArray) -> FloatArray:
        """Both rules (2, K, o, p) on panels (K,)."""
        found = np.empty((2, row.size, *self.wanted.shape[1:]))
        for first in range(0, row.size, _AT_ONCE):
            block = slice(first, first + _AT_ONCE)
            rows = row[block]
            half = 0.5 * (high[block] - low[block])
            omega = (low[block] + half)[:, None] + half[:, None] * _POINTS
            value = self.points.take(rows).response(omega)
            value = np.where(self.wanted[rows, None], value, 0.0)
            bell = self.square[rows, None] / (omega[..., None, None] ** 2 + self.scale[rows, None] ** 2)
            height = (value.real**2 + value.imag**2 - bell) * (half / np.pi)[:, None, None, None]
            found[:, block] = np.einsum("rw,kwop->rkop", _RULES, height)
        return found
