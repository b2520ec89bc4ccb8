"""How many roots a characteristic function has in a region, proved by the argument principle.

The contour is cut into pieces, each inside a disc about its middle c in which the function provably does not
vanish: with the Taylor coefficients of the polynomials at c,

        |f(c + h) - f(c)| <= sum_j |exp(-c delay_j)| (sum_k |p_jk| |h|^k exp(|h| delay_j) - |p_j0|) < |f(c)| .

There its angle stays within a quarter turn of that at c, so that the angle between the ends of the piece is known
without any doubt about whole turns. Pieces that do not have such a disc are halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np

from design.delay.characteristic import LARGEST_EXPONENT, Characteristic
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: The apex of every region stands this far to the left of the origin, in units of the point's scale: roots on
#: the axis are inside, and a loop is not called stable because of rounding.
APEX = 1e-9
#: Chords of the outer arc, and pieces of each straight line to begin with, graded towards its end.
CHORDS, GRADES = 4, 14
#: A piece is not halved more often than this; the value of f is then lost in rounding: a root on the contour.
HALVINGS = 40
#: Rounding of f, as a part of the sum of the magnitudes of its terms.
ROUNDING = 64.0 * np.finfo(float).eps


@dataclass(frozen=True)
class _Pieces:
    """Straight pieces of contours, (M,) each: from `start` to `end`, on the contour of the point `row`."""

    row: IntArray
    start: ComplexArray
    end: ComplexArray

    def take(self, index: BoolArray) -> _Pieces:
        return _Pieces(self.row[index], self.start[index], self.end[index])

    def halves(self) -> _Pieces:
        middle = 0.5 * (self.start + self.end)
        return _Pieces(np.tile(self.row, 2), np.concatenate([self.start, middle]), np.concatenate([middle, self.end]))


def roots_inside(f: Characteristic, decay: FloatArray, damping: FloatArray) -> FloatArray:
    """Number of roots (N,) that decay more slowly than `decay` and are damped less than `damping`; nan if not settled.

    The region lies to the right of the vertical line and of the two rays of constant damping ratio through its apex
    at ``-APEX``; `inside` says which points are in it. It is not settled when a root is on its edge.

    Parameters
    ----------
    decay : (N,) in units of the scale: roots with ``Re s > -decay - APEX``; negative only where `damping` is 1
    damping : (N,) damping ratio in [-1, 1] of ``s + APEX``; 1 where only the decay counts
    """
    pieces, accepted = _contours(f, decay, damping), []
    for _ in range(HALVINGS):
        sure = _known_angle(f, pieces)
        accepted.append(pieces.take(sure))
        pieces = pieces.take(~sure)
        if not pieces.row.size:
            break
        pieces = pieces.halves()
    settled = np.ones(decay.size, dtype=bool)
    settled[pieces.row] = False
    pieces = _joined(accepted)
    rows = np.concatenate([pieces.row, pieces.row])
    start, end = np.split(f.value(rows, np.concatenate([pieces.start, pieces.end])), 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.bincount(pieces.row, np.angle(end / start), settled.size) / np.pi
    return np.where(settled, np.round(turned) + 0.0, np.nan)


def inside(s: ComplexArray, decay: FloatArray, damping: FloatArray) -> BoolArray:
    """Mask (N, M) of the points s (N, M) that are in the regions of `roots_inside`; nan is not."""
    with np.errstate(invalid="ignore"):
        moved = s + APEX
        damped_less = (damping[:, None] >= 1.0) | (-moved.real < damping[:, None] * np.abs(moved))
        return np.asarray((moved.real > -decay[:, None]) & damped_less)


def _contours(f: Characteristic, decay: FloatArray, damping: FloatArray) -> _Pieces:
    """Upper half of every contour, anticlockwise: a polygon about the outer arc, the line, the ray to the apex."""
    radius = 2.0 * (_root_bound(f, decay + APEX) + np.abs(decay))
    ray = np.arccos(-damping)
    line = np.arccos(-decay / radius)
    end = np.minimum(ray, line)
    outer = radius[:, None] * np.exp(1j * end[:, None] * np.linspace(0.0, 1.0, CHORDS + 1))
    # Where the line comes first, it is followed down to the ray, or to the real axis where there is no ray.
    height = np.where(damping < 1.0, decay * np.tan(np.pi - np.minimum(ray, np.pi)), 0.0)
    on_line = (line < ray)[:, None]
    corner = np.where(on_line[:, 0], -decay + 1j * height, 0.5 * outer[:, -1])
    apex = np.where(on_line[:, 0] & (damping >= 1.0), -decay, 0.0).astype(complex)
    grades = np.concatenate([[0.0], 1.0 - 0.5 ** np.arange(1.0, GRADES), [1.0]])
    down = outer[:, -1:] + (corner - outer[:, -1])[:, None] * grades
    home = corner[:, None] + (apex - corner)[:, None] * grades
    path = np.concatenate([outer, down[:, 1:], home[:, 1:]], axis=1) - APEX
    rows = np.broadcast_to(np.arange(decay.size)[:, None], (decay.size, path.shape[1] - 1))
    moves = path[:, 1:] != path[:, :-1]
    return _Pieces(rows[moves], path[:, :-1][moves], path[:, 1:][moves])


def _root_bound(f: Characteristic, decay: FloatArray) -> FloatArray:
    """No root with ``Re s >= -decay`` is farther out than this (N,) (Fujiwara 1916)."""
    size = (np.abs(f.coefficients) * np.exp(f.delays * decay[:, None])[..., None]).sum(axis=1)
    return np.asarray(2.0 * (size[:, 1:] ** (1.0 / np.arange(1, f.order + 1))).max(axis=-1))


def _known_angle(f: Characteristic, pieces: _Pieces) -> BoolArray:
    """Mask (M,) of the pieces in whose disc f provably has no root."""
    middle = 0.5 * (pieces.start + pieces.end)
    radius = 0.5 * np.abs(pieces.end - pieces.start)
    terms = f.terms(pieces.row, middle)
    powers = np.arange(f.order, -1, -1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        taylor = np.abs(terms @ _binomials(f.order))
        reach = ((radius / np.abs(middle))[:, None] ** powers)[:, None, :]
        growth = np.exp(np.minimum(radius[:, None] * f.delays[pieces.row], LARGEST_EXPONENT))
        change = ((taylor * reach).sum(axis=-1) * growth - taylor[..., -1]).sum(axis=-1)
        noise = ROUNDING * np.abs(terms).sum(axis=(-2, -1))
        return np.asarray(change + noise < np.abs(terms.sum(axis=(-2, -1))))


@cache
def _binomials(order: int) -> FloatArray:
    """Takes ``a_k c^k`` (order+1), highest power first, to ``c^i`` times the Taylor coefficients at c."""
    powers = range(order, -1, -1)
    return np.array([[float(comb(k, i)) for i in powers] for k in powers])


def _joined(parts: list[_Pieces]) -> _Pieces:
    row, start, end = (np.concatenate([getattr(p, name) for p in parts]) for name in ("row", "start", "end"))
    return _Pieces(row, start, end)
