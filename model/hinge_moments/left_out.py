"""Error of an interpolant at its own rows: zero, unless each is left out and predicted by its neighbours."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray
from model.hinge_moments.angle_grid import AngleGrid
from model.hinge_moments.axis_weights import InterpolationKind, axis_of

#: At most so many levels of each angle are left out in turn, evenly chosen.
MOST_LEVELS = 100
# Levels to either side that can matter for one left out.
_REACH = 3


def left_out_errors(grid: AngleGrid, kind: InterpolationKind) -> FloatArray:
    """Interpolation minus table (m, 2), order [C_Ht, C_Ha], when an inner level of one angle is left out in turn.

    Along each angle of three levels and more, every level but the two outermost is taken away and interpolated
    from the rest of its line. The gaps are twice as wide as the table's own, so the true error between rows
    is smaller, where the table is smooth.
    """
    errors = [np.zeros((0, 2))]
    for axis, levels in enumerate(grid.levels):
        lines = np.moveaxis(grid.nodes, axis, 0)
        inner = max(len(levels) - 2, 0)
        chosen = np.unique(np.linspace(1, inner, min(inner, MOST_LEVELS)).round().astype(int))
        for level in chosen:
            near = np.arange(max(0, level - _REACH), min(len(levels), level + _REACH + 1))
            near = near[near != level]
            found = axis_of(levels[near], kind).at(levels[level : level + 1])
            weights = found.weight[0].reshape(-1, 1, 1, 1)
            predicted = np.sum(weights * lines[near[found.level[0]]], axis=0)
            errors.append((predicted - lines[level]).reshape(-1, 2))
    return np.concatenate(errors)
