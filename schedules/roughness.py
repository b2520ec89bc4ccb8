"""How rough gains are over the grid: the error their table would make at a line if the line were left out.

At every interior breakpoint ``x_i`` of an axis a gain is compared with what its neighbours along that axis would give
there by the rule between the points, ``g = w g_(i-1) + (1 - w) g_(i+1)`` with ``w = (x_(i+1) - x_i) / (x_(i+1) -
x_(i-1))``. The difference is a part of the gain's own size, so that gains of any unit are judged alike and a table
that is multilinear already has none. Of a smooth gain it is about ``(x_i - x_(i-1)) (x_(i+1) - x_i) g'' / (2 g)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from model.flight import GridAxis

#: Where a gain passes through zero a part of its size says nothing: below this part of the larger of its two neighbours
#: it counts as that.
LEAST_SIZE = 0.1


@dataclass(frozen=True, eq=False)
class AxisRoughness(GridArrays):
    """Roughness of a gain along one axis.

    Attributes
    ----------
    axis : its name
    errors : (*G,) interpolated less own gain, as a part of the gain's size there [-]; nan at both ends of the axis,
        and where the gain or one of its neighbours does not exist
    """

    axis: str
    errors: FloatArray

    @cached_property
    def point(self) -> int | None:
        """Flat row-major index of the largest error; None where there is none."""
        return _largest(self.errors)

    @cached_property
    def worst(self) -> float | None:
        """Size of the largest error [-]; None where there is none."""
        return None if self.point is None else float(np.abs(self.errors.flat[self.point]))

    @property
    def rms(self) -> float | None:
        """Root of the mean square of the errors [-]; None where there is none."""
        return rms(self.errors)


@dataclass(frozen=True, eq=False)
class Roughness:
    """Roughness of a gain: along each axis of three breakpoints or more, and over all of them."""

    axes: tuple[AxisRoughness, ...]

    @cached_property
    def point(self) -> int | None:
        """Flat row-major index of the largest error along any axis; None where there is none."""
        found = [axis for axis in self.axes if axis.worst is not None]
        return max(found, key=lambda axis: axis.worst or 0.0).point if found else None

    @cached_property
    def worst(self) -> float | None:
        """Size of the largest error along any axis [-]; None where there is none."""
        return max((axis.worst for axis in self.axes if axis.worst is not None), default=None)

    @property
    def rms(self) -> float | None:
        """Root of the mean square of the errors along all axes [-]; None where there is none."""
        return rms(np.concatenate([axis.errors.ravel() for axis in self.axes])) if self.axes else None


def roughness(values: FloatArray, axes: Sequence[GridAxis]) -> Roughness:
    """Roughness of one gain over its grid.

    Parameters
    ----------
    values : (*G,) the gain; points where it is not finite are left out
    axes : one a dimension of `values`; those with fewer than three breakpoints have no roughness

    Raises
    ------
    ValueError : the axes are not those of the values
    """
    if values.shape != tuple(len(axis.values) for axis in axes):
        sizes = [len(axis.values) for axis in axes]
        raise ValueError(f"a gain of shape {values.shape} is not over axes of {sizes} breakpoints")
    stencils = Stencils.of(axes, np.isfinite(values))
    found = stencils.errors(np.asarray(values, dtype=float).ravel())
    along = []
    for k, axis in enumerate(axes):
        if len(axis.values) < 3:
            continue
        errors, mine = np.full(values.size, np.nan), stencils.axis == k
        errors[stencils.here[mine]] = found[mine]
        along.append(AxisRoughness(axis.name, errors.reshape(values.shape)))
    return Roughness(tuple(along))


@dataclass(frozen=True, eq=False)
class Stencils:
    """All triples of neighbours along an axis that carry gains, (S,) each.

    Attributes
    ----------
    before, here, after : flat row-major indices of the three points
    share : part w of the point before in what is interpolated here
    axis : along which axis
    """

    before: IntArray
    here: IntArray
    after: IntArray
    share: FloatArray
    axis: IntArray

    @classmethod
    def of(cls, axes: Sequence[GridAxis], exists: BoolArray) -> Stencils:
        """Triples of the points of a mask (*G,)."""
        flat = np.arange(exists.size, dtype=np.int64).reshape(exists.shape)
        before, here, after, share, along = ([np.empty(0)] for _ in range(5))
        for k, axis in enumerate(axes):
            x = np.asarray(axis.values, dtype=float)
            if len(x) < 3:
                continue
            line = np.moveaxis(flat, k, -1)
            three = [line[..., i : len(x) - 2 + i] for i in range(3)]
            whole = np.all([exists.flat[points] for points in three], axis=0)
            w = np.broadcast_to((x[2:] - x[1:-1]) / (x[2:] - x[:-2]), whole.shape)
            for kept, new in zip((before, here, after, share), (*three, w), strict=True):
                kept.append(new[whole])
            along.append(np.full(int(whole.sum()), k))
        indices = [np.concatenate(part).astype(np.int64) for part in (before, here, after, along)]
        return cls(indices[0], indices[1], indices[2], np.concatenate(share), indices[3])

    def among(self, points: IntArray) -> Stencils:
        """The same triples, numbered among the ascending points (P,) that carry gains."""
        before, here, after = (np.searchsorted(points, part) for part in (self.before, self.here, self.after))
        return replace(self, before=before, here=here, after=after)

    def interpolated(self, values: FloatArray) -> FloatArray:
        """What the neighbours of each triple give at its middle (..., S), from flat values (..., P)."""
        return np.asarray(self.share * values[..., self.before] + (1.0 - self.share) * values[..., self.after])

    def sizes(self, values: FloatArray) -> FloatArray:
        """What the errors are a part of (..., S): the gain's size, at least `LEAST_SIZE` of its larger neighbour's."""
        size = np.abs(values)
        return np.maximum(size[..., self.here], LEAST_SIZE * np.maximum(size[..., self.before], size[..., self.after]))

    def errors(self, values: FloatArray) -> FloatArray:
        """Interpolated less own gain as a part of its size (..., S); 0 where all three are 0."""
        apart, size = self.interpolated(values) - values[..., self.here], self.sizes(values)
        return np.asarray(apart / np.where(size > 0.0, size, 1.0))


def rms(errors: FloatArray) -> float | None:
    """Root mean square of the errors that are not nan; None where there is none."""
    known = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def _largest(errors: FloatArray) -> int | None:
    size = np.abs(errors)
    return int(np.nanargmax(size)) if np.any(np.isfinite(size)) else None
