"""Exact linear responses of the closed loop to any manoeuvre, for the whole grid at once.

From knot to knot the references are ``r(t) = l(t) + a sin(w t)`` with l' = s, a constant slope. The closed loop, the
references and its outputs are one system that nothing drives, the same from beginning to end, and at each knot l and s
are set anew::

        d  [x]   [Acl  b  0  b a  0] [x]
        -- [l]   [         1       ] [l]                b = E + B N
        dt [s] = [                 ] [s] = M z ,        y = R z ,
           [S]   [               w ] [S]
           [C]   [           -w    ] [C]                R = [C + (F - H K) Acl - D K,  d,  H N,  d a,  H N a w,  y0]
           [1]   [                 ] [1]                d = (F - H K) (E + B N) + D N

S and C being sin(w t) and cos(w t), and ``N r'`` in v' what H takes. What a manoeuvre does not have (slopes, a sine) is
left out. So ``z(t) = exp(M (t - t_k)) z(t_k)`` is exact at every sample, also where Acl is singular; where an output
jumps or bends at a knot, a sample there has the value just after it. Outputs that take v' have an impulse where
``H N r`` jumps, which no sample shows.

Transport delays are chains of states (`design.delay.with_pade`), which hold a course that bends better than one that
jumps. A step alone is better known by `design.delay.step_response`, by which the error of each output, over its largest
change, is in tab-only loops of the wind-tunnel example with a 40 Hz servo or a rate command:

===== ========================= =========================
delay doublet (da, dt, T_t)     rate-limited step
===== ========================= =========================
1 ms  6e-12, 2e-7, 0.009        4e-11, 3e-9, 2e-5
5 ms  6e-10, 6e-6, 0.05         5e-12, 5e-9, 3e-4
15 ms 2e-8, 8e-5, 0.1           5e-11, 1e-7, 1e-3
===== ========================= =========================

T_t is wrong where a corner arrives one delay after a jump, where it is not largest: its peak to 1e-11, 1e-4 and 5e-3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.delay.with_pade import without_delay
from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.response.driven import Driven, begun
from design.response.final_value import decaying, final_values
from design.response.knot_peaks import largest_between_knots
from design.response.stretches import SAME_LENGTH, Stretches
from design.response.transition import transition
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

#: A sample this near before a knot, as a part of the duration, is at the knot.
AT_KNOT = 1e-13
#: Numbers of the transitions that are worked out together.
LARGEST_PART = 1 << 20


@dataclass(frozen=True, eq=False)
class ManoeuvreResponse(GridArrays):
    """Response of a closed loop to a manoeuvre, from trim at t = 0.

    Attributes
    ----------
    time : (*G, T) sample times, evenly spaced from 0 [s]; a view that all points share
    states : (*G, T, n) deviations from trim
    outputs : (*G, T, o) totals, trim values included; just after a knot where they jump there
    references : (*G, T, p) the manoeuvre at the samples [rad]
    generator : (*G, N, N) M of ``z' = M z`` between knots [1/s]
    rows : (*G, o, N) R of ``y = R z``
    reference_rows : (*G, p, N) the references from z; a view that all points share
    last_begun : (*G, n) states at the last knot before the end
    manoeuvre : what is flown
    names, reference_names : name of each output and reference
    duration : time of the last sample [s]
    """

    time: FloatArray
    states: FloatArray
    outputs: FloatArray
    references: FloatArray
    generator: FloatArray
    rows: FloatArray
    reference_rows: FloatArray
    last_begun: FloatArray
    manoeuvre: Manoeuvre
    names: tuple[str, ...]
    reference_names: tuple[str, ...]
    duration: float

    def index(self, name: str) -> int:
        """Index of the named output; ValueError when there is none."""
        if name not in self.names:
            raise ValueError(f"the loop has no output {name!r}; it has {', '.join(self.names)}")
        return self.names.index(name)

    @cached_property
    def poles(self) -> ComplexArray:
        """(*G, n) poles of the closed loop [1/s]."""
        n = self.states.shape[-1]
        return np.linalg.eigvals(self.generator[..., :n, :n]).astype(np.complex128)

    @cached_property
    def final_outputs(self) -> FloatArray:
        """(*G, o) values the outputs settle to; nan where they do not settle.

        After the last knot before the end of the response, however long that takes; a manoeuvre that goes on changing
        from there, by a slope or a sine, lets nothing settle.
        """
        k, n = knots_flown(self.manoeuvre, self.duration) - 1, self.states.shape[-1]
        if np.any(self.manoeuvre.slopes[k]) or np.any(self.manoeuvre.amplitude):
            return np.full(self.rows.shape[:-1], np.nan)
        # What has changed since the knot is a response from rest, to the rates that there are just after it. From where
        # it starts does not matter where all modes die out.
        stable = np.all(decaying(self.poles), axis=-1)
        z = self._begun(k, np.where(stable[..., None], 0.0, self.last_begun))
        since = np.zeros((*self.generator.shape[:-2], n + 1, n + 1))
        since[..., :n, :n] = self.generator[..., :n, :n]
        since[..., :n, n] = (self.generator[..., :n, :] @ z[..., None])[..., 0]
        rows = np.concatenate([self.rows[..., :n], self.rows @ z[..., None]], axis=-1)
        return final_values(since, rows, self.poles)

    @cached_property
    def peaks(self) -> FloatArray:
        """(*G, o) largest magnitude of each output, trim included, between and at the samples."""
        return largest_between_knots(self.driven.signals(self.rows), self.rows.shape[:-1])

    @cached_property
    def driven(self) -> Driven:
        """The same response on samples that follow its fastest mode after every knot: for peaks and integrals."""
        poles = self.poles
        if self.manoeuvre.omega > 0.0:
            # Power has twice the frequency of a sine, as strong at the end as at the beginning.
            poles = np.append(poles, 2j * self.manoeuvre.omega)
        knots = self.manoeuvre.times[: knots_flown(self.manoeuvre, self.duration)]
        stretches = Stretches.between(knots, self.duration, poles)
        begin = driving(self.manoeuvre, np.array(stretches.knots), stretches.starts)
        return Driven(self.generator, poles, stretches, begin, self.duration)

    def _begun(self, k: int, x: FloatArray) -> FloatArray:
        """(*G, N) z just after knot k, where the states are x (*G, n)."""
        e = driving(self.manoeuvre, np.array([k]), self.manoeuvre.times[k : k + 1])[0]
        return np.concatenate([x, np.broadcast_to(e, (*x.shape[:-1], e.size))], axis=-1)


def manoeuvre_response(loop: Loop, manoeuvre: Manoeuvre, duration: float, samples: int = 501) -> ManoeuvreResponse:
    """Response to a manoeuvre of the references from t = 0, exact at the samples.

    Parameters
    ----------
    loop : closed loops over the grid; every number finite (leave failed points out with ``loop.take``)
    manoeuvre : one course of each of the loop's references, the same at all points
    duration : length of the response [s]; what the manoeuvre has then or later is left out, so that the last sample has
        the value before a knot there
    samples : number of samples T, both ends included

    Returns
    -------
    ManoeuvreResponse; of a loop with delays, its states are those of `without_delay`. A loop so unstable that it
    leaves the range of doubles gives inf or nan there, without warning.

    Raises
    ------
    ValueError : duration not positive and finite, fewer than two samples, or a manoeuvre of other references
    """
    if not 0.0 < duration < np.inf:
        raise ValueError(f"duration must be positive and finite, got {duration} s")
    if samples < 2:
        raise ValueError(f"a response needs at least two samples, got {samples}")
    if len(manoeuvre.amplitude) != len(loop.references):
        raise ValueError(f"the loop has {len(loop.references)} references, the manoeuvre {len(manoeuvre.amplitude)}")
    flown = without_delay(loop)
    grid, n = flown.A.shape[:-2], flown.A.shape[-1]
    generator, rows = _system(flown, manoeuvre)
    time = np.linspace(0.0, duration, samples)
    with np.errstate(over="ignore", invalid="ignore"):
        z, last = _followed(generator, n, manoeuvre, time)
        outputs = (rows @ z.swapaxes(-1, -2)).swapaxes(-1, -2)  # each signal contiguous in time
    reference_rows = _reference_rows(manoeuvre, n)
    return ManoeuvreResponse(
        time=np.broadcast_to(time, (*grid, samples)), states=z[..., :n], outputs=outputs,
        references=z[..., n:] @ reference_rows[:, n:].T, generator=generator, rows=rows,
        reference_rows=np.broadcast_to(reference_rows, (*grid, *reference_rows.shape)), last_begun=last,
        manoeuvre=manoeuvre, names=flown.outputs, reference_names=flown.references, duration=float(duration),
    )  # fmt: skip


def knots_flown(manoeuvre: Manoeuvre, duration: float) -> int:
    """How many knots there are before the end of a response [s], at least the first."""
    return int(np.searchsorted(manoeuvre.times, duration * (1.0 - AT_KNOT)))


def driving(manoeuvre: Manoeuvre, knots: IntArray, time: FloatArray) -> FloatArray:
    """(K, e) ``e = [l, s, S, C, 1]`` at times (K,) [s], each with the knot (K,) that it follows."""
    slopes = manoeuvre.slopes[knots]
    parts = [manoeuvre.values[knots] + slopes * (time - manoeuvre.times[knots])[:, None]]
    if np.any(manoeuvre.slopes):
        parts.append(slopes)
    if manoeuvre.omega > 0.0:
        phase = manoeuvre.omega * time[:, None]
        parts += [np.sin(phase), np.cos(phase)]
    return np.concatenate([*parts, np.ones((len(time), 1))], axis=-1)


def _system(loop: Loop, manoeuvre: Manoeuvre) -> tuple[FloatArray, FloatArray]:
    """M (*G, N, N) and R (*G, o, N): closed loop, references and outputs in one."""
    *grid, n, p = loop.E.shape
    b, d, rates = loop.reference_input, loop.reference_feedthrough, loop.H @ loop.N
    a, omega = manoeuvre.amplitude[:, None], manoeuvre.omega
    slopes, sine = bool(np.any(manoeuvre.slopes)), omega > 0.0
    size = n + p * (1 + slopes) + 2 * sine + 1
    M = np.zeros((*grid, size, size))
    M[..., :n, :n], M[..., :n, n : n + p] = loop.closed, b
    columns = [loop.closed_outputs, d]
    if slopes:
        M[..., range(n, n + p), range(n + p, n + 2 * p)] = 1.0
        columns.append(rates)
    if sine:
        M[..., :n, -3:-2] = b @ a
        M[..., -3, -2], M[..., -2, -3] = omega, -omega
        columns += [d @ a, rates @ a * omega]
    return M, np.concatenate([*columns, loop.offset[..., None]], axis=-1)


def _reference_rows(manoeuvre: Manoeuvre, n: int) -> FloatArray:
    """(p, N) the references from z: ``l + a S``."""
    p = len(manoeuvre.amplitude)
    e = driving(manoeuvre, np.array([0]), np.zeros(1)).shape[-1]
    rows = np.zeros((p, n + e))
    rows[:, n : n + p] = np.eye(p)
    if manoeuvre.omega > 0.0:
        rows[:, -3] = manoeuvre.amplitude
    return rows


def _followed(generator: FloatArray, n: int, manoeuvre: Manoeuvre, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States z (*G, T, N) at even times (T,), and x (*G, n) at the last knot before the end."""
    duration, step = float(time[-1]), float(time[1])
    count = knots_flown(manoeuvre, duration)
    knots = manoeuvre.times[:count]
    first = np.searchsorted(time, knots - AT_KNOT * duration)
    samples = np.append(first[1:], len(time)) - first
    lengths = np.append(knots[1:], duration) - knots
    begin = driving(manoeuvre, np.arange(count), knots)
    z = np.empty((*generator.shape[:-2], len(time), generator.shape[-1]))
    x, powers = np.zeros((*generator.shape[:-2], n)), [transition(generator, step)]
    most = max(1, LARGEST_PART // (2 * max(1, generator.size)))
    for low in range(0, count, most):
        part = slice(low, min(low + most, count))
        at_knots, x = begun(_transitions(generator, lengths[part], duration), x, begin[part])
        seen = np.flatnonzero(samples[part])
        since = np.maximum(time[first[part][seen]] - knots[part][seen], 0.0)
        starts = at_knots[..., seen, :]
        if np.any(since > 0.0):
            starts = (_transitions(generator, since, duration) @ starts[..., None])[..., 0]
        z[..., first[part][seen], :] = starts
        for k in part.start + seen[samples[part][seen] > 1]:
            _double(z[..., first[k] : first[k] + samples[k], :], powers)
    return z, at_knots[..., -1, :n]


def _transitions(generator: FloatArray, lengths: FloatArray, duration: float) -> FloatArray:
    """``exp(generator length)`` (*G, u, N, N) for lengths (c,), u = c, or u = 1 where they are all the same."""
    _, first, which = np.unique(np.round(lengths / (SAME_LENGTH * duration)), return_index=True, return_inverse=True)
    chosen = lengths[first]
    longest = max(float(chosen.max()), 1e-300)
    found = transition(generator[..., None, :, :] * (chosen / longest)[:, None, None], longest)
    return found if len(chosen) == 1 else found[..., which, :, :]


def _double(z: FloatArray, powers: list[FloatArray]) -> None:
    """Fill samples (*G, T, N) from the first, each pass twice as many; powers of the transition as they are needed."""
    known, j, samples = 1, 0, z.shape[-2]
    while known < samples:
        if j == len(powers):
            powers.append(powers[-1] @ powers[-1])
        more = min(known, samples - known)
        np.matmul(z[..., :more, :], powers[j].swapaxes(-1, -2), out=z[..., known : known + more, :])
        known, j = known + more, j + 1
