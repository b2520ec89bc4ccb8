"""Poles at two gains of a locus: how they set out and arrive, which continues which, and which two meet in between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from design.frequency.locus_roots import other_places
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from model.branches import continuations

#: Two poles are followed as a pair where their distance at one end is below this part of that at the other.
APPROACH = 0.3


@dataclass(frozen=True, eq=False)
class Ends:
    """Poles at both ends of L stretches of a locus, each place of the one continued by that of the other.

    First come ``n - count`` poles above the real axis, last their conjugates in the same order. Between them are
    real poles, and the two that meet if there are such, next to each other, the lesser or lower one first.

    Attributes
    ----------
    start, end : (3, n, L) [rad/s] poles, and their first two derivatives with respect to the part of the way t
    count : (L,) number of poles before the conjugates
    meeting : (L,) place of the first of the two that meet, -1 without
    tried : (L,) False where more happens than that two poles meet: who continues whom is not known
    """

    start: ComplexArray
    end: ComplexArray
    count: IntArray
    meeting: IntArray
    tried: BoolArray

    @classmethod
    def between(cls, start: ComplexArray, end: ComplexArray) -> Self:
        """From the poles (L, n) at both ends, closed under conjugation, in any order."""
        a, b = np.ascontiguousarray(start.T), np.ascontiguousarray(end.T)
        n, L = a.shape
        first, last, near, far = _derivatives(a, b)
        # Nearest half way, as far as the slopes tell, but not beyond half the distance to another pole.
        follows = continuations(_ahead(first, near, 0.5).T, _ahead(last, far, -0.5).T).T
        lines = np.arange(L)
        last, far = last[:, follows, lines], far[follows, lines]
        one, other, line = _meeting(first[0], last[0], near, far)
        half = -np.sign(first[0].imag)
        half[one, line] = half[other, line] = 0.0
        # The second of a pair comes right behind the first one, wherever it was among the real poles.
        real, distance = first[0].real.copy(), np.abs(first[0].imag)
        real[other, line], distance[one, line], distance[other, line] = real[one, line], -2.0, -1.0
        order = np.lexsort((distance, real, half), axis=0)
        first, last = first[:, order, lines], last[:, order, lines]
        place = (order[:, line] == one).argmax(axis=0)
        for v in (first, last):
            x, y = v[:, place, line], v[:, place + 1, line]
            swap = (x[0].imag > y[0].imag) | ((x[0].imag == 0.0) & (x[0].real > y[0].real))
            v[:, place, line], v[:, place + 1, line] = np.where(swap, y, x), np.where(swap, x, y)
        meeting = np.full(L, -1)
        meeting[line] = place
        above = (half < 0.0).sum(axis=0)
        return cls(first, last, n - above, meeting, _alike(last[0], above, meeting))


def half_plane_order(values: ComplexArray) -> ComplexArray:
    """Sort the last axis: those above the real axis by their real part, the real ones, the conjugates as the first."""
    order = np.lexsort((np.abs(values.imag), values.real, -np.sign(values.imag)), axis=-1)
    return np.asarray(np.take_along_axis(values, order, axis=-1))


def _derivatives(a: ComplexArray, b: ComplexArray) -> tuple[ComplexArray, ComplexArray, FloatArray, FloatArray]:
    """Ends (3, n, L) from the poles a and b (n, L), and the squared distances (n, L) to the nearest others there."""
    others = other_places(len(a))
    across, at_a, at_b = a[:, None] - b, a[:, None] - a[others], b[:, None] - b[others]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = 1.0 / across
        out = -across.prod(axis=1) / at_a.prod(axis=1)
        back = -(-across).prod(axis=0) / at_b.prod(axis=1)
        out_bend = 2.0 * out * (1.0 + out * (inverse.sum(axis=1) - (1.0 / at_a).sum(axis=1)))
        back_bend = 2.0 * back * (1.0 - back * (inverse.sum(axis=0) + (1.0 / at_b).sum(axis=1)))
    near, far = ((v.real**2 + v.imag**2).min(axis=1, initial=np.inf) for v in (at_a, at_b))
    return np.stack([a, out, out_bend]), np.stack([b, -back, back_bend]), near, far


def _ahead(end: ComplexArray, gap: FloatArray, part: float) -> ComplexArray:
    """Where the poles of an end (3, n, L) are a `part` of the way on; `gap` (n, L) is the squared one to the others."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        step = part * end[1]
        shorter = np.minimum(1.0, 0.5 * np.sqrt(gap) / np.abs(step))
        return np.asarray(end[0] + np.where(np.isfinite(step), step * shorter, 0.0))


def _meeting(
    start: ComplexArray, end: ComplexArray, near: FloatArray, far: FloatArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Where two poles (n, L) leave or reach the real axis, or all but meet: both places (M,) and the stretches (M,)."""
    n = len(start)
    turned = (start.imag == 0.0) != (end.imag == 0.0)
    count = turned.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.minimum(near, far) / np.maximum(near, far)
    ratio = np.where(turned, 0.0, np.where(np.isnan(ratio), 1.0, ratio))
    lines = np.flatnonzero((count == 2) | ((count == 0) & (ratio.min(axis=0) < APPROACH**2)))
    m = np.arange(lines.size)
    one = ratio[:, lines].argmin(axis=0)
    tight = np.where(near[one, lines] <= far[one, lines], start[:, lines], end[:, lines])
    distance = np.abs(tight - tight[one, m])
    distance[turned[:, lines]] = -1.0
    distance[one, m] = np.inf
    # The other one that turns, or the nearest.
    other = distance.argmin(axis=0)
    pair = np.full(lines.size, n > 1)
    for v in (start, end):
        x, y = v[one, lines], v[other, lines]
        pair &= ((x.imag == 0.0) & (y.imag == 0.0)) | (x == y.conj())
    return one[pair], other[pair], lines[pair]


def _alike(end: ComplexArray, above: IntArray, meeting: IntArray) -> BoolArray:
    """Mask (L,) of the ends (n, L) whose poles, but for those that meet, are real or conjugates like at the start."""
    n = len(end)
    place = np.arange(n)[:, None]
    upper, lower = place < above, place >= n - above
    partner = np.where(upper, place + n - above, np.where(lower, place - n + above, place))
    alike = (end[partner, np.arange(end.shape[1])] == end.conj()) & (~upper | (end.imag > 0.0))
    apart = place - meeting
    return np.asarray(np.all(alike | ((meeting >= 0) & ((apart == 0) | (apart == 1))), axis=0))
