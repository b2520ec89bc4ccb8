"""What is sought the peak of: gains of ``i I + k T`` over frequency, squared, with their derivatives.

``S - T = I - 2 T`` and ``S = I - T``, so T is all there is to know. A gain h, squared, is the larger root of
``h^2 - F h + P``; see `design.robustness.diagonal`. Its derivatives follow from differentiating that equation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.robustness.diagonal import square, sum_and_gap
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: Scalings d that cover a structured singular value are kept within these.
BALANCES = (1e-6, 1e6)


@dataclass(frozen=True, eq=False)
class Gains(GridArrays):
    """Gains of ``identity I + factor T``, one per row.

    Attributes
    ----------
    identity : (R,)
    factor : (R, 2, 2), entry by entry
    structured : (R,) True: structured singular value, False: largest singular value
    """

    identity: FloatArray
    factor: FloatArray
    structured: BoolArray

    def matrix(self, T: ComplexArray) -> ComplexArray:
        """``identity I + factor T``, of the shape of T (R, 2, 2) or (R, W, 2, 2)."""
        between = (1,) * (T.ndim - 3)
        M = np.asarray(self.factor.reshape(-1, *between, 2, 2) * T)
        M.reshape(*M.shape[:-2], 4)[..., ::3] += self.identity.reshape(-1, *between, 1)
        return M

    def of(self, T: ComplexArray) -> FloatArray:
        """Squared gains (R,) of T (R, 2, 2), or (R, W) of (R, W, 2, 2)."""
        total, gap = sum_and_gap(self.matrix(T), self.structured.reshape(-1, *(1,) * (T.ndim - 3)))
        return np.asarray(0.25 * (total + gap) ** 2)

    def covered(self, T: ComplexArray) -> Gains:
        """Largest singular values that are nowhere less than these gains, and no more where T is as given, (R, 2, 2).

        They are those of ``diag(d, 1) M diag(1/d, 1)`` with the d that is best there.
        """
        size = np.abs(T) + np.finfo(float).tiny
        with np.errstate(over="ignore"):
            d = np.where(self.structured, np.clip(np.sqrt(size[:, 1, 0] / size[:, 0, 1]), *BALANCES), 1.0)
        factor = self.factor.copy()
        factor[:, 0, 1] *= d
        factor[:, 1, 0] /= d
        return Gains(self.identity, factor, np.zeros_like(self.structured))

    def step_to_peak(
        self, T: ComplexArray, slope: ComplexArray, curvature: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Squared gain h (R,), its slope dh/dw, and the step in w to the next extremum of 1/h.

        Of the reciprocal, because that is a parabola about a resonance: ``h ~ 1 / ((w - w0)^2 + s^2)``. Where the two
        singular values are the same there is no slope, and it is nan.
        """
        M = np.stack([self.matrix(T), self.factor * slope, self.factor * curvature])
        entries = _squared(M)
        products = _product(M[..., 0, :], M[..., 1, ::-1])
        cross = np.where(self.structured, 2.0 * _magnitude(products[..., 1]), entries[..., 0, 1] + entries[..., 1, 0])
        F, dF, ddF = entries[..., 0, 0] + entries[..., 1, 1] + cross
        P, dP, ddP = _squared(products[..., 0] - products[..., 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            gap = np.sqrt(np.maximum(F * F - 4.0 * P, 0.0))
            h = 0.5 * (F + gap)
            first = (dF * h - dP) / gap
            second = (ddF * h + 2.0 * (dF - first) * first - ddP) / gap
            return h, first, first * h / (2.0 * first**2 - second * h)


#: Gains of a point, in this order: mu of S - T, of S and of T; largest singular value of S and of T.
BALANCED, SENSITIVITY, COMPLEMENTARY, SIGMA_S, SIGMA_T = range(5)
EVERY = Gains(
    np.array([1.0, 1.0, 0.0, 1.0, 0.0]),
    np.array([-2.0, -1.0, 1.0, -1.0, 1.0])[:, None, None] * np.ones((2, 2)),
    np.array([True, True, True, False, False]),
)


def every_gain(points: int) -> tuple[Gains, IntArray]:
    """The five gains of each of N points, row after row of a point (5 N,), and the point of each row."""
    return EVERY.take(np.tile(np.arange(5), points)), np.repeat(np.arange(points), 5)


def _product(p: ComplexArray, q: ComplexArray) -> ComplexArray:
    """Product and its two derivatives (3, ...) of two factors with theirs."""
    return np.stack([p[0] * q[0], p[1] * q[0] + p[0] * q[1], p[2] * q[0] + 2.0 * p[1] * q[1] + p[0] * q[2]])


def _squared(z: ComplexArray) -> FloatArray:
    """``|z|^2`` and its two derivatives (3, ...)."""
    value, slope = square(z[:2])
    first, second = (np.conj(z[0]) * z[1:]).real
    return np.stack([value, 2.0 * first, 2.0 * (slope + second)])


def _magnitude(z: ComplexArray) -> FloatArray:
    """``|z|`` and its two derivatives (3, ...); these are 0 where z is 0."""
    value, first, second = _squared(z)
    size = np.sqrt(value)
    divisor = np.where(size > 0.0, size, np.inf)
    slope = 0.5 * first / divisor
    return np.stack([size, slope, (0.5 * second - slope**2) / divisor])
