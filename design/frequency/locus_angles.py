"""The directions in which branches leave the open loop's poles, and arrive at its zeros.

Where ``L = h (s - p)^-m`` next to a pole, ``1 + k L = 0`` gives ``(s - p)^m = -k h``: m branches leave in the
directions ``(pi + arg h + 2 pi l) / m``. Where ``L = g (s - z)^m`` next to a zero, ``(s - z)^m = -1 / (k g)``: they
arrive from the directions ``(pi - arg g + 2 pi l) / m``. Both coefficients are products of distances of poles and
zeros, as in the textbooks' angle condition; the numerator at a pole is that of the distances to the closed-loop
poles at some gain, since ``prod(s - moved) = d(s) + k num(s)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.landmarks import AT_ORIGIN, Landmarks
from design.frequency.poles import pole_order
from design.frequency.polynomials import leading_zeros, roots
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray
from model.branches import continuations

#: m poles are one m-fold pole when they are nearer to each other than ``ROUNDING^(1/m)``, in parts of their size.
ROUNDING = 1e-12
#: A pole moves if the reference gain moves it further than these parts of its size, and of the largest pole.
MOVED, MOVED_AT_ALL = 1e-10, 1e-12


@dataclass(frozen=True, eq=False)
class Departures(GridArrays):
    """Directions in which branches leave the poles of the open loop, in the order of `Landmarks.poles`.

    Attributes
    ----------
    angle : (N, n) [rad] in (-pi, pi]; nan for poles that do not move
    group : (N, n) place of the first of the poles that are one with this one: its own place for a simple pole
    """

    angle: FloatArray
    group: IntArray


@dataclass(frozen=True, eq=False)
class Arrivals(GridArrays):
    """Finite zeros (N, n) [rad/s], nan padded, and the directions (N, n) [rad], in (-pi, pi], as seen from there."""

    zero: ComplexArray
    angle: FloatArray


def departures(landmarks: Landmarks) -> Departures:
    """Directions in which branches leave the poles of the open loop as the gain grows from 0."""
    p, moved = landmarks.poles, landmarks.moved
    same = _clusters(p)
    m = same.sum(axis=-1)
    centre = np.where(same, p[:, None, :], 0.0).sum(axis=-1) / m
    apart = centre[:, :, None] - moved[:, None, :]
    size = np.abs(centre)
    reach = np.where(m == 1, MOVED * size + MOVED_AT_ALL, 4.0 * _spread(m) * np.maximum(size, AT_ORIGIN))
    stays = np.abs(apart) <= reach[:, :, None]
    stays &= stays.cumsum(axis=-1) <= m[:, :, None]
    argument = np.angle(np.where(stays, 1.0, apart)).sum(axis=-1)
    argument -= np.angle(np.where(same, 1.0, centre[:, :, None] - p[:, None, :])).sum(axis=-1)
    angle = _directions(np.pi + argument, m - stays.sum(axis=-1), same, centre.imag == 0.0)
    return Departures(angle, same.argmax(axis=-1))


def finite_zeros(landmarks: Landmarks, hidden: BoolArray) -> ComplexArray:
    """Zeros of the loop (N, n) in units of `Landmarks.scale`, nan padded, without those that hidden poles cancel.

    Parameters
    ----------
    hidden : (N, n) poles that do not move
    """
    z = roots(landmarks.transfer.numerator)
    for i in np.flatnonzero(hidden.any(axis=0)):
        distance = np.abs(z - landmarks.poles[:, i : i + 1])
        nearest = np.where(np.isnan(distance), np.inf, distance).argmin(axis=-1)
        rows = np.flatnonzero(hidden[:, i])
        z[rows, nearest[rows]] = complex(np.nan, np.nan)
    return pole_order(z)


def arrivals(landmarks: Landmarks, hidden: BoolArray) -> Arrivals:
    """Finite zeros, and the directions from which branches arrive there as the gain grows beyond all bounds.

    Parameters
    ----------
    hidden : (N, n) poles that do not move; each cancels a zero, which is left out
    """
    p, z = landmarks.poles, finite_zeros(landmarks, hidden)
    same = _clusters(z)
    m = same.sum(axis=-1)
    centre = np.where(same, z[:, None, :], 0.0).sum(axis=-1) / m
    to_zeros = np.where(same | np.isnan(z)[:, None, :], 1.0, centre[:, :, None] - z[:, None, :])
    to_poles = np.where(hidden[:, None, :], 1.0, centre[:, :, None] - p[:, None, :])
    argument = np.angle(to_poles).sum(axis=-1) - np.angle(to_zeros).sum(axis=-1)
    falling = first_markov(landmarks)[:, None] < 0.0
    angle = _directions(argument + np.where(falling, 0.0, np.pi), m, same, centre.imag == 0.0)
    return Arrivals(np.asarray(z * landmarks.scale[:, None]), np.where(np.isnan(z), np.nan, angle))


def first_markov(landmarks: Landmarks) -> FloatArray:
    """The first Markov parameter that is not zero (N,): what the loop is at high frequency; 0 for no loop at all."""
    last = landmarks.markov.shape[-1] - 1
    first = np.minimum(leading_zeros(landmarks.markov), last)
    return np.take_along_axis(landmarks.markov, first[:, None], axis=-1)[:, 0]


def along_branches(departure: Departures, start: ComplexArray, following: ComplexArray, known: BoolArray) -> FloatArray:
    """Departure angles (N, n) dealt out to the branches, of which this is the start and the next point (N, n).

    The branches that leave a multiple pole do so in all of its directions, each in the one it then lies in. Points
    that are not `known` (N,) to start there keep them as they are.
    """
    angle = departure.angle.copy()
    rows = np.flatnonzero(known & np.any(departure.group != np.arange(angle.shape[-1]), axis=-1))
    if rows.size == 0:
        return angle
    group = departure.group[rows]
    same = group[:, :, None] == group[:, None, :]
    centre = np.where(same, start[rows, None, :], 0.0).sum(axis=-1) / same.sum(axis=-1)
    way = following[rows] - centre
    longest = np.where(same, np.abs(way)[:, None, :], 0.0).max(axis=-1)
    # Far apart, so that none goes to another pole's.
    to = 10.0 * group + way / np.where(longest > 0.0, longest, 1.0)
    directions = 10.0 * group + np.where(np.isnan(angle[rows]), 0.0, 1.0) * np.exp(1j * np.nan_to_num(angle[rows]))
    angle[rows] = np.take_along_axis(angle[rows], continuations(to, directions), axis=-1)
    return angle


def _directions(argument: FloatArray, count: IntArray, same: BoolArray, real: BoolArray) -> FloatArray:
    """``(argument + 2 pi i) / count`` in (-pi, pi] for i = 0, 1 .. in each group, nan beyond `count`; all (N, n)."""
    i = np.tril(same, -1).sum(axis=-1)
    # By symmetry, what is on the real axis starts along it, or in equal parts of the circle from it.
    argument = np.where(real, np.pi * np.rint(argument / np.pi), argument)
    angle = (argument + 2.0 * np.pi * i) / np.maximum(count, 1)
    angle -= 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi) - 1e-12)
    return np.where(i < count, np.minimum(angle, np.pi), np.nan)


def _spread(m: IntArray) -> FloatArray:
    """How far rounding spreads an m-fold pole, in parts of its size."""
    return np.asarray(ROUNDING ** (1.0 / m))


def _clusters(s: ComplexArray) -> BoolArray:
    """Mask (N, n, n): which of the points (N, n) are one but for rounding. Points at the origin are those below
    `AT_ORIGIN`; nan is one with itself alone.
    """
    n = s.shape[-1]
    size = np.abs(s)
    size = np.maximum(size[:, :, None], size[:, None, :])
    with np.errstate(invalid="ignore"):
        apart = np.where(size < AT_ORIGIN, 0.0, np.abs(s[:, :, None] - s[:, None, :]))
        same = (apart <= _spread(np.array(n)) * size) | np.eye(n, dtype=bool)
        if np.count_nonzero(same) == same.shape[0] * n:
            return same
        same[...] = np.eye(n, dtype=bool)
        for m in range(n, 1, -1):
            near = apart <= _spread(np.array(m)) * size
            same |= near & (near.sum(axis=-1) >= m)[:, :, None]
    # What is one with the same third one is one.
    for _ in range(n):
        same = (same.astype(int) @ np.swapaxes(same, 1, 2)) > 0
    return same
