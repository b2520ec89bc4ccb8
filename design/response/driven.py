"""Signals of a linear system that is driven from knot to knot, on samples that resolve them, a part at a time.

The system is ``d/dt [x, e] = M [x, e]``, e being what drives it; at each knot e begins anew. Stretches of one length
share their transitions, and many of them are one matrix product; and no long series over a large grid stands in
memory as a whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from design.response.stretches import Group, Mesh, Stretches
from design.response.transition import transition
from model.arrays import ComplexArray, FloatArray

#: Numbers of a part that is worked on at a time, if one stretch over the grid has no more.
LARGEST_PART = 1 << 20
#: Stretches of one length beyond which they are followed in blocks.
WORTH_BLOCKS = 32


@dataclass(frozen=True, eq=False)
class SampledSignals:
    """Signals over c stretches one after the other, each in S blocks of m even intervals.

    Attributes
    ----------
    values : (*G, q, c, S, m+1); the last sample of a block is the first of the next one of the same stretch
    starts, steps : (c, S) time at which each block begins, and its sample step [s]
    """

    values: FloatArray
    starts: FloatArray
    steps: FloatArray


@dataclass(frozen=True, eq=False)
class Driven:
    """A system, at rest until t = 0, and what drives it.

    Attributes
    ----------
    generator : (*G, N, N) M of ``z' = M z``, ``z = [x, e]`` [1/s]
    poles : of x, and of what drives it where that does not come to rest, any shape [1/s]
    stretches : (K,)
    driving : (K, N - n) e at the beginning of each
    duration : end of the last one [s]
    """

    generator: FloatArray
    poles: ComplexArray
    stretches: Stretches
    driving: FloatArray
    duration: float

    def signals(self, rows: FloatArray) -> Iterator[SampledSignals]:
        """``rows z`` for rows (*G, q, N), a part after the other."""
        grid, size = self.generator.shape[:-2], self.generator.shape[-1]
        x = np.zeros((*grid, size - self.driving.shape[-1]))
        for group in self.stretches.groups(self.poles, self.duration):
            numbers = max(1, int(np.prod(grid))) * group.mesh.points * max(rows.shape[-2], size)
            most = max(1, LARGEST_PART // numbers)
            shared = self._shared(group, rows) if group.alike else None
            for first in range(group.first, group.last, most):
                part = slice(first, min(first + most, group.last))
                if shared is None:
                    chain = _Chain.of(self.generator, self.stretches.lengths[part], group.mesh)
                    z, x = begun(chain.whole, x, self.driving[part])
                    values = chain.signals(rows, z)
                else:
                    z, x = begun(shared.whole, x, self.driving[part])
                    values = shared.signals(z)
                yield self._timed(values, part, group.mesh)

    def _shared(self, group: Group, rows: FloatArray) -> _Shared:
        chain = _Chain.of(self.generator, self.stretches.lengths[group.first : group.first + 1], group.mesh)
        return chain.shared(rows)

    def _timed(self, values: FloatArray, part: slice, mesh: Mesh) -> SampledSignals:
        starts, lengths = self.stretches.starts[part, None], self.stretches.lengths[part, None]
        return SampledSignals(values, starts + lengths * mesh.starts, lengths * mesh.steps)


def begun(whole: FloatArray, x: FloatArray, driving: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States (*G, c, N) at the beginning of each stretch, and x (*G, n) at the end of the last one.

    `whole` (*G, u, N, N) are the transitions over the stretches, one of all (u = 1) or one of each (u = c).
    """
    n, count = x.shape[-1], len(driving)
    z = np.empty((*x.shape[:-1], count, whole.shape[-1]))
    z[..., n:] = driving
    with np.errstate(over="ignore", invalid="ignore"):
        forced = (whole[..., :n, n:] @ driving[..., None])[..., 0]
        own = np.ascontiguousarray(whole[..., :n, :n])
        if own.shape[-3] == 1 and count > WORTH_BLOCKS:
            z[..., :n], x = _in_blocks(own[..., 0, :, :], x, forced)
        else:
            for k in range(count):
                z[..., k, :n] = x
                x = (own[..., k % own.shape[-3], :, :] @ x[..., None])[..., 0] + forced[..., k, :]
    return z, x


def _in_blocks(own: FloatArray, x: FloatArray, forced: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States (*G, c, n) of ``x_k+1 = own x_k + forced_k`` from x_0, and x_c: blocks from rest, then their starts."""
    *grid, count, n = forced.shape
    length = int(np.sqrt(count))
    blocks = count // length
    even, advance = blocks * length, own.swapaxes(-1, -2)
    pushes = forced[..., :even, :].reshape(*grid, blocks, length, n)
    from_rest = np.zeros((*grid, blocks, length + 1, n))
    powers = np.empty((*grid, n, length, n))  # own^j, transposed, side by side
    power = np.broadcast_to(np.eye(n), own.shape)
    for j in range(length):
        from_rest[..., j + 1, :] = from_rest[..., j, :] @ advance + pushes[..., j, :]
        powers[..., j, :] = power
        power = power @ advance
    begin = np.empty((*grid, blocks, n))
    for k in range(blocks):
        begin[..., k, :] = x
        x = (x[..., None, :] @ power)[..., 0, :] + from_rest[..., k, -1, :]
    free = (begin @ powers.reshape(*grid, n, length * n)).reshape(*grid, blocks, length, n)
    found = np.empty((*grid, count, n))
    found[..., :even, :] = (from_rest[..., :-1, :] + free).reshape(*grid, even, n)
    for k in range(even, count):
        found[..., k, :] = x
        x = (own @ x[..., None])[..., 0] + forced[..., k, :]
    return found, x


@dataclass(frozen=True, eq=False)
class _Shared:
    """Signals of every sample of a stretch from the state at its beginning.

    whole (*G, 1, N, N) the transition over it; table (*G, q, N, S (m+1))
    """

    whole: FloatArray
    table: FloatArray
    mesh: Mesh

    def signals(self, z: FloatArray) -> FloatArray:
        """(*G, q, c, S, m+1) from states z (*G, c, N)."""
        with np.errstate(over="ignore", invalid="ignore"):
            values = z[..., None, :, :] @ self.table
        return np.asarray(values.reshape(*values.shape[:-1], self.mesh.blocks, self.mesh.intervals + 1))


@dataclass(frozen=True, eq=False)
class _Chain:
    """Transitions over 1, 2, 4, ... sample steps of the first block, (*G, u, levels, N, N), for u lengths."""

    powers: FloatArray
    mesh: Mesh

    @classmethod
    def of(cls, generator: FloatArray, lengths: FloatArray, mesh: Mesh) -> _Chain:
        *grid, size, _ = generator.shape
        levels = mesh.intervals.bit_length() - 1 + mesh.blocks
        powers = np.empty((*grid, len(lengths), levels, size, size))
        steps = lengths * mesh.first_step
        with np.errstate(over="ignore", invalid="ignore"):
            # One length is one transition of ordinary size; several are scaled by their ratio to the longest.
            longest = float(steps.max())
            scaled = generator[..., None, :, :] * (steps / longest)[:, None, None]
            powers[..., 0, :, :] = transition(scaled, longest)
            for j in range(1, levels):
                np.matmul(powers[..., j - 1, :, :], powers[..., j - 1, :, :], out=powers[..., j, :, :])
        return cls(powers, mesh)

    @property
    def whole(self) -> FloatArray:
        """(*G, u, N, N) transitions over the whole stretches."""
        steps = self.mesh.intervals << (self.mesh.blocks - 1)
        levels = [j for j in range(self.powers.shape[-3]) if steps >> j & 1]
        with np.errstate(over="ignore", invalid="ignore"):
            whole = self.powers[..., levels[0], :, :]
            for j in levels[1:]:
                whole = whole @ self.powers[..., j, :, :]
        return np.asarray(whole)

    def signals(self, rows: FloatArray, z: FloatArray) -> FloatArray:
        """(*G, q, c, S, m+1) of rows (*G, q, N) from states z (*G, c, N), each stretch with its own transitions."""
        filled = self._filled(z[..., None])
        with np.errstate(over="ignore", invalid="ignore"):
            values = rows[..., None, None, :, :] @ filled[..., 0]
        return np.ascontiguousarray(np.moveaxis(values, -2, -4))

    def shared(self, rows: FloatArray) -> _Shared:
        """Signals of rows (*G, q, N) as a table, for one length."""
        *grid, _, _, size, _ = self.powers.shape
        blocks, samples, q = self.mesh.blocks, self.mesh.intervals + 1, rows.shape[-2]
        filled = self._filled(np.broadcast_to(np.eye(size), (*grid, 1, size, size)))[..., 0, :, :, :, :]
        with np.errstate(over="ignore", invalid="ignore"):
            values = rows[..., None, :, :] @ filled.reshape(*grid, blocks, size, samples * size)
        values = values.reshape(*grid, blocks, q, samples, size)
        axes = tuple(range(len(grid)))
        table = values.transpose(*axes, -3, -1, -4, -2).reshape(*grid, q, size, blocks * samples)
        return _Shared(self.whole, np.ascontiguousarray(table), self.mesh)

    def _filled(self, start: FloatArray) -> FloatArray:
        """(*G, u, S, N, m+1, w) every sample of the blocks from columns (*G, u, N, w) at the beginning."""
        *lead, size, width = start.shape
        blocks, m = self.mesh.blocks, self.mesh.intervals
        passes = m.bit_length() - 1
        z = np.empty((*lead, blocks, size, m + 1, width))
        row = z.reshape(*lead, blocks, size, (m + 1) * width)
        with np.errstate(over="ignore", invalid="ignore"):
            z[..., 0, :, 0, :] = start
            later = self.powers[..., passes : passes + blocks - 1, :, :] @ start[..., None, :, :]
            z[..., 1:, :, 0, :] = later
            z[..., :-1, :, m, :] = later
            z[..., -1, :, m, :] = self.whole @ start
            for j in range(passes + 1):
                known, high = 1 << j, min(2 << j, m)
                if known >= m:
                    break
                more = (high - known) * width
                at = slice(known * width, high * width)
                np.matmul(self.powers[..., j : j + 1, :, :], row[..., :1, :, :more], out=row[..., :1, :, at])
                np.matmul(self.powers[..., j : j + blocks - 1, :, :], row[..., 1:, :, :more], out=row[..., 1:, :, at])
        return z
