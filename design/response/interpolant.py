"""Polynomials through ten even samples: values, crossings, extremes and integrals between the samples.

On samples that resolve the signal (|pole| times step <= 1/8) such a polynomial differs from the signal by less
than 1e-9 of the mode it resolves worst, and unlike a Taylor series it does not magnify the rounding of modes
that have died. Rows of samples are independent signals; an event is one place in one row, and all the events
of all rows are solved together.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from model.arrays import BoolArray, FloatArray, IntArray

POINTS = 10
_HALF = 0.5 * (POINTS - 1)
#: Monomial coefficients in u in [-1, 1] from the samples of a window.
_FIT: FloatArray = np.asarray(
    np.linalg.inv(np.vander(np.linspace(-1.0, 1.0, POINTS), increasing=True)), dtype=np.float64
)
_NEWTON_PASSES = 8
#: After a Newton step this short [samples] the next one would be of the order of its square.
_CLOSE = 1e-5


@dataclass(frozen=True, eq=False)
class Polynomials:
    """One polynomial per event.

    Attributes
    ----------
    coefficients : (POINTS, E) ascending, in ``u = (s - origin) / 4.5``; s counts samples of the block
    origin : (E,) middle of each window [samples]
    """

    coefficients: FloatArray
    origin: FloatArray

    def value(self, s: FloatArray) -> FloatArray:
        """(E,) values at s [samples]."""
        return _sum(self.coefficients, _powers((s - self.origin) / _HALF, len(self.coefficients)))

    def derivative(self) -> Polynomials:
        """Derivatives with respect to s [1/sample]."""
        powers = np.arange(1, self.coefficients.shape[0])[:, None] / _HALF
        return Polynomials(self.coefficients[1:] * powers, self.origin)

    def minus(self, level: FloatArray) -> Polynomials:
        """The polynomials less a constant (E,)."""
        coefficients = self.coefficients.copy()
        coefficients[0] -= level
        return Polynomials(coefficients, self.origin)

    def times(self, factor: FloatArray) -> Polynomials:
        """The polynomials times a constant (E,)."""
        return Polynomials(self.coefficients * factor, self.origin)

    def integral(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """(E,) integrals over s from low to high [samples]."""
        powers = np.arange(1, self.coefficients.shape[0] + 1)[:, None] / _HALF
        primitive = np.concatenate([np.zeros((1, self.origin.size)), self.coefficients / powers])
        whole = Polynomials(primitive, self.origin)
        return whole.value(high) - whole.value(low)

    def root(self, low: FloatArray, high: FloatArray, start: FloatArray) -> FloatArray:
        """(E,) where each one crosses zero in [low, high]; `start` where its ends have the same sign.

        Newton's method held in a shrinking bracket: a step that leaves it is replaced by the middle.
        """
        slope = self.derivative().coefficients
        below = self.value(low) < 0.0
        crosses = below != (self.value(high) < 0.0)
        s = start
        for _ in range(_NEWTON_PASSES):
            powers = _powers((s - self.origin) / _HALF, len(self.coefficients))
            value, change = _sum(self.coefficients, powers), _sum(slope, powers[:-1])
            before = (value < 0.0) == below
            low, high = np.where(before, s, low), np.where(before, high, s)
            step = np.where(crosses, value / np.where(change == 0.0, np.inf, change), 0.0)
            s = s - step
            s = np.where((s >= low) & (s <= high) | ~crosses, s, 0.5 * (low + high))
            if not np.any(np.abs(step) > _CLOSE):
                break
        return s


def _powers(u: FloatArray, count: int) -> FloatArray:
    """(count, E) powers 0, 1, ... of u (E,), twice as many in each pass."""
    powers = np.empty((count, u.size))
    powers[0], known, factor = 1.0, 1, u
    while known < count:
        more = min(known, count - known)
        np.multiply(powers[:more], factor, out=powers[known : known + more])
        known += more
        factor = factor * factor
    return powers


def _sum(coefficients: FloatArray, powers: FloatArray) -> FloatArray:
    """(E,) values of polynomials."""
    return np.asarray(np.einsum("pe,pe->e", coefficients, powers))


def windows(block: FloatArray, row: IntArray, near: FloatArray) -> Polynomials:
    """Polynomials through the ten samples about a place.

    Parameters
    ----------
    block : (B, m+1) rows of even samples, m + 1 >= POINTS
    row : (E,) row of each event
    near : (E,) place of each event [samples]; the window is pushed inside the row
    """
    first = np.clip(np.ceil(near - 0.5 * POINTS).astype(np.int64), 0, block.shape[-1] - POINTS)
    base = row * block.shape[-1] + first
    samples = block.reshape(-1)[base + np.arange(POINTS)[:, None]]
    return Polynomials(_FIT @ samples, np.asarray(first + _HALF, dtype=np.float64))


@dataclass(frozen=True, eq=False)
class Extremes:
    """Local maxima between the samples, one per event (E,): row, place [samples] and value."""

    row: IntArray
    place: FloatArray
    value: FloatArray


def local_maxima(
    signal: FloatArray, floor: FloatArray, noise: FloatArray, signed: FloatArray | None = None
) -> Extremes:
    """Refine every sampled local maximum that reaches the floor of its signal.

    Parameters
    ----------
    signal : (B, S, m+1) rows of even samples; the last sample of a block is the first of the next
    floor : (B,) sampled maxima below it are left out
    noise : (B,) a sample stands out when it exceeds one of its neighbours by more than this
    signed : (B, S, m+1) where `signal` is a magnitude, the smooth signal that it is the magnitude of

    Returns
    -------
    Extremes, rows counted over B S; no value is below the sample it was found from
    """
    blocks, samples = signal.shape[-2:]
    index = np.flatnonzero(_sampled_tops(signal, floor))
    row, k = np.divmod(index, samples)
    # The neighbour across the joint of two blocks is two places off: the joint is there twice.
    back = np.where(k > 0, 1, np.where(row % blocks > 0, 2, 0))
    ahead = np.where(k < samples - 1, 1, np.where(row % blocks < blocks - 1, 2, 0))
    flat = signal.reshape(-1)
    here, before, after = flat[index], flat[index - back], flat[index + ahead]
    stands = (here >= before) & (here >= after) & (here - np.minimum(before, after) > noise[row // blocks])
    index, row, at = index[stands], row[stands], k[stands].astype(float)
    here, before, after = here[stands], before[stands], after[stands]
    rows = (signal if signed is None else signed).reshape(-1, samples)
    curve = windows(rows, row, at)
    if signed is not None:
        curve = curve.times(np.sign(signed.reshape(-1)[index]))
    low, high = np.maximum(at - 1.0, 0.0), np.minimum(at + 1.0, samples - 1.0)
    vertex = at + 0.5 * (after - before) / (2.0 * here - before - after)
    place = curve.derivative().root(low, high, np.clip(vertex, low, high))
    value = curve.value(place)
    better = value > here
    return Extremes(row, np.where(better, place, at), np.where(better, value, here))


def _sampled_tops(signal: FloatArray, floor: FloatArray) -> BoolArray:
    """(B S (m+1),) mask of the samples that reach the floor and that no sample beside them exceeds.

    Compared as one long row, which is what the processor likes best; where two signals meet nothing is compared.
    The joint of two blocks stands there twice, so that it is compared with one neighbour only.
    """
    flat = signal.reshape(-1)
    length = signal.shape[-2] * signal.shape[-1]
    tops = (signal.reshape(len(signal), length) >= floor[:, None]).reshape(-1)
    rises, falls = flat[1:] >= flat[:-1], flat[:-1] >= flat[1:]
    rises[length - 1 :: length] = falls[length - 1 :: length] = True
    tops[1:] &= rises
    tops[:-1] &= falls
    return np.asarray(tops)


def crossings(block: FloatArray, row: IntArray, before: IntArray, level: FloatArray) -> FloatArray:
    """(E,) places [samples] where rows cross their level between samples `before` and ``before + 1``."""
    low = before.astype(float)
    curve = windows(block, row, low + 0.5).minus(level)
    ends = curve.value(low), curve.value(low + 1.0)
    rise = ends[1] - ends[0]
    start = low + np.clip(-ends[0] / np.where(rise == 0.0, np.inf, rise), 0.0, 1.0)
    return curve.root(low, low + 1.0, start)


@lru_cache(maxsize=16)
def interval_integrals(intervals: int) -> FloatArray:
    """(m+1, m) matrix: samples to the integral over each interval, in sample steps.

    The integral of the polynomial through the ten samples about the interval: exact up to degree nine, and on
    samples that resolve a signal within 1e-9 of it. Its row sums are the weights of the whole block.
    """
    k = np.arange(intervals)
    first = np.clip(k - POINTS // 2 + 1, 0, intervals + 1 - POINTS)
    low, high = (k - first - _HALF) / _HALF, (k + 1 - first - _HALF) / _HALF
    degree = np.arange(1, POINTS + 1)
    moments = _HALF * (high[:, None] ** degree - low[:, None] ** degree) / degree
    matrix = np.zeros((intervals + 1, intervals))
    matrix[first[:, None] + np.arange(POINTS), k[:, None]] = moments @ _FIT
    matrix.flags.writeable = False
    return np.asarray(matrix)


def sign_changes(block: FloatArray, noise: FloatArray) -> BoolArray:
    """(B, m) intervals at whose ends the signal has opposite signs, one of them beyond the noise (B,)."""
    clear = np.abs(block) > noise[:, None]
    opposite = (block[:, :-1] > 0.0) != (block[:, 1:] > 0.0)
    return np.asarray(opposite & (clear[:, :-1] | clear[:, 1:]) & (block[:, :-1] != 0.0) & (block[:, 1:] != 0.0))
