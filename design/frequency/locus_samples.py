"""Samples of a root locus, dealt out so that few of them draw it smoothly.

Between the nodes the locus is known in good approximation before it is sampled. So the samples are dealt out to the
stretches between the nodes by what a drawing needs: by how far the poles move, in parts of their distance from the
origin, and by how much they turn on the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.landmarks import Landmarks
from design.frequency.locus_nodes import Stretches
from design.frequency.locus_pairs import half_plane_order
from design.frequency.locus_poles import complete
from design.frequency.locus_segments import Segments
from design.frequency.poles import pole_order
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

#: How much a turn [1/rad] counts beside a step: the distance between a chord and its arc is 1/8 of their product.
TURN = 1.0
#: This part of the samples is dealt out evenly to the stretches, whatever happens there.
EVEN = 0.05
#: Each stretch is measured in so many parts.
PARTS = 4
#: Poles nearer to the origin than this part of the largest do not make what there is to see smaller.
CLOSE = 1e-3
#: No part of a stretch has less than this part of the weight of the heaviest; and weights below that number are none.
LEAST, TINY = 1e-3, 1e-300


@dataclass(frozen=True, eq=False)
class Sampled(GridArrays):
    """Gains (N, K), rising from 0, and the poles there (N, K, n) [rad/s], the first list in `pole_order`."""

    gains: FloatArray
    poles: ComplexArray


def sampled(landmarks: Landmarks, between: Stretches, count: int) -> Sampled:
    """The locus at the nodes and between them, at `count` gains for each point."""
    A, M = landmarks.A, landmarks.b[:, :, None] * landmarks.c[:, None, :]
    N, n, _ = A.shape
    L, row = between.row.size, between.row
    # The nodes: the gain 0 of each point, and the upper ends of its stretches.
    left = np.arange(L) + row
    k, node_row = np.zeros(L + N), np.zeros(L + N, dtype=np.int64)
    k[left + 1], node_row[left], node_row[left + 1] = between.high, row, row
    lists = half_plane_order(np.linalg.eigvals(A[node_row] - k[:, None, None] * M[node_row]).astype(complex))
    segments = Segments.between(lists[left], lists[left + 1])
    weights = _weights(landmarks, between, segments)
    nodes = np.bincount(row, minlength=N) + 1
    number = _dealt_out(weights.sum(axis=0), row, count - nodes)
    stretch, part = _parts(weights, number)
    gain = between.gains(stretch, part)
    low, high = between.low[stretch], between.high[stretch]
    found, sure = segments.poles(stretch, (gain - low) / (high - low))
    # All in their order: each stretch's samples come after its lower node, and the last node at the end.
    own = np.ones(L + N, dtype=np.int64)
    own[left] += number
    place = np.cumsum(own) - own
    inner = np.ones(N * count, dtype=bool)
    inner[place] = False
    gains, poles, missing = np.empty((N, count)), np.empty((N, count, n), dtype=complex), inner.reshape(N, count)
    gains[~missing], gains[missing] = k, gain
    poles[~missing], poles[missing] = lists, found
    missing[missing] = ~sure
    complete(A, M, gains, poles, missing)
    poles[:, 0] = pole_order(poles[:, 0])
    poles *= landmarks.scale[:, None, None]
    return Sampled(gains, poles)


def _weights(landmarks: Landmarks, between: Stretches, segments: Segments) -> FloatArray:
    """How many samples the parts of the stretches deserve (PARTS, L), up to a factor."""
    n, L = segments.ends.start.shape[1:]
    stretch = np.tile(np.arange(L), PARTS - 1)
    part = np.repeat(np.arange(1, PARTS) / PARTS, L)
    gain = between.gains(stretch, part)
    low, high = between.low[stretch], between.high[stretch]
    inner, _ = segments.guesses(stretch, (gain - low) / (high - low), n)
    s = np.empty((PARTS + 1, n, L), dtype=complex)
    s[0], s[-1] = segments.ends.start[0], segments.ends.end[0]
    s[1:-1] = np.moveaxis(inner.reshape(n, PARTS - 1, L), 1, 0)
    chord = s[1:] - s[:-1]
    length = np.abs(chord)
    step = length / (_extent(landmarks)[between.row] + np.abs(0.5 * (s[1:] + s[:-1])))
    # The angle between neighbouring chords, half of it to either.
    product = length[1:] * length[:-1]
    along = (chord[1:] * chord[:-1].conj()).real / np.where(product > 0.0, product, 1.0)
    turn = np.where(product > 0.0, np.sqrt(np.maximum(2.0 - 2.0 * along, 0.0)), 0.0)
    both = np.zeros(step.shape)
    both[1:] += 0.5 * turn
    both[:-1] += 0.5 * turn
    return np.asarray(np.sqrt(step * (step + TURN * both)).max(axis=1))


def _extent(landmarks: Landmarks) -> FloatArray:
    """The size (N,) of what there is to see about the origin: the geometric mean of the poles' distances from it."""
    size = np.abs(np.concatenate([landmarks.poles, landmarks.moved], axis=-1))
    largest = size.max(axis=-1, keepdims=True)
    size = np.maximum(size, np.where(largest > 0.0, CLOSE * largest, 1.0))
    return np.asarray(np.exp(np.log(size).mean(axis=-1)))


def _dealt_out(weight: FloatArray, row: IntArray, number: IntArray) -> IntArray:
    """Numbers (L,) in proportion to the weights (L,) that sum to `number` (N,) over the stretches of each point."""
    stretches = np.bincount(row)
    column = np.arange(row.size) - (np.cumsum(stretches) - stretches)[row]
    # One row for each point, so that its neighbours have no part in the rounding.
    share = np.zeros((stretches.size, stretches.max()))
    share[row, column] = weight
    total = share.sum(axis=-1, keepdims=True)
    share[row, column] += (np.where(total > 0.0, EVEN * total, 1.0)[:, 0] / stretches)[row]
    share = np.cumsum(share, axis=-1)
    until = np.rint(number[:, None] * (share / share[:, -1:])).astype(np.int64)
    numbers: IntArray = np.diff(until, axis=-1, prepend=0)[row, column]
    return numbers


def _parts(weights: FloatArray, number: IntArray) -> tuple[IntArray, FloatArray]:
    """Stretches (S,) and the parts of the way (S,) at which `number` (L,) samples lie by the weights (PARTS, L)."""
    stretch = np.repeat(np.arange(number.size), number)
    i = np.arange(stretch.size) - np.repeat(np.cumsum(number) - number, number)
    share = np.zeros((PARTS + 1, number.size))
    np.cumsum(weights + LEAST * weights.max(axis=0) + TINY, axis=0, out=share[1:])
    share /= share[-1]
    wanted = (i + 1) / (number[stretch] + 1)
    part = (wanted >= share[1:-1, stretch]).sum(axis=0)
    low, high = share[part, stretch], share[part + 1, stretch]
    return stretch, (part + (wanted - low) / (high - low)) / PARTS
