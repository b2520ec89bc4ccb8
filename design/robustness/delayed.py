"""Peaks of a loop whose inputs are delayed, and whether it is stable.

With delays the loop is no ratio of polynomials. The frequencies are searched on a grid that is logarithmic and linear
at once, dense about the poles of the loop without delay and with eight points to a turn of the longest delay as far as
the loop is not weak; from its highest summits the peaks are climbed exactly. Nothing proves that none is higher.

The delays multiply ``det(I + L)`` by ``f(s) = det(I + (diag(exp(-s tau)) - I) T(s))``, T without delay. f is analytic
but for the poles of T and goes to 1, so that the argument principle along the axis counts the unstable poles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.robustness.gains import EVERY, SIGMA_T, every_gain
from design.robustness.input_loop import InputLoop, complementary, delay_factor, delayed, turn, undelayed
from design.robustness.level_set import crossings, nodes
from design.robustness.peaks import Peaks, Place, climbed
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: The linear part of the grid ends where the largest singular value of T is this for the last time.
WEAK = 0.1
#: Points of the logarithmic and of the linear part, and how far the former reaches beyond the poles.
LOGARITHMIC, LINEAR, REACH = 400, 1024, 1e3
#: Longest delay times highest frequency of the linear part [rad]: eight points to a turn.
LARGEST_TURN = 0.25 * np.pi * LINEAR
#: Points about each pole, in units of its distance from the axis.
OFFSETS = np.array([-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
#: How many summits of the grid are climbed for each gain.
SUMMITS = 6
#: An interval in which f turns by more than this [rad] is cut into so many, so many times at most.
LARGEST_STEP, CUTS, LARGEST_NUMBER_OF_CUTS = 0.6, 8, 12
#: A point with more such intervals than this at a time has rounding for f, and is not judged.
MOST_INTERVALS = 2000


@dataclass(frozen=True, eq=False)
class Turning(GridArrays):
    """How f turns along the axis.

    Attributes
    ----------
    angle : (N,) from zero to infinite frequency [rad], a multiple of pi; nan where it cannot be told
    rows, places : points (M,) and places (M,) where it turns fast, because a pole is near
    """

    angle: FloatArray
    rows: IntArray
    places: Place


def delayed_peaks(loop: InputLoop) -> Peaks:
    """Peaks of the five gains; nan where the loop is not stable, or its delay is too long to be searched."""
    points = len(loop.A)
    omega, searched = _grid(loop)
    T, turns = complementary(loop, omega), turn(loop, np.arange(points), omega)
    turning = _turning(loop, omega, np.angle(delay_factor(T, turns)))
    unstable = (loop.poles.real > 0.0).sum(axis=-1) - np.round(turning.angle / np.pi)
    gains, rows = every_gain(points)
    places = _summits(omega[rows], gains.of(delayed(T, turns)[rows]))
    candidates = np.concatenate([np.repeat(np.arange(len(rows)), SUMMITS), *(5 * turning.rows + i for i in range(5))])
    start, low, high = (
        np.concatenate([getattr(places, name).ravel(), np.tile(getattr(turning.places, name), 5)])
        for name in ("omega", "low", "high")
    )
    found = climbed(loop, rows[candidates], gains.take(candidates), Place(start, low, high))
    # At infinite frequency, where T is 0, the gains are what they are without a loop.
    height, frequency = np.tile(EVERY.identity**2, points), np.full(len(rows), np.inf)
    value = np.zeros((len(rows), 2, 2), dtype=complex)
    # Rising, so that of the summits of a row the highest stays.
    order = np.argsort(found.height, kind="stable")
    order = order[found.height[order] > height[candidates[order]]]
    at = candidates[order]
    height[at], frequency[at], value[at] = found.height[order], found.omega[order], found.T[order]
    outside = np.repeat(~searched | (unstable != 0.0), 5)
    height[outside], frequency[outside], value[outside] = np.nan, np.nan, complex(np.nan, np.nan)
    shape = (points, 5)
    proved = np.zeros(points, dtype=bool)
    return Peaks(np.sqrt(height).reshape(shape), frequency.reshape(shape), value.reshape(*shape, 2, 2), proved)


def _grid(loop: InputLoop) -> tuple[FloatArray, BoolArray]:
    """Frequencies (N, W), strictly rising from 0, and whether they are dense enough for the longest delay (N,)."""
    points = len(loop.A)
    size, longest = np.abs(loop.poles), loop.delay.max(axis=-1)
    every = np.arange(points)
    edges = crossings(nodes(loop, 2), every, EVERY.take(np.full(points, SIGMA_T)), np.full(points, WEAK**2))
    strong = np.fmax(np.fmax.reduce(edges, axis=-1), size.max(axis=-1))
    bottom, top = size.min(axis=-1) / REACH, np.maximum(size.max(axis=-1) * REACH, strong)
    near = np.abs(loop.poles.imag)[:, :, None] + np.abs(loop.poles.real)[:, :, None] * OFFSETS
    parts = (
        np.zeros((points, 1)),
        bottom[:, None] * (top / bottom)[:, None] ** np.linspace(0.0, 1.0, LOGARITHMIC),
        strong[:, None] * np.linspace(0.0, 1.0, LINEAR + 1)[1:],
        np.abs(near).reshape(points, -1),
    )
    omega = np.sort(np.concatenate(parts, axis=-1), axis=-1)
    # A point that is there twice would enclose nothing. It moves up.
    twice = np.diff(omega, axis=-1, prepend=-1.0) == 0.0
    beyond = omega[:, -1:] * np.linspace(1.01, 1.1, omega.shape[-1])
    return np.sort(np.where(twice, beyond, omega), axis=-1), longest * strong <= LARGEST_TURN


def _summits(omega: FloatArray, height: FloatArray) -> Place:
    """The highest summits (R, SUMMITS) of what is known at some frequencies, both (R, W)."""
    padded = np.pad(height, ((0, 0), (1, 1)), constant_values=-np.inf)
    summit = (height >= padded[:, :-2]) & (height >= padded[:, 2:])
    best = np.argsort(np.where(summit, -height, np.inf), axis=-1)[:, :SUMMITS]
    places = best, np.maximum(best - 1, 0), np.minimum(best + 1, omega.shape[-1] - 1)
    return Place(*(np.take_along_axis(omega, place, axis=-1) for place in places))


def _turning(loop: InputLoop, omega: FloatArray, angle: FloatArray) -> Turning:
    """How f turns, given its angle (N, W) on the grid; intervals in which it turns fast are cut until it does not."""
    step = _wrapped(np.diff(angle, axis=-1))
    fast = np.abs(step) > LARGEST_STEP
    total = np.where(fast, 0.0, step).sum(axis=-1)
    rows, column = np.nonzero(fast)
    low, high, turned = omega[rows, column], omega[rows, column + 1], step[fast]
    found: list[tuple[IntArray, FloatArray, FloatArray, FloatArray]] = []
    for _ in range(LARGEST_NUMBER_OF_CUTS):
        crowded = np.bincount(rows, minlength=len(total)) > MOST_INTERVALS
        total[crowded] = np.nan
        kept = ~crowded[rows]
        rows, low, high, turned = rows[kept], low[kept], high[kept], turned[kept]
        if not rows.size:
            break
        inner = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, CUTS + 1)
        repeated, flat = np.repeat(rows, CUTS + 1), inner.ravel()
        f = delay_factor(undelayed(loop, repeated, flat), turn(loop, repeated, flat)).reshape(inner.shape)
        nearest, every = np.argmin(np.abs(f), axis=-1), np.arange(len(rows))
        sides = np.maximum(nearest - 1, 0), np.minimum(nearest + 1, CUTS)
        found.append((rows, inner[every, nearest], inner[every, sides[0]], inner[every, sides[1]]))
        step = _wrapped(np.diff(np.angle(f), axis=-1))
        fast = np.abs(step) > LARGEST_STEP
        np.add.at(total, rows, np.where(fast, 0.0, step).sum(axis=-1))
        row, column = np.nonzero(fast)
        rows, low, high, turned = rows[row], inner[row, column], inner[row, column + 1], step[fast]
    np.add.at(total, rows, turned)
    if not found:
        return Turning(total, np.zeros(0, dtype=int), Place(*(np.zeros(0),) * 3))
    at, start, left, right = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return Turning(total, np.asarray(at, dtype=int), Place(start, left, right))


def _wrapped(angle: FloatArray) -> FloatArray:
    """The same angle in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
