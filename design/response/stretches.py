"""Between the knots of what drives a linear system: stretches, and the samples that resolve its signals on each.

Every knot excites every mode again, and signals jump or bend there. So each stretch between two knots is sampled by
itself: by one block of even samples where it is short, by a graded mesh (`design.response.graded`) where its fastest
mode is over long before its end. A stretch in which a mode or a sine lasts is cut into several.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from design.response.graded import BLOCKS, FADING, INTERVALS, LARGEST_BLOCKS, RESOLUTION
from design.response.interpolant import POINTS
from model.arrays import ComplexArray, FloatArray

#: A single block that has no more intervals than this is preferred to a graded mesh.
MOST_SINGLE = 64
#: Intervals of a block beyond which a stretch is cut in two, and the most parts that one is cut into.
MOST_INTERVALS, MOST_PARTS = 512, 1 << 16
#: Stretches of the same length in a row that are worth transitions of their own.
RUN = 16
#: Lengths that differ by less than this part of the duration are the same: the rounding of their times.
SAME_LENGTH = 2.0**-50


@dataclass(frozen=True)
class Mesh:
    """S blocks of m even intervals in a stretch: the first two blocks alike, each later one twice the one before it."""

    blocks: int
    intervals: int

    @classmethod
    def resolving(cls, poles: ComplexArray, length: float) -> Mesh:
        """The mesh that a stretch of this length [s] needs for modes of these poles [1/s]."""
        turns = float(np.max(np.abs(poles), initial=0.0)) * length / RESOLUTION
        if turns <= POINTS - 1:
            return cls(1, POINTS - 1)
        if turns <= MOST_SINGLE:
            return cls(1, 1 << int(np.ceil(np.log2(turns))))
        intervals = min(_intervals(poles, length), MOST_INTERVALS)
        blocks = 1 + int(np.ceil(np.log2(max(turns / intervals, 1.0))))
        fewest = BLOCKS if intervals == INTERVALS else 1
        return cls(min(max(fewest, blocks), LARGEST_BLOCKS), intervals)

    @property
    def points(self) -> int:
        """Samples of a stretch, the joints of its blocks twice."""
        return self.blocks * (self.intervals + 1)

    @property
    def first_step(self) -> float:
        """Sample step of the first block, as a part of the stretch."""
        return 0.5 ** (self.blocks - 1) / self.intervals

    @property
    def steps(self) -> FloatArray:
        """(S,) sample step of each block, as a part of the stretch."""
        return np.asarray(self.first_step * 2.0 ** np.maximum(np.arange(self.blocks) - 1, 0))

    @property
    def starts(self) -> FloatArray:
        """(S,) where each block begins, as a part of the stretch."""
        starts = self.intervals * self.steps
        starts[0] = 0.0
        return starts


@dataclass(frozen=True, eq=False)
class Stretches:
    """Stretches (K,) one after the other.

    Attributes
    ----------
    starts, lengths : (K,) [s]
    knots : (K,) the knot that each one follows, its own or an earlier one
    """

    starts: FloatArray
    lengths: FloatArray
    knots: tuple[int, ...]

    @classmethod
    def between(cls, knots: FloatArray, duration: float, poles: ComplexArray) -> Stretches:
        """Stretches between knots (k,) before the end of a response [s], cut where a mode of these poles lasts."""
        ends = np.append(knots[1:], duration)
        whole, parts = ends - knots, np.ones(len(knots), dtype=np.int64)
        for i in np.flatnonzero(whole > _uncut(poles)):
            while parts[i] < MOST_PARTS and _intervals(poles, float(whole[i] / parts[i])) > MOST_INTERVALS:
                parts[i] *= 2
        of = np.repeat(np.arange(len(knots)), parts)
        place = np.arange(len(of)) - np.repeat(np.cumsum(parts) - parts, parts)
        lengths = (whole / parts)[of]
        return cls(knots[of] + place * lengths, lengths, tuple(of.tolist()))

    def groups(self, poles: ComplexArray, duration: float) -> Iterator[Group]:
        """Stretches one after the other that have the same mesh, and either one length or each its own."""
        lengths = np.unique(self.lengths, return_inverse=True)
        meshes = [Mesh.resolving(poles, float(length)) for length in lengths[0]]
        mesh = [meshes[i] for i in lengths[1]]
        alike = np.append(np.abs(np.diff(self.lengths)) <= SAME_LENGTH * duration, False)
        k, begin = 0, 0
        while k < len(mesh):
            end = k + 1
            while end < len(mesh) and alike[end - 1] and mesh[end] == mesh[k]:
                end += 1
            if end - k >= RUN:
                if k > begin:
                    yield Group(begin, k, False, mesh[begin])
                yield Group(k, end, True, mesh[k])
                begin = end
            elif end == len(mesh) or mesh[end] != mesh[k]:
                yield Group(begin, end, False, mesh[k])
                begin = end
            k = end


@dataclass(frozen=True)
class Group:
    """Stretches from `first` to before `last`, all of one mesh, and of one length where they are `alike`."""

    first: int
    last: int
    alike: bool
    mesh: Mesh


def _uncut(poles: ComplexArray) -> float:
    """Length [s] up to which nothing has to be cut, whatever lasts."""
    fastest = float(np.max(np.abs(poles), initial=0.0))
    return 2.0 * RESOLUTION * MOST_INTERVALS / max(fastest, 1e-300)


def _intervals(poles: ComplexArray, length: float) -> int:
    """Intervals of a block of a graded mesh: a mode alive at t is sampled at RESOLUTION there."""
    size = np.abs(poles)
    fading = np.maximum(-poles.real / np.maximum(size, 1e-300), 2.0**-40)
    needed = float(np.max(np.minimum(0.5 * size * length / RESOLUTION, FADING / fading), initial=1.0))
    return max(INTERVALS, 1 << int(np.ceil(np.log2(needed))))
