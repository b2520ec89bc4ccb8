"""The step response on a mesh that is fine where it is fast: blocks of even samples, each twice as long.

A step excites every mode at t = 0, and the fast ones are gone when the slow ones have hardly begun. Even
samples over the whole response either miss the first or waste thousands on the second. Here block 0 covers
``[0, T / 2^(S-1)]`` and each of the others reaches twice as far as the one before it, all with the same number
of samples: a few hundred samples resolve a 1 kHz actuator in a response of ten seconds. Within a block the
samples are even and so dense that a polynomial through ten of them is the response (`design.response.interpolant`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.response.transition import transition
from model.arrays import ComplexArray, FloatArray, GridArrays

#: Largest |pole| times sample step of a mode that is alive [rad].
RESOLUTION = 0.125
#: Sample intervals of a block and number of blocks where nothing asks for more: every grid whose modes
#: these resolve has the same mesh, so a point's numbers do not depend on its neighbours.
INTERVALS, BLOCKS = 32, 8
#: A mode needs RESOLUTION for no longer than it takes to decay; intervals of a block, times damping ratio.
FADING = 16.0
#: Bounds of the mesh; reached only by a fast mode of next to no damping, or by one beyond all actuators.
LARGEST_INTERVALS, LARGEST_BLOCKS = 4096, 30


@dataclass(frozen=True, eq=False)
class GradedStates(GridArrays):
    """States on the graded mesh.

    Attributes
    ----------
    states : (*G, S, m+1, n+1) of ``z = [x, 1]``: S blocks of m intervals; a block's last sample is the
        first of the next one
    duration : end of the last block [s]
    """

    states: FloatArray
    duration: float

    @property
    def blocks(self) -> int:
        """Number of blocks S."""
        return int(self.states.shape[-3])

    @property
    def intervals(self) -> int:
        """Sample intervals m of each block."""
        return int(self.states.shape[-2]) - 1

    @property
    def steps(self) -> FloatArray:
        """(S,) sample step of each block [s]."""
        return _block_steps(self.duration, self.intervals, self.blocks)

    @property
    def times(self) -> FloatArray:
        """(S, m+1) sample times [s]."""
        steps = self.steps
        starts = self.intervals * steps
        starts[0] = 0.0
        return starts[:, None] + steps[:, None] * np.arange(self.intervals + 1)

    def signals(self, rows: FloatArray) -> FloatArray:
        """(*G, q, S, m+1) of ``rows z`` for rows (*G, q, n+1)."""
        *grid, blocks, samples, size = self.states.shape
        flat = self.states.reshape(*grid, blocks * samples, size)
        with np.errstate(over="ignore", invalid="ignore"):
            signals = rows @ flat.swapaxes(-1, -2)
        return signals.reshape(*grid, rows.shape[-2], blocks, samples)


def graded_states(generator: FloatArray, poles: ComplexArray, duration: float) -> GradedStates:
    """``z(t) = exp(generator t) [0, 1]`` on a graded mesh that resolves these poles.

    Parameters
    ----------
    generator : (*G, n+1, n+1) ``[[A, b], [0, 0]]`` [1/s]
    poles : (*G, n) eigenvalues of A [1/s]
    duration : end of the mesh [s]
    """
    intervals = _needed_intervals(poles, duration)
    blocks = _needed_blocks(poles, duration, intervals)
    passes = intervals.bit_length() - 1
    size = generator.shape[-1]
    chain = np.empty((*generator.shape[:-2], passes + blocks, size, size))
    z = np.zeros((*generator.shape[:-2], blocks, intervals + 1, size))
    with np.errstate(over="ignore", invalid="ignore"):
        chain[..., 0, :, :] = transition(generator, float(_block_steps(duration, intervals, blocks)[0]))
        for j in range(1, passes + blocks):
            np.matmul(chain[..., j - 1, :, :], chain[..., j - 1, :, :], out=chain[..., j, :, :])
        # chain[j] is the transition over 2^j steps of block 0. Block i > 0 has the step of chain[i - 1] and
        # starts where the transition of chain[passes + i - 1] leads, whose last column is exp(M t) [0, 1].
        z[..., 0, 0, -1] = 1.0
        z[..., 1:, 0, :] = chain[..., passes:-1, :, -1]
        z[..., :-1, -1, :] = z[..., 1:, 0, :]
        z[..., -1, -1, :] = chain[..., -1, :, -1]
        for j in range(passes):
            _double(z[..., :1, :, :], chain[..., j : j + 1, :, :], 2**j)
            _double(z[..., 1:, :, :], chain[..., j : j + blocks - 1, :, :], 2**j)
    return GradedStates(z, float(duration))


def _double(z: FloatArray, transitions: FloatArray, known: int) -> None:
    """Fill samples known..2 known - 1 of each block from the known ones, with that block's transition."""
    np.matmul(z[..., :known, :], transitions.swapaxes(-1, -2), out=z[..., known : 2 * known, :])


def _block_steps(duration: float, intervals: int, blocks: int) -> FloatArray:
    """(S,) sample steps: the first two blocks alike, each later one twice the one before it."""
    return np.asarray(duration / intervals * 0.5 ** np.minimum(blocks - np.arange(blocks), blocks - 1))


def _needed_intervals(poles: ComplexArray, duration: float) -> int:
    """Intervals of a block: a mode alive at t is sampled at RESOLUTION there."""
    size = np.abs(poles)
    fading = np.maximum(-poles.real, FADING * 1e-6 * size)
    turns = np.minimum(0.5 * size * duration / RESOLUTION, FADING * size / np.where(size > 0.0, fading, 1.0))
    needed = float(np.max(turns, initial=1.0))
    return min(max(INTERVALS, 1 << int(np.ceil(np.log2(needed)))), LARGEST_INTERVALS)


def _needed_blocks(poles: ComplexArray, duration: float, intervals: int) -> int:
    """Blocks: the first one samples the fastest mode at RESOLUTION."""
    turns = float(np.max(np.abs(poles), initial=0.0)) * duration / (RESOLUTION * intervals)
    needed = 1 + int(np.ceil(np.log2(max(turns, 1.0))))
    return min(max(BLOCKS, needed + needed % 2), LARGEST_BLOCKS)
