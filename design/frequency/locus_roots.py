"""Roots of ``(1 - t) prod(s - a_j) + t prod(s - b_j)`` for many t, from guesses, with proof that they are all.

Simultaneous iteration (Weierstrass 1891, Durand, Kerner): each root moves by the value of the polynomial over the
product of its distances to the others. The discs about the roots whose radii are n such steps hold all zeros of
the polynomial, and where no two discs touch each holds one (Smith 1970). So two roots that land on the same zero,
which a check of each alone would let pass, are found out: they are at no distance from each other.

Of n roots the first R are worked on; those after them are the conjugates of the first n - R.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: Iterations for all roots, more where these did not settle, and more again; each doubles the number of digits.
ITERATIONS = (2, 1, 2)
#: Largest last step in parts of the root and of the distance to the nearest one; the error left is smaller by as much
#: again.
SETTLED = 1e-6
#: Roots below this part of the largest are settled in parts of that.
SMALL = 1e-6


def settled_roots(
    guess: ComplexArray, a: ComplexArray, b: ComplexArray, t: FloatArray, half: IntArray
) -> tuple[ComplexArray, BoolArray]:
    """All roots (n, S) from the guesses (R, S) of the first R, and which columns (S,) are sure.

    Parameters
    ----------
    guess : its conjugates are exact, real ones too
    a, b : (n, S), closed under conjugation
    t : (S,)
    half : (2 R - n, S) the half planes of those that are not the conjugates of the last ones: 0 for real ones,
        -1 below the axis and 1 above it for two in neighbouring places that are conjugates
    """
    s, sure = _iterated(guess, a, b, t, half, ITERATIONS[0])
    for more in ITERATIONS[1:]:
        rest = np.flatnonzero(~sure)
        if rest.size:
            there = s[: len(guess), rest], a[:, rest], b[:, rest], t[rest], half[:, rest]
            s[:, rest], sure[rest] = _iterated(*there, more)
    return s, sure


def _iterated(
    guess: ComplexArray, a: ComplexArray, b: ComplexArray, t: FloatArray, half: IntArray, iterations: int
) -> tuple[ComplexArray, BoolArray]:
    R, above = len(guess), len(a) - len(guess)
    s = np.concatenate([guess, guess[:above].conj()])
    first, middle, others = s[:R], s[above:R], other_places(len(s))[:R]
    lower, column = np.nonzero(half < 0)
    # Complex, since numpy multiplies two complex arrays in less time than a complex and a real one.
    to_a, to_b = (1.0 - t).astype(complex), t.astype(complex)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(iterations):
            apart = s[others]
            np.subtract(first[:, None], apart, out=apart)
            step = product(first, a)
            step *= to_a
            end = product(first, b)
            end *= to_b
            step += end
            step /= apart.prod(axis=1)
            first -= step
            # Exactly symmetric, so that the discs are: no pair of conjugates can have turned into two real roots.
            upper = middle[lower + 1, column]
            middle.imag = 0.0
            middle[lower, column], middle[lower + 1, column] = upper.conj(), upper
            s[R:] = s[:above].conj()
        size = _squared(first)
        small = np.minimum(np.maximum(size, SMALL**2 * size.max(axis=0)), _squared(apart).min(axis=1, initial=np.inf))
        sure = np.all(_squared(step) <= SETTLED**2 * small, axis=0)
    return s, np.asarray(sure)


def product(s: ComplexArray, zeros: ComplexArray) -> ComplexArray:
    """``prod_j (s - zeros_j)``, (R, S) from s (R, S) and zeros (n, S)."""
    result: ComplexArray = s - zeros[0]
    factor = np.empty_like(result)
    for zero in zeros[1:]:
        np.subtract(s, zero, out=factor)
        np.multiply(result, factor, out=result)
    return result


@cache
def other_places(n: int) -> IntArray:
    """Places of the n - 1 others of each of n, (n, n-1), read-only."""
    place = np.arange(n - 1)
    result: IntArray = place + (place >= np.arange(n)[:, None])
    result.flags.writeable = False
    return result


def _squared(s: ComplexArray) -> FloatArray:
    return np.asarray(s.real**2 + s.imag**2)
