"""Poles of ``A - k M`` for many gains k, M of rank one, at a fraction of the eigenvalue problems.

Eigenvalues are computed at some of the gains; between them `Segments` finds the poles and proves that they are all.
What it leaves open, above all where more than two poles meet at once, are eigenvalue problems again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from design.frequency.locus_pairs import half_plane_order
from design.frequency.locus_segments import Segments
from design.frequency.poles import pole_order
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray

#: At most how many gains lie between two eigenvalue problems; the second number is for what the first leaves open.
STRIDES = (32, 8)
#: Fewer gains than this between two others are eigenvalue problems at once when they are left open.
FEW = 4


def poles_along(A: FloatArray, M: FloatArray, gains: FloatArray) -> ComplexArray:
    """Eigenvalues of ``A - k M`` (N, K, n).

    Those that come from an eigenvalue problem are in `half_plane_order`; the others keep the places of those they
    continue, so that few lists differ in their order from the one before. The first list is in `pole_order`.

    Parameters
    ----------
    A, M : (N, n, n), M of rank one
    gains : (N, K), strictly monotonic along the last axis
    """
    values = np.empty((*gains.shape, A.shape[-1]), dtype=complex)
    missing = np.ones(gains.shape, dtype=bool)
    missing[:, _even_places(gains.shape[-1], STRIDES[0])] = False
    values[~missing] = eigenvalues(A, M, gains, ~missing)
    _interpolate(gains, values, missing)
    complete(A, M, gains, values, missing)
    values[:, 0] = pole_order(values[:, 0])
    return values


def eigenvalues(A: FloatArray, M: FloatArray, gains: FloatArray, wanted: BoolArray) -> ComplexArray:
    """Eigenvalues (L, n) of ``A - k M`` at the wanted gains (N, K), each list in `half_plane_order`."""
    rows = np.nonzero(wanted)[0]
    if rows.size == 0:
        return np.empty((0, A.shape[-1]), dtype=complex)
    closed = A[rows] - gains[wanted][:, None, None] * M[rows]
    return half_plane_order(np.linalg.eigvals(closed).astype(complex))


def complete(A: FloatArray, M: FloatArray, gains: FloatArray, values: ComplexArray, missing: BoolArray) -> None:
    """Write the missing ones (N, K) of the poles (N, K, n), with eigenvalue problems amid those that lack.

    Both ends of every row are there. `missing` is used up.
    """
    between = _between(missing)
    if between.place.size == 0:
        return
    wanted = np.zeros_like(missing)
    length = between.right - between.left
    inside = between.place - between.left
    wanted.flat[between.place[(length <= FEW) | (inside % STRIDES[1] == 0)]] = True
    values[wanted] = eigenvalues(A, M, gains, wanted)
    missing &= ~wanted
    _interpolate(gains, values, missing)
    values[missing] = eigenvalues(A, M, gains, missing)


def _interpolate(gains: FloatArray, values: ComplexArray, missing: BoolArray) -> None:
    """Write what is sure of the missing poles."""
    between = _between(missing)
    if between.place.size == 0:
        return
    k, lists = gains.reshape(-1), values.reshape(-1, values.shape[-1])
    low, high = k[between.left], k[between.right]
    segments = Segments.between(lists[between.left[between.new]], lists[between.right[between.new]])
    part = (k[between.place] - low) / (high - low)
    found, sure = segments.poles(np.cumsum(between.new) - 1, part)
    lists[between.place] = found
    missing.flat[between.place] = ~sure


class _Between(NamedTuple):
    """Flat places (S,) of what is missing, those of the others next to it, and where a new stretch begins."""

    place: IntArray
    left: IntArray
    right: IntArray
    new: BoolArray


def _between(missing: BoolArray) -> _Between:
    there = ~missing.reshape(-1)
    others = np.flatnonzero(there)
    place = np.flatnonzero(missing)
    after = np.cumsum(there)[place]
    new = np.ones(place.size, dtype=bool)
    np.not_equal(after[1:], after[:-1], out=new[1:])
    return _Between(place, others[after - 1], others[np.minimum(after, others.size - 1)], new)


def _even_places(count: int, stride: int) -> IntArray:
    """Both ends of `count` places and some in between, `stride` apart at most and evenly."""
    parts = -(-(count - 1) // stride)
    return np.arange(parts + 1) * (count - 1) // parts
