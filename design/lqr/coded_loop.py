"""A plant in continuous time under a controller that is code: gains, integrals, and a memory of its own commands.

At every sample, ``t_k = k T``, the code reads the states x and the references r, updates its integrals and filters by
the trapezoidal rule, and commands ::

    u_k = -K [x_k; integrals_k] - K_held [u_(k-1); u_(k-2); ..] + N r_k

Each command is held for one sample from ``t_k + delay`` on. An integral is updated before it is used,
``int_k = int_(k-1) + T/2 (e_(k-1) + e_k)``; what is carried from sample to sample is ``w_k = int_k - T/2 e_k``, which
obeys ``w_(k+1) = w_k + T e_k`` and begins at 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.estimation.readings import is_controllers
from design.frequency.sampled_loop import Realisation, SampledLoop, sampled_loop, tustin
from design.loop import Loop
from design.sampling import Sampling
from model.arrays import FloatArray, GridArrays

#: A delay this near to whole samples, in samples, is whole.
WHOLE = 2e-9


@dataclass(frozen=True, eq=False)
class CodedLoop(GridArrays):
    """``x' = A x + B v, y = C x + D v + offset``, and from sample to sample ``s_(k+1) = F s_k + G u_k + E r_k``.

    The n states x are the plant's, v is what arrives of the commands u. s is x, then the commands under way, input by
    input the last one first, then the code's integrals and filters. ``u_k = -K s_k + N r_k``.

    Attributes
    ----------
    continuous : the loop that is run as code: its inputs, references, outputs and their offset are those of the code.
        Gains on commands under way are not in it
    A (*G, n, n), B (*G, n, m), C (*G, o, n), D (*G, o, m) : the plant
    F (*G, s, s), G (*G, s, m), E (*G, s, p), K (*G, m, s), N (*G, m, p) : the loop at its samples
    states : names of x
    waiting : commands under way, of each input
    delay : of each input from the measurement to the plant, computation included [s]
    sampling : the controller's
    remembered : the code uses the commands under way: K has more than zeros for them
    """

    continuous: Loop

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    F: FloatArray
    G: FloatArray
    E: FloatArray
    K: FloatArray
    N: FloatArray
    states: tuple[str, ...]
    waiting: tuple[int, ...]
    delay: tuple[float, ...]
    sampling: Sampling
    remembered: bool

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the commands."""
        return self.continuous.inputs

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the references."""
        return self.continuous.references

    @cached_property
    def closed(self) -> FloatArray:
        """``F - G K`` (*G, s, s)."""
        return self.F - self.G @ self.K

    @cached_property
    def reference_input(self) -> FloatArray:
        """``E + G N`` (*G, s, p): how the references drive the closed loop."""
        return self.E + self.G @ self.N

    def opened(self) -> SampledLoop:
        """The loop to be cut at its actuators.

        What changes between the code and the plant, a gain or a lag, is not seen by the code: it goes on remembering
        what it has commanded. So its memory stands beside the commands under way, as states behind all others.
        """
        if not self.remembered:
            return SampledLoop(self.F, self.G, self.K, self.continuous.inputs, self.sampling.time)
        *grid, size, m = self.G.shape
        more, n = sum(self.waiting), len(self.states)
        F, G = np.zeros((*grid, size + more, size + more)), np.zeros((*grid, size + more, m))
        K = np.concatenate([self.K, self.K[..., n : n + more]], axis=-1)
        K[..., n : n + more] = 0.0
        F[..., :size, :size], G[..., :size, :] = self.F, self.G
        first = size
        for i, count in enumerate(self.waiting):
            F[..., first : first + min(count, 1), :] = -K[..., i : i + 1, :]
            for age in range(1, count):
                F[..., first + age, first + age - 1] = 1.0
            first += count
        return SampledLoop(F, G, K, self.continuous.inputs, self.sampling.time)


def coded_loop(loop: Loop, sampling: Sampling, held_gain: FloatArray | None = None) -> CodedLoop:
    """The loop with its controller run as code; without `held_gain` that of `design.sampling.digital_loop`.

    Parameters
    ----------
    loop : over the grid, finite, with the delays of its actuators; the controller's own states become the code's
    sampling : sample time and delay of the computation
    held_gain : (*G, m, d) gains on the commands under way, input by input the last one first; none where None

    Raises
    ------
    ValueError : commands or references drive what they cannot, outputs need more than plant and commands, sample
        time or delay are out of range, `held_gain` has another shape than the commands under way
    """
    inside = [i for i, name in enumerate(loop.states) if is_controllers(name)]
    outside = [i for i in range(len(loop.states)) if i not in inside]
    _check(loop, inside, outside)
    T, n, p = sampling.time, len(outside), len(loop.references)
    delay = command_delays(loop.delay, sampling)
    own = loop.A[..., inside, :]
    code = tustin(
        Realisation(
            A=own[..., inside],
            B=np.concatenate([own[..., outside], loop.E[..., inside, :]], axis=-1),
            C=loop.K[..., inside],
            D=np.concatenate([loop.K[..., outside], -loop.N], axis=-1),
        ),
        T,
    )
    A, B = loop.A[..., outside, :][..., outside], loop.B[..., outside, :]
    from_states = Realisation(code.A, code.B[..., :n], code.C, code.D[..., :n])
    sampled = sampled_loop(A, B, np.eye(n), from_states, T, delay, loop.inputs, 0.0)
    waiting = tuple(int(np.ceil(each / T - WHOLE)) for each in delay)
    K, E, under_way = sampled.K, np.zeros((*sampled.A.shape[:-1], p)), sum(waiting)
    if held_gain is not None:
        if held_gain.shape != (*K.shape[:-1], under_way):
            raise ValueError(f"gains of shape {held_gain.shape} on {under_way} commands under way")
        K = K.copy()
        K[..., n : n + under_way] = held_gain
    E[..., n + under_way :, :] = code.B[..., n:]
    of_rates = loop.F[..., outside]
    return CodedLoop(
        continuous=loop, A=A, B=B, C=loop.C[..., outside] + of_rates @ A, D=loop.D + of_rates @ B,
        F=sampled.A, G=sampled.B, E=E, K=K, N=-code.D[..., n:], states=tuple(loop.states[i] for i in outside),
        waiting=waiting, delay=delay, sampling=sampling, remembered=held_gain is not None and under_way > 0,
    )  # fmt: skip


def command_delays(actuators: tuple[float, ...], sampling: Sampling) -> tuple[float, ...]:
    """Time from a measurement to the arrival of its command [s], of each actuator; nearly whole samples are whole.

    Raises
    ------
    ValueError : the sample time is not positive, a delay is negative or not finite
    """
    T = sampling.time
    if not 0.0 < T < np.inf:
        raise ValueError(f"the sample time must be positive, not {T} s")
    if not (0.0 <= sampling.delay < np.inf and all(0.0 <= each < np.inf for each in actuators)):
        raise ValueError(f"delays of {sampling.delay} s and {actuators} s must be finite and not negative")
    samples = [(each + sampling.delay) / T for each in actuators]
    return tuple((round(s) if abs(s - round(s)) <= WHOLE else s) * T for s in samples)


def _check(loop: Loop, inside: list[int], outside: list[int]) -> None:
    if np.any(loop.B[..., inside, :]) or np.any(loop.A[..., outside, :][..., inside]):
        raise ValueError("a controller's own states act on the plant through the commands only")
    if np.any(loop.E[..., outside, :]):
        raise ValueError("references act on the plant through the commands only")
    if np.any(loop.C[..., inside]) or np.any(loop.F[..., inside]):
        raise ValueError("outputs of the controller's own states are not defined between its samples")
    if np.any(loop.H):
        raise ValueError("an output follows the rate of a command, which a held command does not have")
