"""The step response of a coded loop, exact at and between its samples.

Between two arrivals of commands nothing but the plant moves, ``z' = M z`` with ``z = [x, v, 1]``. Each sample is cut
where a command arrives, and each part is filled with even points by matrix exponentials, close enough for the fastest
mode of the plant, so that a polynomial through ten of them is the response. Signals may jump, and bend, between two
parts, never within one: what reads the graded mesh of continuous responses reads these parts as its blocks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.lqr.coded_loop import WHOLE, CodedLoop
from design.response.extremes import NOISE
from design.response.graded import RESOLUTION, GradedStates
from design.response.interpolant import POINTS
from design.response.step_response import Response
from design.response.transition import transition
from model.arrays import ComplexArray, FloatArray, IntArray

#: Bounds of the intervals of a part; the upper one is reached only by a mode that is over within a part of the part.
FEWEST_INTERVALS, MOST_INTERVALS = POINTS, 1280


@dataclass(frozen=True, eq=False)
class HeldStates(GradedStates):
    """States between the samples, in blocks: the parts of each sample, one after the other.

    Attributes
    ----------
    states : (*G, S J, m+1, n+m+1) of z: S samples of J parts of m intervals
    breaks : where the J parts begin, in samples, 0 first
    """

    breaks: tuple[float, ...]

    @property
    def steps(self) -> FloatArray:
        """(S J,) step of each block [s]."""
        lengths = np.diff((*self.breaks, 1.0)) * (self._sample_time / self.intervals)
        return np.tile(lengths, self._samples)

    @property
    def times(self) -> FloatArray:
        """(S J, m+1) times [s]."""
        starts = (np.arange(self._samples)[:, None] + np.array(self.breaks)).reshape(-1) * self._sample_time
        return np.asarray(starts[:, None] + self.steps[:, None] * np.arange(self.intervals + 1))

    def signals(self, rows: FloatArray) -> FloatArray:
        """(*G, q, S J, m+1) of ``rows z`` for rows (*G, q, n+m+1); what does not jump is the same on both sides."""
        signals = super().signals(rows)
        before, after = signals[..., :-1, -1], signals[..., 1:, 0]
        with np.errstate(invalid="ignore"):
            size = np.max(np.abs(signals), axis=(-2, -1))[..., None]
            before[...] = np.where(np.abs(before - after) <= NOISE * size, after, before)
        return signals

    @property
    def _samples(self) -> int:
        return self.blocks // len(self.breaks)

    @property
    def _sample_time(self) -> float:
        return self.duration / self._samples


@dataclass(frozen=True, eq=False)
class SampledResponse(Response):
    """Response of a coded loop to a step of its references that it meets at the sample t = 0, from trim.

    As in `Response`, with samples where the code has them; outputs there are those after a command has arrived. The
    states are those of the plant, x. M and R are those of ``z = [x, v, 1]`` while no command arrives.

    Attributes
    ----------
    held : the response between the samples
    closed_poles : (*G, s) poles z of the loop
    settled : (*G, o) what the outputs settle to, trim included; nan where a pole is not inside the unit circle
    """

    held: HeldStates
    closed_poles: ComplexArray
    settled: FloatArray

    @cached_property
    def poles(self) -> ComplexArray:
        """(*G, s) ``ln z / T`` of the poles of the closed loop [1/s]; those at z = 0 are at -inf."""
        step = self.duration / (self.time.shape[-1] - 1)
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.closed_poles) / step)

    @cached_property
    def final_outputs(self) -> FloatArray:
        """(*G, o) `settled`."""
        return self.settled

    @cached_property
    def graded(self) -> GradedStates:
        """`held`: what peaks and integrals are taken of."""
        return self.held


def sampled_step_response(loop: CodedLoop, reference: FloatArray, duration: float) -> SampledResponse:
    """Response to a step of the references that the code meets at t = 0, exact between the samples too.

    The last sample is the first one not before `duration`. In a loop that is sampled, a step between two samples is met
    at the next one.

    Parameters
    ----------
    loop : over the grid, finite
    reference : (p,) or (*G, p) step of each reference [rad]
    duration : length of the response [s]

    Returns
    -------
    SampledResponse. A loop so unstable that it leaves the range of doubles gives inf or nan there, without warning.

    Raises
    ------
    ValueError : duration not positive and finite
    """
    if not 0.0 < duration < np.inf:
        raise ValueError(f"duration must be positive and finite, got {duration} s")
    T = loop.sampling.time
    samples = max(int(np.ceil(duration / T - WHOLE)), 1)
    n, m, grid = len(loop.states), loop.B.shape[-1], loop.A.shape[:-2]
    step = np.broadcast_to(np.asarray(reference, dtype=float), (*grid, loop.E.shape[-1]))
    rows = np.concatenate([loop.C, loop.D, loop.continuous.offset[..., None]], axis=-1)
    with np.errstate(over="ignore", invalid="ignore"):
        s = _at_samples(loop, step, samples + 1)
        breaks, begun = _beginnings(loop, step)
        generator = np.zeros((*grid, n + m + 1, n + m + 1))
        generator[..., :n, :n], generator[..., :n, n : n + m] = loop.A, loop.B
        count = int(intervals(loop).max(initial=FEWEST_INTERVALS))
        parts = [
            _within(generator, (end - start) * T / count, count) @ first[..., None, :, :]
            for start, end, first in zip(breaks, (*breaks[1:], 1.0), begun, strict=True)
        ]
        # (*G, J (m+1) (n+m+1), s+1): every entry of z at every point of a sample, from the states at its beginning.
        within = np.stack(parts, axis=-4).reshape(*grid, -1, s.shape[-1])
        z = s[..., :-1, :] @ within.swapaxes(-1, -2)
        at_samples = s @ begun[0].swapaxes(-1, -2)
        outputs = (rows @ at_samples.swapaxes(-1, -2)).swapaxes(-1, -2)
    poles = np.linalg.eigvals(loop.closed).astype(complex)
    held = HeldStates(z.reshape(*grid, samples * len(breaks), count + 1, n + m + 1), samples * T, breaks)
    return SampledResponse(
        time=np.broadcast_to(T * np.arange(samples + 1), (*grid, samples + 1)),
        states=s[..., :n],
        outputs=outputs,
        reference=step,
        generator=generator,
        rows=rows,
        names=loop.continuous.outputs,
        duration=samples * T,
        held=held,
        closed_poles=poles,
        settled=_settled(loop, step, rows, poles),
    )


def breaks_of(loop: CodedLoop) -> tuple[float, ...]:
    """Where commands arrive within a sample, in samples from its beginning, 0 first."""
    samples = [each / loop.sampling.time for each in loop.delay]
    parts = [each - round(each) if abs(each - round(each)) <= WHOLE else each % 1.0 for each in samples]
    return (0.0, *sorted({part for part in parts if part > WHOLE}))


def intervals(loop: CodedLoop) -> IntArray:
    """(*G,) intervals that a part of a sample needs: a mode of the plant moves by `RESOLUTION` at most in each."""
    longest = float(np.diff((*breaks_of(loop), 1.0)).max()) * loop.sampling.time
    turns = np.abs(np.linalg.eigvals(loop.A)).max(axis=-1) * longest / RESOLUTION
    doublings = np.ceil(np.log2(np.maximum(turns / FEWEST_INTERVALS, 1.0)))
    return np.asarray(np.minimum(FEWEST_INTERVALS * 2.0**doublings, MOST_INTERVALS), dtype=np.int64)


def _at_samples(loop: CodedLoop, step: FloatArray, samples: int) -> FloatArray:
    """States (*G, S, s+1) of ``[s, 1]`` at the samples, each pass doubling the number of known ones."""
    *grid, size, _ = loop.F.shape
    power = np.zeros((*grid, size + 1, size + 1))
    power[..., :size, :size], power[..., size, size] = loop.closed, 1.0
    power[..., :size, size] = np.einsum("...np,...p->...n", loop.reference_input, step)
    s = np.zeros((*grid, samples, size + 1))
    s[..., 0, -1] = 1.0
    known = 1
    while known < samples:
        more = min(known, samples - known)
        s[..., known : known + more, :] = s[..., :more, :] @ power.swapaxes(-1, -2)
        known += more
        power = power @ power
    return s


def _beginnings(loop: CodedLoop, step: FloatArray) -> tuple[tuple[float, ...], list[FloatArray]]:
    """Where the parts of a sample begin [samples], and the maps (*G, n+m+1, s+1) from ``[s, 1]`` to z there."""
    n, m, breaks = len(loop.states), loop.B.shape[-1], breaks_of(loop)
    *grid, size, _ = loop.F.shape
    command = np.concatenate([-loop.K, np.einsum("...mp,...p->...m", loop.N, step)[..., None]], axis=-1)
    first = np.concatenate([[0], np.cumsum(loop.waiting)[:-1]]).astype(int) + n
    begun: list[FloatArray] = []
    for j, start in enumerate(breaks):
        map_to = np.zeros((*grid, n + m + 1, size + 1))
        map_to[..., -1, -1] = 1.0
        if j == 0:
            map_to[..., :n, :n] = np.eye(n)
        else:
            generator = np.concatenate([loop.A, loop.B], axis=-1)
            both = np.zeros((*grid, n + m, n + m))
            both[..., :n, :] = generator
            moved = transition(both, (start - breaks[j - 1]) * loop.sampling.time)
            map_to[..., :n, :] = moved[..., :n, :] @ begun[-1][..., : n + m, :]
        for i, delay in enumerate(loop.delay):
            # How many samples ago the command was made that is there now.
            age = int(np.ceil(delay / loop.sampling.time - start - WHOLE))
            if age == 0:
                map_to[..., n + i, :] = command[..., i, :]
            else:
                map_to[..., n + i, first[i] + age - 1] = 1.0
        begun.append(map_to)
    return breaks, begun


def _within(generator: FloatArray, step: float, count: int) -> FloatArray:
    """(*G, m+1, k, k) ``exp(generator i step)`` for i from 0 to m."""
    size = generator.shape[-1]
    powers = np.empty((*generator.shape[:-2], count + 1, size, size))
    powers[..., 0, :, :] = np.eye(size)
    known, power = 1, transition(generator, step)
    while known <= count:
        more = min(known, count + 1 - known)
        powers[..., known : known + more, :, :] = power[..., None, :, :] @ powers[..., :more, :, :]
        known += more
        power = power @ power
    return powers


def _settled(loop: CodedLoop, step: FloatArray, rows: FloatArray, poles: ComplexArray) -> FloatArray:
    """(*G, o) outputs at rest; nan where a pole is not inside the unit circle."""
    n, size = len(loop.states), loop.F.shape[-1]
    stable = np.abs(poles).max(axis=-1) < 1.0
    at_rest = np.where(stable[..., None, None], np.eye(size) - loop.closed, np.eye(size))
    s = np.linalg.solve(at_rest, np.einsum("...np,...p->...n", loop.reference_input, step)[..., None])
    command = np.einsum("...mp,...p->...m", loop.N, step)[..., None] - loop.K @ s
    values = rows[..., :n] @ s[..., :n, :] + rows[..., n:-1] @ command
    return np.where(stable[..., None], values[..., 0] + rows[..., -1], np.nan)
