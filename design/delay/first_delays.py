"""The first few delays after a step, exactly: one delay after the other, by Taylor series (the method of steps).

Until the first delay is over nothing that was commanded has arrived, and the loop is open. In each delay after that
the command that arrives is known from the one before it. The corners that a step makes travel around the loop in this
time and are rounded off each time they pass its actuator; no approximant of the delay follows them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.characteristic import SHORTEST
from design.loop import Loop
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Terms of a series, and the largest ``|pole|`` times its length [rad]: the first that is left out is 1e-15 of a mode.
TERMS, LENGTH = 20, 1.5
#: Times this near, as a part of a piece, are the same.
NEAR = 1e-9


@dataclass(frozen=True, eq=False)
class Moments:
    """Times (T,): in which delay, in which piece of it, and how far into the piece, 0 to 1."""

    delay: IntArray
    piece: IntArray
    part: FloatArray


@dataclass(frozen=True, eq=False)
class FirstDelays(GridArrays):
    """States and arriving commands over a few delays, for inputs that all have the same one or none.

    Attributes
    ----------
    states : (*G, P, S, TERMS, n) coefficients of the states, by falling power of the time since the piece began, over
        its length; a delay has S pieces, and there are P delays
    commands : (*G, P, S, TERMS, m) those of the commands before their delay, of the inputs `late`
    late : (m,) indices of the inputs that have the delay
    delay : [s]
    """

    states: FloatArray
    commands: FloatArray
    late: tuple[int, ...]
    delay: float

    @classmethod
    def of(cls, loop: Loop, step: FloatArray, count: int) -> FirstDelays:
        """The first `count` delays after steps (*G, p) of the references of a loop at rest."""
        delay = max(loop.delay)
        late = [i for i, each in enumerate(loop.delay) if each > SHORTEST]
        prompt = [i for i, each in enumerate(loop.delay) if each <= SHORTEST]
        A = loop.A - loop.B[..., prompt] @ loop.K[..., prompt, :]
        B, K = loop.B[..., late], loop.K[..., late, :]
        driven = _times(loop.E + loop.B[..., prompt] @ loop.N[..., prompt, :], step)
        commanded = _times(loop.N[..., late, :], step)
        fastest = float(np.abs(np.linalg.eigvals(A)).max(initial=0.0))
        pieces = max(1, int(np.ceil(fastest * delay / LENGTH)))
        length = delay / pieces
        states = np.zeros((*A.shape[:-2], count, pieces, TERMS, A.shape[-1]))
        commands = np.zeros((*states.shape[:-1], len(late)))
        x = np.zeros(A.shape[:-1])
        for d, s in np.ndindex(count, pieces):
            arriving = commands[..., d - 1, s, :, :] if d else np.zeros((*commands.shape[:-4], TERMS, len(late)))
            term = x
            for k in range(TERMS):
                at = TERMS - 1 - k
                states[..., d, s, at, :] = term
                commands[..., d, s, at, :] = (commanded if k == 0 else 0.0) - _times(K, term)
                rate = _times(A, term) + _times(B, arriving[..., at, :]) + (driven if k == 0 else 0.0)
                term = rate * (length / (k + 1))
            x = states[..., d, s, :, :].sum(axis=-2)
        return cls(states, commands, tuple(late), delay)

    @property
    def pieces(self) -> int:
        """Number S of pieces of a delay; no mode goes further than LENGTH in one."""
        return int(self.states.shape[-3])

    @property
    def end(self) -> FloatArray:
        """(*G, n) states when the last of the delays is over."""
        return np.asarray(self.states[..., -1, -1, :, :].sum(axis=-2))

    def states_at(self, moments: Moments) -> FloatArray:
        """(*G, T, n) states."""
        return self._evaluated(self.states, moments, 1)[..., 0, :]

    def commands_at(self, moments: Moments, order: int) -> FloatArray:
        """(*G, T, order, m) commands before their delay, and derivatives times powers of the delay."""
        return self._evaluated(self.commands, moments, order)

    def arriving_at(self, moments: Moments, order: int) -> FloatArray:
        """(*G, T, order, m) commands that arrive, and derivatives times powers of the delay."""
        nothing = np.zeros_like(self.commands[..., :1, :, :, :])
        return self._evaluated(np.concatenate([nothing, self.commands[..., :-1, :, :, :]], axis=-4), moments, order)

    def _evaluated(self, coefficients: FloatArray, moments: Moments, order: int) -> FloatArray:
        """(*G, T, order, c) values and derivatives of (*G, P, S, TERMS, c), a piece at a time."""
        powers = np.arange(TERMS - 1, -1, -1)
        found = np.empty((*coefficients.shape[:-4], moments.part.size, order, coefficients.shape[-1]))
        index = moments.delay * self.pieces + moments.piece
        for here in set(index.tolist()):
            at = index == here
            series = coefficients[..., here // self.pieces, here % self.pieces, :, :]
            factor = np.ones(TERMS)
            for k in range(order):
                falling = moments.part[at, None] ** np.maximum(powers - k, 0) * factor
                found[..., at, k, :] = falling @ series
                factor = factor * (powers - k) * self.pieces
        return found

    def moments(self, time: FloatArray, before: BoolArray | bool = False) -> Moments:
        """Where times (T,) from 0 to the end [s] are; at a corner, in what follows it or in what was `before` (T,)."""
        passed = time / self.delay * self.pieces
        whole = np.where(before, np.ceil(passed - NEAR) - 1.0, np.floor(passed + NEAR)).astype(np.int64)
        whole = np.clip(whole, 0, self.states.shape[-4] * self.pieces - 1)
        return Moments(whole // self.pieces, whole % self.pieces, passed - whole)


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
