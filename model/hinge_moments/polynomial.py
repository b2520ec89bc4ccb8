"""Polynomials in the angles: the terms of a multidimensional Taylor expansion (seed 2.2.9 and 2.2.10)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import comb

import numpy as np

from model.arrays import FloatArray, IntArray
from model.hinge_moments.expansion import HingeMoments

_NAMES = ("alpha", "dt", "da")


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Two polynomials in the deviations of the angles from a point; angles in the order [alpha, dt, da].

    Attributes
    ----------
    about : (3,) point of expansion [rad]
    powers : (k, 3) exponents of the terms; the first term is the constant
    coefficients : (2, k) rows [C_Ht, C_Ha], [1/rad^n] for a term of order n
    """

    about: FloatArray
    powers: IntArray
    coefficients: FloatArray

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the terms, such as ``alpha dt^2``; the constant is ``1``."""
        return term_names(self.powers)

    def at(self, angles: FloatArray) -> HingeMoments:
        """Coefficients and gradient at angles (m, 3) [rad]."""
        values, slopes = _factors(angles - self.about, self.powers)
        a, t, d = values
        by_alpha, by_tab, by_aileron = slopes[0] * t * d, a * slopes[1] * d, a * t * slopes[2]
        gradient = [self._sum(terms) for terms in (by_alpha, by_tab, by_aileron)]
        return HingeMoments(self._sum(a * t * d), np.stack(gradient, axis=-1))

    def moved_to(self, about: FloatArray) -> Polynomial:
        """The same polynomials written about another point (3,) [rad].

        ``(y + d)^f = sum of C(f, e) d^(f - e) y^e`` for every angle: the terms stay the same where each has all
        lower ones beside it, as `powers_up_to` gives them.
        """
        step = about - self.about
        old, new = self.powers[None, :, :], self.powers[:, None, :]
        share = _pascal(int(self.powers.max(initial=0)))[old, new]
        factors = share * step ** np.maximum(old - new, 0)
        return Polynomial(about, self.powers, self.coefficients @ np.prod(factors, axis=-1).T)

    def _sum(self, terms: FloatArray) -> FloatArray:
        # In C order, or the order of the sum, hence its last bit, would depend on how many points there are.
        return np.asarray(np.sum(np.multiply(terms[:, None, :], self.coefficients, order="C"), axis=-1))


def powers_up_to(order: int, largest: tuple[int, int, int]) -> IntArray:
    """Exponents (k, 3) of total order at most `order`, those of each angle at most `largest`.

    Sorted by total order; the constant is first.
    """
    every = product(*(range(min(order, most) + 1) for most in largest))
    chosen = sorted((e for e in every if sum(e) <= order), key=lambda e: (sum(e), [-i for i in e]))
    return np.array(chosen, dtype=np.int64)


def term_names(powers: IntArray) -> tuple[str, ...]:
    """Names of the terms of these exponents (k, 3)."""
    return tuple(
        " ".join(name if e == 1 else f"{name}^{e}" for name, e in zip(_NAMES, row, strict=True) if e) or "1"
        for row in powers.tolist()
    )


def term_values(deviations: FloatArray, powers: IntArray) -> FloatArray:
    """Terms (m, k) at deviations (m, 3)."""
    (a, t, d), _ = _factors(deviations, powers)
    return a * t * d


def _pascal(highest: int) -> FloatArray:
    """Binomial coefficients ``C(n, k)`` up to n = `highest`; zero above the diagonal."""
    return np.array([[float(comb(n, k)) for k in range(highest + 1)] for n in range(highest + 1)])


def _factors(deviations: FloatArray, powers: IntArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Power of each angle in every term, and its derivative: three arrays (m, k) each."""
    highest = int(powers.max(initial=0))
    table = np.ones((*deviations.shape, highest + 1))
    for power in range(1, highest + 1):
        table[..., power] = table[..., power - 1] * deviations
    slopes = np.zeros_like(table)
    slopes[..., 1:] = np.arange(1, highest + 1) * table[..., :-1]
    return [table[:, j, powers[:, j]] for j in range(3)], [slopes[:, j, powers[:, j]] for j in range(3)]
