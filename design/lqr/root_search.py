"""Newton's method on a few unknowns at many points at once, every point for itself, by differences and step control."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.lqr.hamiltonian import solve_or_nan
from model.arrays import FloatArray, GridArrays, IntArray

#: Errors (P, M, k) of P trials of unknowns (P, M, k) at M of the points, by their numbers (M,); nan where none exist.
Errors = Callable[[FloatArray, IntArray], FloatArray]

#: Steps at most, and the largest component of one.
ITERATIONS, LARGEST_STEP = 40, 1.0
#: Parts of a step that are tried: all of it, and where that leads away the others together.
_PARTS = ((1.0,), (0.5, 0.25, 0.1, 0.03))
#: Step of the differences that the slopes are made of.
_DIFFERENCE = 1e-4


@dataclass(frozen=True, eq=False)
class Roots(GridArrays):
    """What was found from zero unknowns on.

    Attributes
    ----------
    unknowns : (N, k) those that left the least errors
    errors : (N, k) what they leave; nan where there are none at zero unknowns
    """

    unknowns: FloatArray
    errors: FloatArray


def search_roots(errors: Errors, points: int, unknowns: int, tolerance: float) -> Roots:
    """Unknowns that make the errors vanish, as many of the one as of the other.

    A point stops when all its errors are within the tolerance, or when no part of a Newton step lessens them.

    Parameters
    ----------
    errors : the errors
    points : number of points N
    unknowns : number of unknowns k
    tolerance : largest error that is none
    """
    place = np.zeros((points, unknowns))
    left = errors(place[None], np.arange(points))[0]
    active = np.arange(points)
    for _ in range(ITERATIONS):
        active = active[np.abs(left[active]).max(axis=-1, initial=0.0) > tolerance]
        if not active.size:
            break
        nudged = place[active] + _DIFFERENCE * np.eye(unknowns)[:, None, :]
        slopes = np.moveaxis((errors(nudged, active) - left[active]) / _DIFFERENCE, 0, -1)
        step = solve_or_nan(slopes, -left[active][..., None])[..., 0]
        largest = np.abs(step).max(axis=-1, keepdims=True, initial=0.0)
        step = np.where(np.isfinite(largest), step / np.maximum(1.0, largest / LARGEST_STEP), 0.0)
        active = active[_moved(errors, place, left, active, step)]
    return Roots(place, left)


def _moved(errors: Errors, place: FloatArray, left: FloatArray, active: IntArray, step: FloatArray) -> FloatArray:
    """Mask of the active points that got nearer by a part of their step; `place` and `left` are theirs then."""
    nearer = np.zeros(active.size, dtype=bool)
    for parts in _PARTS:
        still = np.flatnonzero(~nearer)
        if not still.size:
            break
        points, column = active[still], np.arange(still.size)
        tried = place[points] + np.array(parts)[:, None, None] * step[still]
        found = errors(tried, points)
        size = np.linalg.norm(found, axis=-1)
        best = np.argmin(np.where(np.isfinite(size), size, np.inf), axis=0)
        better = size[best, column] < np.linalg.norm(left[points], axis=-1)
        place[points[better]], left[points[better]] = tried[best, column][better], found[best, column][better]
        nearer[still] = better
    return nearer
