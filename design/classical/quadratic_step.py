"""Small convex quadratic programmes with soft walls, solved in batches.

Each wall ``c + g . v <= 0`` pushes back with a spring, ``(c + g . v)^2 / (2 softness)``, so that there always is a
best step: where the walls leave room it stays inside them but for about the softness, and where they leave none it
takes the least of all violations. What is minimised is convex and quadratic between the walls. Newton's method on it
is a guess of the walls that push, corrected until it is right; where that does not come to an end by itself, exact
line searches see to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray

#: Give of the walls, and of the box, over that of the bending of the aim.
SOFTNESS, BOX_SOFTNESS = 1e-5, 1e-7
#: How steeply a wall may rise.
STEEPEST = 100.0
#: Passes in all, and those of them without a line search.
PASSES, FREE_PASSES = 50, 2


@dataclass(frozen=True, eq=False)
class QuadraticStep:
    """Best steps of K programmes.

    Attributes
    ----------
    v : (K, n)
    push : (K, M) how hard each wall pushes, at least 0: the multipliers
    pushing : (K, M + 2 n) which walls push, and which sides of the box, low ones first
    """

    v: FloatArray
    push: FloatArray
    pushing: BoolArray


def quadratic_step(
    slope: FloatArray,
    bend: FloatArray,
    value: FloatArray,
    gradient: FloatArray,
    low: FloatArray,
    high: FloatArray,
    guess: BoolArray,
) -> QuadraticStep:
    """Step that maximises ``slope . v - v . bend v / 2`` with ``value + gradient . v <= 0`` and ``low <= v <= high``.

    Parameters
    ----------
    slope : (K, n)
    bend : (K, n, n) positive definite
    value, gradient : (K, M), (K, M, n) of the walls
    low, high : (K, n) box, ``low <= 0 <= high``
    guess : (K, M + 2 n) walls and sides that are thought to push
    """
    (k, n), m = slope.shape, value.shape[1]
    # Walls that rise ever more steeply count as walls, not for how steeply.
    gentle = np.minimum(1.0, STEEPEST / np.maximum(np.abs(gradient).max(axis=-1), 1.0))
    value, gradient = gentle * value, gentle[..., None] * gradient
    c = np.concatenate([value, low, -high], axis=1)
    G = np.zeros((k, m + 2 * n, n))
    G[:, :m] = gradient
    G[:, m + np.arange(n), np.arange(n)], G[:, m + n + np.arange(n), np.arange(n)] = -1.0, 1.0
    spring = np.repeat([1.0 / SOFTNESS, 1.0 / BOX_SOFTNESS], [m, 2 * n])
    v, excess, pushing = np.zeros((k, n)), c.copy(), guess.copy()
    going = np.arange(k)
    part = (slope, bend, c, G, v, excess, pushing)
    for count in range(PASSES):
        now_slope, now_bend, now_c, now_G, now_v, now_excess, now_pushing = part
        springs = (now_pushing * spring)[:, None, :] * now_G.swapaxes(-1, -2)
        force = now_slope - (springs @ now_c[..., None])[..., 0]
        way = np.linalg.solve(now_bend + springs @ now_G, force[..., None])[..., 0] - now_v
        rate = (now_G @ way[..., None])[..., 0]
        settled = ((now_excess + rate > 0.0) == now_pushing).all(axis=-1)
        if count >= FREE_PASSES and not settled.all():
            way_part = _best_part(now_slope, now_bend, spring, now_excess, rate, now_v, way)
            way_part = np.where(settled, 1.0, way_part)[:, None]
            way, rate = way_part * way, way_part * rate
        now_v, now_excess = now_v + way, now_excess + rate
        v[going], excess[going], pushing[going] = now_v, now_excess, now_pushing
        if settled.all():
            break
        if settled.any():
            left = ~settled
            going = going[left]
            now_slope, now_bend, now_c, now_G = slope[going], bend[going], c[going], G[going]
            now_v, now_excess = now_v[left], now_excess[left]
        part = (now_slope, now_bend, now_c, now_G, now_v, now_excess, now_excess > 0.0)
    return QuadraticStep(np.clip(v, low, high), gentle * np.maximum(excess[:, :m], 0.0) / SOFTNESS, pushing)


def _best_part(
    slope: FloatArray,
    bend: FloatArray,
    spring: FloatArray,
    excess: FloatArray,
    rate: FloatArray,
    v: FloatArray,
    way: FloatArray,
) -> FloatArray:
    """Part (K,) of the way from v at which what is minimised is least; its derivative is piecewise linear in it."""
    curved = (bend @ way[..., None])[..., 0]
    start, rise = ((v * curved).sum(axis=-1) - (slope * way).sum(axis=-1)), (way * curved).sum(axis=-1)
    at = -excess / np.where(rate == 0.0, np.inf, rate)
    at = np.sort(np.where((at > 0.0) & (at < 1.0), at, 1.0), axis=-1)
    at = np.concatenate([np.zeros((at.shape[0], 1)), at], axis=-1)
    walls = np.maximum(excess[:, None] + at[..., None] * rate[:, None], 0.0)
    slopes = start[:, None] + at * rise[:, None] + (walls * (spring * rate)[:, None]).sum(axis=-1)
    # Between the last place where it still falls and the next one it is a line.
    row, k = np.arange(at.shape[0]), np.minimum((slopes < 0.0).sum(axis=-1), at.shape[-1] - 1)
    before = np.maximum(k - 1, 0)
    low, high, f, g = at[row, before], at[row, k], slopes[row, before], slopes[row, k]
    inside = (f < 0.0) & (g > 0.0)
    return np.where(inside, low - f * (high - low) / np.where(inside, g - f, 1.0), np.where(g <= 0.0, 1.0, low))
