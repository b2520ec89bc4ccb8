"""Step responses of loops with transport delays.

The first delays are exact (`design.delay.first_delays`). Then each delay goes on as a chain of states
(`design.delay.with_pade`) that starts from what the delay really holds: the commands of the delay before, which are
smooth by then. With `DELAYS` exact ones and `ORDER` states, the largest error over the largest change, after a step of
the aileron's reference of tab-only loops of the wind-tunnel example with every kind of tab drive:

========= ===== ===== =====
delay     da    dt    T_t
========= ===== ===== =====
to 5 ms   1e-11 1e-11 3e-8
15 ms     5e-12 6e-10 6e-7
50 ms     3e-9  2e-7  4e-5
========= ===== ===== =====
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from design.delay.characteristic import SHORTEST
from design.delay.first_delays import LENGTH, FirstDelays
from design.delay.pade import delay_chain
from design.delay.with_pade import ORDER, without_delay
from design.loop import Loop
from design.response.graded import RESOLUTION, GradedStates, graded_states
from design.response.step_response import Response, step_response
from design.response.transition import transition
from model.arrays import BoolArray, FloatArray

#: Delays that are followed exactly.
DELAYS = 3
#: Nodes of the quadrature that takes what a delay holds to its chain.
NODES = 32


@dataclass(frozen=True, eq=False)
class PhasedStates(GradedStates):
    """States on blocks of even samples of which the first ones are exact delays, each its own blocks.

    Attributes
    ----------
    block_starts, block_steps : (S,) time of the first sample and sample step of each block [s]
    """

    block_starts: tuple[float, ...]
    block_steps: tuple[float, ...]

    @property
    def steps(self) -> FloatArray:
        """(S,) sample step of each block [s]."""
        return np.array(self.block_steps)

    @property
    def times(self) -> FloatArray:
        """(S, m+1) sample times [s]."""
        return np.array(self.block_starts)[:, None] + self.steps[:, None] * np.arange(self.intervals + 1)


@dataclass(frozen=True, eq=False)
class DelayedResponse(Response):
    """Response to a step of the references of a loop with delays, from trim at t = 0.

    All that `Response` says holds. In the exact delays the states of the chains are such that ``rows z`` and
    ``rows generator z`` are the outputs and their rates; they do not follow the generator.

    Attributes
    ----------
    first : the exact delays
    chain_start : end of them [s]
    handed_over : (*G, n+1) ``z = [x, 1]`` there
    """

    first: FirstDelays
    chain_start: float
    handed_over: FloatArray

    @cached_property
    def graded(self) -> GradedStates:
        """The same response on a mesh: the exact delays, each in blocks of its own, and what follows."""
        A, x, b = self.generator[..., :-1, :-1], self.handed_over[..., :-1], self.generator[..., :-1, -1]
        # What has changed since the hand-over is a response from rest, to the rates that there were then.
        since = np.zeros_like(self.generator)
        since[..., :-1, :-1], since[..., :-1, -1] = A, (A @ x[..., None])[..., 0] + b
        late = graded_states(since, self.poles, self.duration - self.chain_start)
        z = late.states.copy()
        z[..., :-1] += x[..., None, None, :]
        delays, m = round(self.chain_start / self.first.delay), late.intervals
        blocks = delays * int(np.ceil(self.first.pieces * LENGTH / (m * RESOLUTION)))
        step = self.chain_start / (blocks * m)
        starts = m * step * np.arange(blocks)
        time = starts[:, None] + step * np.arange(m + 1)
        ends = np.broadcast_to(np.arange(m + 1) == m, time.shape)
        early = _early_states(self.first, self.generator.shape[-1], time.reshape(-1), ends.reshape(-1))
        early = early.reshape(*early.shape[:-2], blocks, m + 1, early.shape[-1])
        return PhasedStates(
            np.concatenate([early, z], axis=-3), self.duration,
            (*starts, *(self.chain_start + late.times[:, 0])), (*(step,) * blocks, *late.steps),
        )  # fmt: skip


def delayed_step_response(loop: Loop, reference: FloatArray, duration: float, samples: int = 501) -> Response:
    """Response to a step of the references at t = 0, the delays included.

    Outputs that jump, or bend, when a command arrives do so in the samples. Metrics are taken of it together with
    the loop that has chains for delays: ``step_metrics(without_delay(loop), response, ...)``.

    Parameters
    ----------
    loop : closed loops over the grid; every number finite (leave failed points out with ``loop.take``)
    reference : (p,) or (*G, p) step of each reference [rad]
    duration : length of the response [s], longer than the delay; the figures above are for more than `DELAYS` of them
    samples : number of samples T, both ends included

    Returns
    -------
    Response; its states are those of `without_delay`. Without a delay, that of `step_response`. Where two inputs have
    different delays no delay is exact, and the chains start empty

    Raises
    ------
    ValueError : duration not finite or not longer than the delay, fewer than two samples, or a reference of the wrong
        shape
    """
    delays = {delay for delay in loop.delay if delay > SHORTEST}
    chained = without_delay(loop)
    if len(delays) != 1:
        return step_response(chained, reference, duration, samples)
    delay = delays.pop()
    if not delay < duration < np.inf:
        raise ValueError(f"a response must be longer than the delay, {delay} s, and finite, got {duration} s")
    if samples < 2:
        raise ValueError(f"a response needs at least two samples, got {samples}")
    frame = step_response(chained, reference, duration, 2)
    count = min(DELAYS, max(1, int(np.ceil(duration / delay * (1.0 - 1e-9))) - 1))
    first = FirstDelays.of(loop, frame.reference, count)
    start = first.delay * first.states.shape[-4]
    handed_over = _handed_over(first)
    time = np.linspace(0.0, duration, samples)
    late = int(np.searchsorted(time, start - 1e-12 * duration))
    early = _early_states(first, handed_over.shape[-1], time[:late], np.zeros(late, dtype=bool))
    with np.errstate(over="ignore", invalid="ignore"):
        begin = transition(frame.generator, max(float(time[late]) - start, 0.0)) @ handed_over[..., None]
        step = transition(frame.generator, duration / (samples - 1))
        z = np.concatenate([early, _followed(step, begin[..., 0], samples - late)], axis=-2)
        outputs = (frame.rows @ z.swapaxes(-1, -2)).swapaxes(-1, -2)
    return DelayedResponse(
        time=np.broadcast_to(time, (*outputs.shape[:-2], samples)), states=z[..., :-1], outputs=outputs,
        reference=frame.reference, generator=frame.generator, rows=frame.rows, names=frame.names,
        duration=frame.duration, first=first, chain_start=start, handed_over=handed_over,
    )  # fmt: skip


def _early_states(first: FirstDelays, size: int, time: FloatArray, before: BoolArray) -> FloatArray:
    """(*G, T, size) ``z = [x, chains, 1]`` at times (T,) within the exact delays, `before` the corner or after it.

    The chains' states are the smallest that yield the command that arrives and its first two derivatives: with
    ``delay z' = A z + b u``,  ``v = c z``,  ``delay v' = c A z + c b u``,
    ``delay^2 v'' = c A^2 z + c A b u + c b delay u'``.
    """
    chain, moments = delay_chain(ORDER), first.moments(time, before)
    v, u = first.arriving_at(moments, 3), first.commands_at(moments, 2)
    observed = np.stack([chain.c, chain.c @ chain.A, chain.c @ chain.A @ chain.A])
    direct = np.array([[0.0, 0.0], [chain.c @ chain.b, 0.0], [chain.c @ chain.A @ chain.b, chain.c @ chain.b]])
    held = np.linalg.pinv(observed) @ (v - direct @ u)  # (*G, T, ORDER, m)
    z = np.ones((*v.shape[:-2], size))
    n = first.states.shape[-1]
    z[..., :n] = first.states_at(moments)
    z[..., n:-1] = held.swapaxes(-1, -2).reshape(*v.shape[:-2], -1)
    return z


def _handed_over(first: FirstDelays) -> FloatArray:
    """(*G, n+1) ``z = [x, chains, 1]`` at the end of the exact delays: the chains hold the commands of the last one."""
    nodes, weights = leggauss(NODES)
    part = 0.5 * (1.0 + nodes)  # of a delay, backwards from its end
    count = first.states.shape[-4]
    sent = first.commands_at(first.moments(first.delay * (count - part)), 1)[..., 0, :]
    basis = legvander(nodes, ORDER - 1) * np.sqrt(2.0 * np.arange(ORDER) + 1.0)
    held = np.einsum("ti,...tm->...mi", basis * (0.5 * weights)[:, None], sent)
    grid = held.shape[:-2]
    return np.concatenate([first.end, held.reshape(*grid, -1), np.ones((*grid, 1))], axis=-1)


def _followed(step: FloatArray, z: FloatArray, samples: int) -> FloatArray:
    """(*G, T, n+1) ``z_k = step^k z`` from z (*G, n+1), each pass doubling the number of known samples."""
    followed = np.empty((*z.shape[:-1], samples, z.shape[-1]))
    followed[..., 0, :], known, power = z, 1, step
    while known < samples:
        more = min(known, samples - known)
        np.matmul(followed[..., :more, :], power.swapaxes(-1, -2), out=followed[..., known : known + more, :])
        known += more
        if known < samples:
            power = power @ power
    return followed
