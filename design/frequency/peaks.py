"""Largest values over all frequencies of the closed loop's sensitivities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.delayed import GridResponse, zero_between
from design.frequency.feedback import ClosedLoop, complementary
from design.frequency.polynomials import evaluate, powers, squared_magnitude
from design.frequency.positive_roots import never_positive, positive_roots
from model.arrays import ComplexArray, FloatArray, GridArrays

#: A peak is proved to be the largest to within this part of its square.
RESOLUTION = 1e-8
#: Two or three passes prove a peak; more than this are only for loops that are next to unstable.
LARGEST_NUMBER_OF_PASSES = 30
#: On a grid: how many local maxima of the grid are looked into. Next to the edge of stability a narrow
#: peak can lie between two points of the grid and show as a low one.
SUMMITS = 16
#: Where the search begins besides the poles: squares of frequencies over the loop's scale, 0 included.
SAMPLES = np.concatenate([[0.0], np.geomspace(1e-3, 8.0, 47) ** 2])
#: Steps from there, in the logarithm of the square of the frequency: how many, and how far each can go.
NEWTON_STEPS, REACH = 4, 0.4


@dataclass(frozen=True, eq=False)
class Peaks(GridArrays):
    """Peaks over all frequencies, (N,), each at least 1 because L vanishes at infinity.

    Attributes
    ----------
    sensitivity : ``max |1 + L|^-1``
    balanced : ``max |S - T| = max |1 - L| / |1 + L|``
    """

    sensitivity: FloatArray
    balanced: FloatArray


def peaks(loop: ClosedLoop, poles: ComplexArray, found: GridResponse | None = None) -> Peaks:
    """Peaks of the closed loop's sensitivity functions; meaningless where it is not stable.

    Parameters
    ----------
    poles : (N, n) of the closed loop without delay, near which the search begins
    found : `design.frequency.delayed.grid_response` of the loop where that is what is searched
    """
    N = loop.scale.size
    if found is not None:
        omega = np.concatenate([_searched_peak(loop, found, weight) for weight in (1.0, 2.0)])
    else:
        omega = _peak(loop, poles)
    T, _ = complementary(loop, np.arange(2 * N) % N, omega, loop.delayed)
    sensitivity, balanced = np.abs(1.0 - T[:N]), np.abs(1.0 - 2.0 * T[N:])
    return Peaks(np.maximum(sensitivity, 1.0), np.maximum(balanced, 1.0))


def _peak(loop: ClosedLoop, poles: ComplexArray) -> FloatArray:
    """Frequencies (2N,) where S, and where S - T, are largest: ratios of two polynomials each.

    From the best of a few frequencies near the closed loop's poles, Newton on the derivative; then the
    proof: where ``|top|^2 - level |bottom|^2`` is nowhere positive there is no higher peak; elsewhere its roots
    bound the frequencies that lie above the level, if there are any, and the search goes on from their midpoints
    (Bruinsma and Steinbuch 1990).
    """
    whole, numerator = loop.characteristic, loop.numerator
    P = squared_magnitude(np.concatenate([whole - numerator, whole - 2.0 * numerator]))
    Q = np.tile(squared_magnitude(whole), (2, 1))
    near = np.tile(np.concatenate([poles.imag**2, np.abs(poles) ** 2], axis=-1), (2, 1))
    start = np.concatenate([near, np.broadcast_to(SAMPLES, (len(P), SAMPLES.size))], axis=-1)
    samples = powers(SAMPLES, P.shape[-1])
    heights = np.concatenate([evaluate(P, near) / evaluate(Q, near), (P @ samples) / (Q @ samples)], axis=-1)
    x, level = _best(P, Q, start, heights)
    # Infinity has been looked at too: T is 0 there or, of a sampled loop, what it is at half the sampling rate.
    ends = P[:, 0] / Q[:, 0]
    x, level = np.where(ends > level, np.inf, x), np.maximum(np.maximum(level, ends), 1.0)
    above = level * (1.0 + RESOLUTION)
    cut = np.where((x > 0.0) & (x < np.inf), x, 1.0)
    active = np.flatnonzero(~never_positive(P - above[:, None] * Q, cut))
    for _ in range(LARGEST_NUMBER_OF_PASSES):
        above = level[active] * (1.0 + RESOLUTION)
        edges = positive_roots(P[active] - above[:, None] * Q[active])
        middles = 0.5 * (edges[:, 1:] + edges[:, :-1])
        exceeded = ~np.isnan(middles).all(axis=-1)
        if not exceeded.any():
            break
        active, above, middles = active[exceeded], above[exceeded], middles[exceeded]
        middles = np.where(np.isnan(middles), 0.0, middles)
        heights = evaluate(P[active], middles) / evaluate(Q[active], middles)
        found, height = _best(P[active], Q[active], middles, heights)
        better = height > above
        active = active[better]
        x[active], level[active] = found[better], height[better]
    return np.sqrt(x)


def _best(P: FloatArray, Q: FloatArray, start: FloatArray, heights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where ``P/Q`` is largest (N,) among `start` (N, m), of these `heights`, sharpened; and its value.

    Newton's method for the maximum of ``log(P/Q)`` over log x, in which resonances are nearly parabolas.
    """
    best = np.argmax(heights, axis=-1)[:, None]
    start, height = (np.take_along_axis(v, best, axis=-1)[:, 0] for v in (start, heights))
    length = P.shape[-1]
    both, x = np.stack([P.T, Q.T]), start
    weight = np.arange(length - 1.0, -1.0, -1.0) ** np.arange(3.0)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(NEWTON_STEPS):
            (p, p_1, p_2), (q, q_1, q_2) = weight @ (both * powers(x, length))
            p_1, q_1 = p_1 / p, q_1 / q
            slope, bend = p_1 - q_1, p_2 / p - p_1**2 - q_2 / q + q_1**2
            step = np.where(bend < 0.0, -slope / bend, np.copysign(REACH, slope))
            x = x * np.exp(np.clip(step, -REACH, REACH))
        p, q = (both * powers(x, length)).sum(axis=1)
        better = p > height * q
        return np.where(better, x, start), np.where(better, p / q, height)


def _searched_peak(loop: ClosedLoop, found: GridResponse, weight: float) -> FloatArray:
    """Frequency (N,) of the largest ``|1 - weight T|``, with the delay.

    Each of the highest summits of the grid is found between its neighbours, where the slope changes its sign.
    """
    height = np.abs(1.0 - weight * found.value)
    padded = np.pad(height, ((0, 0), (1, 1)), constant_values=-np.inf)
    summit = (height >= padded[:, :-2]) & (height >= padded[:, 2:])
    place = np.argsort(np.where(summit, -height, np.inf), axis=-1)[:, :SUMMITS]
    every = np.arange(len(height))
    rows = np.repeat(every, place.shape[1])
    low = found.omega[rows, np.maximum(place - 1, 0).ravel()]
    high = found.omega[rows, np.minimum(place + 1, height.shape[1] - 1).ravel()]

    def slope(omega: FloatArray) -> FloatArray:
        T, T_slope = complementary(loop, rows, omega, loop.delayed)
        return np.asarray(-(np.conj(1.0 - weight * T) * T_slope).real)

    candidates = np.stack([found.omega[rows, place.ravel()], zero_between(slope, low, high)], axis=-1)
    T, _ = complementary(loop, np.repeat(rows, 2), candidates.ravel(), loop.delayed)
    best = np.abs(1.0 - weight * T).reshape(len(height), -1).argmax(axis=-1)
    return np.asarray(candidates.reshape(len(height), -1)[every, best])
