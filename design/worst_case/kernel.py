"""What is left of a step response: the one function of time that says what the worst reference is.

An output that a reference r reaches through states at rest before, s seconds after it moved, is::

    y(T) = D r(T) + int_0^inf g(s) r(T - s) ds ,      g(s) = c exp(A s) b
         = (D + gamma(0)) r(T) - int_0^inf gamma(s) r'(T - s) ds ,      gamma(s) = int_s^inf g

gamma is what the step response still has to go. It falls where g > 0, its total variation is the L1 norm of g, and
between two zeros of g it is monotone: those zeros are nodes of every mesh here, so sums over nodes are integrals.
Times are parts of the horizon, which is so long that what lies beyond is a bounded remainder.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from design.response.graded import GradedStates, graded_states
from design.response.interpolant import crossings, interval_integrals, sign_changes, windows
from model.arrays import FloatArray, GridArrays, IntArray

#: Time constants of the slowest mode after which the rest is bounded, not followed: exp(-20) = 2e-9.
TIME_CONSTANTS = 20.0
#: How far off polynomials between samples, and zeros found on them, may put the variation of gamma: a part of it.
INTERPOLATION = 1e-7
#: Swings of g that stay below this part of its largest are not told from rounding; they count as an error.
NOISE = 1e-12
#: Remainders are differences, known to fewer digits: a part of them is added.
_IN_HAND = 1.01
#: Newton's steps after a crossing has been found in its bracket.
_POLISH = 3
#: Intervals of the coarse mesh in each block, and between two zeros of g.
_IN_BLOCK, _IN_SWING = 8, 4


@dataclass(frozen=True, eq=False)
class Samples(GridArrays):
    """gamma on graded meshes over the horizon, N of them in one row, all with as many blocks and samples.

    Attributes
    ----------
    value : (N, S, m+1) gamma
    area : (N, S, m+1) ``int_0^t gamma``, in horizons
    zeros : (N, K) times of the zeros of g in order, filled up with 1
    horizon : (N,) length of the mesh [s]
    error : (N,) bounds of what `nodes` miss of the variation of gamma
    beyond : (N,) bounds of ``int |g|`` beyond the horizon
    area_beyond : (N,) bounds of ``int |gamma|`` beyond the horizon, in horizons
    """

    value: FloatArray
    area: FloatArray
    zeros: FloatArray
    horizon: FloatArray
    error: FloatArray
    beyond: FloatArray
    area_beyond: FloatArray

    @property
    def step(self) -> FloatArray:
        """(S,) sample step of each block, in horizons: that of `design.response.graded`."""
        blocks, samples = self.value.shape[-2:]
        return np.asarray(0.5 ** np.minimum(blocks - np.arange(blocks), blocks - 1) / (samples - 1))

    @property
    def start(self) -> FloatArray:
        """(S,) first time of each block, in horizons."""
        return np.append(0.0, np.cumsum(self.step * (self.value.shape[-1] - 1))[:-1])

    @property
    def nodes(self) -> FloatArray:
        """(N, k+1) times of a coarse mesh in order, from 0 to 1; the last ones may be equal.

        Some in each block, for modes that fade, the zeros of g, and some between every two of them, for modes that
        oscillate.
        """
        length = self.step * (self.value.shape[-1] - 1)
        even = (self.start[:, None] + length[:, None] * (np.arange(_IN_BLOCK) / _IN_BLOCK)).reshape(-1)
        shared = np.broadcast_to(np.append(even, 1.0), (len(self.zeros), even.size + 1))
        ends = np.zeros((len(self.zeros), 1))
        zeros = np.concatenate([ends, self.zeros, ends + 1.0], axis=-1)
        between = zeros[:, :-1, None] + np.diff(zeros)[..., None] * (np.arange(1, _IN_SWING) / _IN_SWING)
        return np.sort(np.concatenate([shared, self.zeros, between.reshape(len(zeros), -1)], axis=-1), axis=-1)

    def at(self, row: IntArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of gamma and of ``int_0^t gamma`` (E,) of some rows (E,) at times (E,) of the horizon."""
        samples = self.value.shape[-1]
        block = self._block(time)
        place = np.clip((time - self.start[block]) / self.step[block], 0.0, samples - 1.0)
        before = np.minimum(np.floor(place), samples - 2.0)
        line = row * len(self.step) + block
        curve = windows(self.value.reshape(-1, samples), line, before + 0.5)
        area = self.area.reshape(-1)[line * samples + before.astype(np.int64)]
        return curve.value(place), area + self.step[block] * curve.integral(before, place)

    def crossing(self, row: IntArray, low: FloatArray, high: FloatArray, level: FloatArray) -> FloatArray:
        """(E,) times at which gamma, monotone from ``low`` to ``high`` (E,), crosses a level (E,) between its ends."""
        samples = self.value.shape[-1]
        times = (self.start[:, None] + self.step[:, None] * np.arange(samples)).reshape(-1)
        values = self.value.reshape(len(self.value), -1)
        rises = self.at(row, high)[0] > self.at(row, low)[0]
        first = np.searchsorted(times, low, side="right") - 1  # the last sample that is not after the crossing
        last = np.maximum(np.searchsorted(times, high, side="left"), first + 1)
        while np.any(last > first + 1):
            middle = (first + last) // 2
            after = (values[row, middle] > level) == rises
            # of two next to each other the middle is the first one, where it stays
            last, first = np.where(after & (middle > first), middle, last), np.where(after, first, middle)
        block = np.minimum(first // samples, len(self.step) - 1)
        line = row * len(self.step) + block
        near = (first - block * samples).astype(float)
        curve = windows(self.value.reshape(-1, samples), line, near + 0.5).minus(level)
        begin, end = ((time - self.start[block]) / self.step[block] for time in (low, high))
        begin, end = np.clip(begin, near, near + 1.0), np.clip(end, near, near + 1.0)
        place, slope = curve.root(begin, end, 0.5 * (begin + end)), curve.derivative()
        for _ in range(_POLISH):  # towards an end of the bracket, where rounding may have hidden the crossing
            change = slope.value(place)
            place = np.clip(place - curve.value(place) / np.where(change == 0.0, np.inf, change), begin, end)
        return np.asarray(np.clip(self.start[block] + self.step[block] * place, low, high))

    def _block(self, time: FloatArray) -> IntArray:
        block = np.searchsorted(self.start, time, side="right") - 1
        return np.asarray(np.clip(block, 0, len(self.step) - 1), dtype=np.int64)


def samples_of(A: FloatArray, b: FloatArray, C: FloatArray) -> Samples:
    """Samples of gamma of the outputs C (o, n) of one stable point, from one reference.

    Parameters
    ----------
    A (n, n), b (n,), C (o, n) : all finite, every mode decays
    """
    n = len(b)
    poles = np.linalg.eigvals(A).astype(np.complex128)
    horizon = TIME_CONSTANTS / float(-poles.real.max())
    generator = np.zeros((n + 1, n + 1))
    generator[:n, :n], generator[:n, n] = A * horizon, b * horizon
    mesh = graded_states(generator, poles * horizon, 1.0)
    rest = np.linalg.solve(A, -b)
    left = np.concatenate([-C, (C @ rest)[:, None]], axis=-1)
    value = mesh.signals(left)
    area = np.zeros_like(value)
    area[..., 1:] = np.cumsum((value @ interval_integrals(mesh.intervals)) * mesh.steps[:, None], axis=-1)
    area[..., 1:, :] += np.cumsum(area[..., :-1, -1:], axis=-2)
    beyond, area_beyond = _beyond(A, C, mesh.states[-1, -1, :n] - rest)
    change = mesh.signals(-left @ generator)
    noise = NOISE * np.abs(change).max(axis=(-2, -1))
    variation = np.abs(np.diff(value)).sum(axis=(-2, -1))
    return Samples(
        value, area, _zeros(mesh, change, noise), np.full(len(C), horizon),
        2.0 * noise + INTERPOLATION * variation, beyond, area_beyond / horizon,
    )  # fmt: skip


def in_one_row(several: list[Samples]) -> Samples:
    """Samples of equal shape in one row."""
    most = max(each.zeros.shape[-1] for each in several)
    zeros = [np.pad(each.zeros, ((0, 0), (0, most - each.zeros.shape[-1])), constant_values=1.0) for each in several]
    value, area, horizon, error, beyond, area_beyond = (
        np.concatenate([getattr(each, name) for each in several])
        for name in ("value", "area", "horizon", "error", "beyond", "area_beyond")
    )
    return Samples(value, area, np.concatenate(zeros), horizon, error, beyond, area_beyond)


def _beyond(A: FloatArray, C: FloatArray, rest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds (o,) of the integrals of ``|c A exp(A s) e|`` and ``|c exp(A s) e|`` over s > 0, e (n,) what is left.

    By Cauchy and Schwarz ``int |h| <= sqrt(1 / 2 beta) sqrt(int h^2 exp(2 beta s))``, for half of the slowest
    decay as beta; the last integral is ``c X c'`` with ``(A + beta I) X + X (A + beta I)' + e e' = 0``.
    """
    beta = -0.5 * float(np.linalg.eigvals(A).real.max())
    X = solve_continuous_lyapunov(A + beta * np.eye(len(A)), -np.outer(rest, rest))
    both = np.stack([C @ A, C])
    squares = np.einsum("koi,ij,koj->ko", both, X, both)
    bound = _IN_HAND * np.sqrt(np.maximum(squares, 0.0) / (2.0 * beta))
    return bound[0], bound[1]


def _zeros(mesh: GradedStates, signal: FloatArray, noise: FloatArray) -> FloatArray:
    """(o, K) where signals (o, S, m+1) change their sign beyond their noise (o,), filled up with 1.

    Pairs of zeros between two samples of the same sign are among them.
    """
    *_, blocks, samples = signal.shape
    flat, small = signal.reshape(-1, samples), np.repeat(noise, blocks)
    row, before = np.nonzero(sign_changes(flat, small))
    place = crossings(flat, row, before, np.zeros(len(row)))
    pairs = _pairs(flat, small)
    row, place = np.concatenate([row, pairs[0]]), np.concatenate([place, pairs[1]])
    output, block = np.divmod(row, blocks)
    order = np.argsort(output, kind="stable")
    output, time = output[order], (mesh.times[:, 0][block] + mesh.steps[block] * place)[order]
    count = np.bincount(output, minlength=len(signal))
    zeros = np.ones((len(signal), int(count.max(initial=0))))
    zeros[output, np.arange(len(output)) - np.repeat(np.cumsum(count) - count, count)] = time
    return zeros


def _pairs(signal: FloatArray, noise: FloatArray) -> tuple[IntArray, FloatArray]:
    """Rows (E,) and places (E,) of zeros that come in pairs between two samples of the same sign.

    The polynomial through the samples turns back towards zero inside such an interval; where its turning point has
    the other sign there is a zero to either side of it.
    """
    here, after = signal[:, :-1], signal[:, 1:]
    same = (here > 0.0) == (after > 0.0)
    size = np.minimum(np.abs(here), np.abs(after))
    # a parabola of the bend that three samples show, with room: intervals it cannot bring to zero are left out
    bend = np.zeros_like(here)
    inner = np.abs(np.diff(signal, 2, axis=-1))
    bend[:, 1:], bend[:, :-1] = inner, np.maximum(bend[:, :-1], inner)
    row, before = np.nonzero(same & (size < bend) & (size > noise[:, None]))
    low = before.astype(float)
    curve = windows(signal, row, low + 0.5)
    slope = curve.derivative()
    turn = slope.root(low, low + 1.0, low + 0.5)
    sign = np.sign(here[row, before])
    hidden = (curve.value(turn) * sign < 0.0) & (slope.value(low) * sign < 0.0) & (slope.value(low + 1.0) * sign > 0.0)
    row, low, turn = row[hidden], low[hidden], turn[hidden]
    curve = windows(signal, row, low + 0.5)
    first, second = curve.root(low, turn, 0.5 * (low + turn)), curve.root(turn, low + 1.0, 0.5 * (low + 1.0 + turn))
    return np.concatenate([row, row]), np.concatenate([first, second])
