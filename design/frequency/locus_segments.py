"""Stretches of a root locus between gains at which the poles are known, and where the poles are in between.

The characteristic polynomial is affine in the gain. So between two gains whose poles a and b are known it is, with
t the part of the way, ``(1 - t) prod(s - a_j) + t prod(s - b_j)``: no coefficients, and no digits lost to them.
Polynomials of degree five in t with the true slopes and bends at both ends say where the poles are about. Two poles
that meet, or nearly, move like a square root there, but their mean and the square of half their distance do not: it
is these that are followed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np

from design.frequency.locus_pairs import Ends
from design.frequency.locus_roots import settled_roots
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: Slopes and bends of more than this many chords belong to poles that all but meet, and are of no use.
STEEP, BENT = 4.0, 30.0
#: About how many numbers are worked on at a time, so that they stay in the processor's cache.
BLOCK = 300_000
#: Real or complex; what comes back is of the same kind.
Numbers = TypeVar("Numbers", FloatArray, ComplexArray)


@dataclass(frozen=True, eq=False)
class Segments:
    """L stretches with n poles each.

    Attributes
    ----------
    ends : the poles at both ends
    curve : (6, n, L) coefficients, lowest power first; of two poles that meet, the first place holds the mean and
        the next one the squared half distance
    """

    ends: Ends
    curve: ComplexArray

    @classmethod
    def between(cls, start: ComplexArray, end: ComplexArray) -> Self:
        """From the poles (L, n) at both ends [rad/s], in any order."""
        ends = Ends.between(start, end)
        return cls(ends, _curves(ends))

    def poles(self, segment: IntArray, t: FloatArray) -> tuple[ComplexArray, BoolArray]:
        """Poles (S, n) [rad/s] at the parts `t` (S,) of the stretches `segment` (S,), and which (S,) are sure."""
        ends = self.ends
        n = ends.start.shape[1]
        values = np.empty((segment.size, n), dtype=complex)
        sure = np.zeros(segment.size, dtype=bool)
        count = np.where(ends.tried, ends.count, 0)[segment]
        block = BLOCK // n**2 + 1
        for R in range((n + 1) // 2, n + 1):
            members = np.flatnonzero(count == R)
            for i in range(0, members.size, block):
                here = members[i : i + block]
                at, part = segment[here], t[here]
                guess, half = self.guesses(at, part, R)
                a, b = (np.take(v, at, axis=1) for v in (ends.start[0], ends.end[0]))
                roots, sure[here] = settled_roots(guess, a, b, part, half)
                values[here] = roots.T
        return values, sure

    def guesses(self, segment: IntArray, t: FloatArray, R: int) -> tuple[ComplexArray, IntArray]:
        """About where the first R poles are (R, S), and the half planes of the last ones of them (2 R - n, S)."""
        *lower, s = np.take(self.curve[:, :R], segment, axis=2)
        part = t.astype(complex)
        for coefficient in lower[::-1]:
            s *= part
            s += coefficient
        above = self.ends.start.shape[1] - R
        half = np.zeros((R - above, t.size), dtype=np.int64)
        place = self.ends.meeting[segment]
        which = np.flatnonzero(place >= 0)
        p = place[which]
        mean, square = s[p, which].real, s[p + 1, which].real
        distance = np.sqrt(np.abs(square)) * np.where(square < 0.0, 1j, 1.0)
        s[p, which], s[p + 1, which] = mean - distance, mean + distance
        p -= above
        half[p + 1, which] = square < 0.0
        half[p, which] = -half[p + 1, which]
        return s, half


def _curves(ends: Ends) -> ComplexArray:
    """Coefficients (6, n, L) of polynomials from start to end with the true slopes and bends, where these serve."""
    which = np.flatnonzero(ends.meeting >= 0)
    p = ends.meeting[which]
    pairs = [(v[:, p, which], v[:, p + 1, which]) for v in (ends.start, ends.end)]
    with np.errstate(invalid="ignore", over="ignore"):
        result = _hermite(ends.start, ends.end)
        # Real poles have real slopes, but for rounding.
        result.imag *= (ends.start[0].imag != 0.0) | (ends.end[0].imag != 0.0)
        result[:, p, which] = _hermite(*(0.5 * (x + y).real for x, y in pairs))
        result[:, p + 1, which] = _hermite(*(_square(0.5 * (y - x)) for x, y in pairs))
    return result


def _square(v: ComplexArray) -> FloatArray:
    """The square of v, and its derivatives, from v and its derivatives (3, M)."""
    return np.stack([v[0] ** 2, 2.0 * v[0] * v[1], 2.0 * (v[1] ** 2 + v[0] * v[2])]).real


def _hermite(start: Numbers, end: Numbers) -> Numbers:
    """Coefficients (6, ...), lowest first, from values, slopes and bends (3, ...) at 0 and at 1.

    The chord's slope, the cubic's bend, where a slope or a bend is too large to be of use.
    """
    chord = end[0] - start[0]
    size = np.abs(chord)
    out, back = (np.where(np.abs(v[1]) <= STEEP * size, v[1], chord) for v in (start, end))
    cubic = 6.0 * chord - 4.0 * out - 2.0 * back, 2.0 * out + 4.0 * back - 6.0 * chord
    p, q = (0.5 * np.where(np.abs(v[2]) <= BENT * size, v[2], w) for v, w in zip((start, end), cubic, strict=True))
    third = 10.0 * chord - 6.0 * out - 4.0 * back - 3.0 * p + q
    fourth = -15.0 * chord + 8.0 * out + 7.0 * back + 3.0 * p - 2.0 * q
    fifth = 6.0 * chord - 3.0 * (out + back) - p + q
    return np.stack([start[0], out, p, third, fourth, fifth])
