"""Damping of two poles that are about to meet, in terms that stay smooth when they do.

The fastest designs like to have two pairs of poles on the ray of the damping that is asked for, and often to have them
in one place there. Each pole by itself then moves infinitely fast with the gains; their mean m and the square delta of
half their difference do not. Turned so that the ray is the imaginary axis, ``-mu = Re m`` and ``delta = a + j b``, both
poles ``m +- sqrt(delta)`` are on the damped side of it if and only if

    mu >= 0    and    |delta| + a <= 2 mu^2 .

For a < 0, poles side by side along the ray, that is ``|b| <= 2 mu sqrt(mu^2 - a)``, two walls that meet at an edge.
For a > 0, one behind the other, it is that ``(1 + cos theta) a + sin theta b <= 2 mu^2`` for all theta, of which a few
are asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.figure import Figure, outer
from design.classical.pole_figures import Poles
from model.arrays import FloatArray, IntArray

#: They are taken as one, without second derivatives, below this.
SAME = 1e-5
#: How much stiffer these walls are than others: the poles go by the square root of what they give.
STIFFER = 20.0
#: Angles theta besides that of delta itself.
TURNS = np.array([0.0, 1.0, -1.0, 2.0, -2.0])
#: How many walls there are.
CLOSE_WALLS = 1 + len(TURNS)


def close_pole_walls(
    poles: Poles, pick: IntArray, limit: FloatArray, scale: FloatArray, rise: FloatArray
) -> tuple[Figure, FloatArray]:
    """Walls of the damping ratio of two poles, (6, K), and how they rise with the part that specs are tightened by.

    Parameters
    ----------
    poles : of K candidates
    pick : (2, K) which poles, both above the real axis
    limit : (K,) the damping ratio they are to have, less than 1
    scale : (K,) what a miss is a part of
    rise : (K,) how `limit` rises with the part
    """
    row = np.arange(limit.size)
    s, first, second = (v[row, pick] for v in (poles.s, poles.first, poles.second))
    mean, half = 0.5 * (s[0] + s[1]), 0.5 * (s[0] - s[1])
    meet = (np.abs(half) < SAME * np.abs(mean))[:, None, None]
    moved, opened = 0.5 * (first[0] + first[1]), 0.5 * (first[0] - first[1])
    bend = np.where(meet, 0.0, 0.5 * (second[0] + second[1]))
    apart = np.where(meet, 0.0, half[:, None, None] * (second[0] - second[1]))
    sine = np.sqrt(1.0 - limit**2)
    turn = 1.0 / (np.abs(mean) * (-limit + 1j * sine))  # turns the ray to the positive real axis
    square = turn**2
    turns = np.stack([turn, -1j * square, -square])
    value = (turns * np.stack([mean, half**2, half**2])).imag
    gradient = 2.0 * half[:, None] * opened
    gradient = (turns[..., None] * np.stack([moved, gradient, gradient])).imag
    curvature = 2.0 * outer(opened) + apart
    curvature = (turns[..., None, None] * np.stack([bend, curvature, curvature])).imag
    # By the angle that the ray turns when the limit rises: how mu, a and b change with it.
    angle = rise / sine
    by_part = -(turn * mean).real * angle, 2.0 * angle * value[2], -2.0 * angle * value[1]
    found = _Turned(value, gradient, curvature, by_part)
    along = value[1] < 0.0
    walls = (
        np.zeros((CLOSE_WALLS, limit.size)),
        np.zeros((CLOSE_WALLS, *moved.shape)),
        np.zeros((CLOSE_WALLS, *bend.shape)),
    )
    rises, exists = np.zeros((CLOSE_WALLS, limit.size)), np.zeros((CLOSE_WALLS, limit.size), dtype=bool)
    walls[0][0], walls[1][0], walls[2][0], rises[0], exists[0] = (
        -value[0],
        -gradient[0],
        -curvature[0],
        -by_part[0],
        True,
    )
    for rows, look in ((np.flatnonzero(along), _side_by_side), (np.flatnonzero(~along), _one_behind)):
        if rows.size:
            *parts, rise_part = look(found.take(rows))
            for whole, part in zip((*walls, rises), (*parts, rise_part), strict=True):
                whole[1 : 1 + part.shape[0], rows] = part
            exists[1 : 1 + parts[0].shape[0], rows] = True
    weight = STIFFER * sine / scale
    return Figure(
        weight * walls[0], weight[:, None] * walls[1], weight[:, None, None] * walls[2], exists
    ), weight * rises


@dataclass(frozen=True, eq=False)
class _Turned:
    """mu, a and b of K candidates (3, K) with their derivatives in the unknowns, and in the part (K,) each."""

    value: FloatArray
    gradient: FloatArray
    curvature: FloatArray
    by_part: tuple[FloatArray, FloatArray, FloatArray]

    def take(self, rows: IntArray) -> _Turned:
        """Some of the candidates."""
        mu, a, b = (v[rows] for v in self.by_part)
        return _Turned(self.value[:, rows], self.gradient[:, rows], self.curvature[:, rows], (mu, a, b))


def _side_by_side(found: _Turned) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """``+- b - 2 mu sqrt(mu^2 - a)`` with first and second derivatives, and how they rise."""
    (mu, a, b), (mu1, a1, b1), (mu2, a2, b2) = found.value, found.gradient, found.curvature
    root = np.sqrt(np.maximum(mu**2 - a, 1e-12))
    root1 = (mu[:, None] * mu1 - 0.5 * a1) / root[:, None]
    root2 = (mu[:, None, None] * mu2 + outer(mu1) - 0.5 * a2 - outer(root1)) / root[:, None, None]
    mixed = mu1[:, :, None] * root1[:, None, :]
    both = mu * root
    both1 = mu[:, None] * root1 + root[:, None] * mu1
    both2 = mu[:, None, None] * root2 + root[:, None, None] * mu2 + mixed + mixed.swapaxes(-1, -2)
    mu_part, a_part, b_part = found.by_part
    rise = mu_part * root + mu * (mu * mu_part - 0.5 * a_part) / root
    sign = np.array([1.0, -1.0])[:, None]
    return (
        sign * b - 2.0 * both,
        sign[..., None] * b1 - 2.0 * both1,
        sign[..., None, None] * b2 - 2.0 * both2,
        sign * b_part - 2.0 * rise,
    )


def _one_behind(found: _Turned) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """``(1 + cos theta) a + sin theta b - 2 mu^2`` with first and second derivatives, and how they rise."""
    (mu, a, b), (mu1, a1, b1), (mu2, a2, b2) = found.value, found.gradient, found.curvature
    theta = np.arctan2(b, a) + TURNS[:, None]
    on_a, on_b = 1.0 + np.cos(theta), np.sin(theta)
    mu_part, a_part, b_part = found.by_part
    return (
        on_a * a + on_b * b - 2.0 * mu**2,
        on_a[..., None] * a1 + on_b[..., None] * b1 - 4.0 * mu[:, None] * mu1,
        on_a[..., None, None] * a2 + on_b[..., None, None] * b2 - 4.0 * (mu[:, None, None] * mu2 + outer(mu1)),
        on_a * a_part + on_b * b_part - 4.0 * mu * mu_part,
    )
