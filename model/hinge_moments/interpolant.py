"""Hinge moments interpolated in a table whose rows fill a grid of angles: multilinear or cubic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats
from model.hinge_moments.angle_grid import AngleGrid, angle_grid
from model.hinge_moments.axis_weights import Axis, InterpolationKind, axis_of
from model.hinge_moments.blocks import in_blocks
from model.hinge_moments.expansion import HingeMoments
from model.hinge_moments.fit_report import FitReport, fit_errors, one_incidence_note, require_deflections
from model.hinge_moments.hull import Hull, hull_of
from model.hinge_moments.left_out import left_out_errors
from model.hinge_moments.table import HingeMomentTable


@dataclass(frozen=True, eq=False)
class GridInterpolant:
    """Source of hinge moments: a tensor product of interpolations along the three angles, through every row.

    ``multilinear`` has a gradient that jumps at the levels of the grid; there it is the mean of both sides.
    ``cubic`` has a continuous gradient and reproduces parabolas. Beyond the grid both go on straight from its
    edge, so that Newton's method can come back; `covers` tells inside from outside.

    Attributes
    ----------
    kind : ``multilinear`` or ``cubic``
    axes : along alpha, dt, da
    nodes : (n_alpha, n_dt, n_da, 2) coefficients [C_Ht, C_Ha] at the levels
    hull : the box of the grid
    report : errors and rows
    """

    kind: InterpolationKind
    axes: tuple[Axis, Axis, Axis]
    nodes: FloatArray
    hull: Hull
    report: FitReport

    def at(self, alpha: Floats, dt: Floats, da: Floats) -> HingeMoments:
        """Coefficients and gradient at incidence and deflections [rad]; see `HingeMomentSource.at`."""
        return in_blocks(self._at, alpha, dt, da)

    def covers(self, alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
        """Mask (*G,) of the angles [rad] within the grid; see `HingeMomentSource.covers`."""
        return self.hull.contains(alpha, dt, da)

    @property
    def domain(self) -> str:
        """The box of the grid, in words and degrees."""
        return str(self.hull)

    def _at(self, angles: FloatArray) -> HingeMoments:
        alpha, dt, da = (axis.at(angles[:, k]) for k, axis in enumerate(self.axes))
        near = self.nodes[alpha.level[:, :, None, None], dt.level[:, None, :, None], da.level[:, None, None, :]]
        along, by_aileron = _contract(near, da.weight), _contract(near, da.slope)
        plane, by_tab = _contract(along, dt.weight), _contract(along, dt.slope)
        by_aileron = _contract(by_aileron, dt.weight)
        gradient = [
            _contract(plane, alpha.slope), _contract(by_tab, alpha.weight), _contract(by_aileron, alpha.weight)
        ]  # fmt: skip
        return HingeMoments(_contract(plane, alpha.weight), np.stack(gradient, axis=-1))


def fit_interpolant(table: HingeMomentTable, kind: InterpolationKind = "cubic") -> GridInterpolant:
    """Interpolate in a table that has a row for every combination of its alphas, tab and aileron angles.

    A single incidence is allowed: then nothing varies with it. An angle of two levels is joined straight
    whatever the kind.

    Parameters
    ----------
    table : rows
    kind : ``multilinear`` or ``cubic``

    Raises
    ------
    ValueError : an unknown kind, one tab or aileron angle only, or combinations without a row; the message
        counts them and names the first
    """
    if kind not in get_args(InterpolationKind):
        raise ValueError(f"the interpolant must be one of {get_args(InterpolationKind)}, not {kind!r}")
    require_deflections(table.angles)
    grid = angle_grid(table)
    alpha, dt, da = (axis_of(levels, kind) for levels in grid.levels)
    tab, aileron = fit_errors(left_out_errors(grid, kind), table.coefficients)
    notes = one_incidence_note(table.angles) + _straight_note(grid, kind) + _unjudged_note(grid)
    report = FitReport(tab, aileron, "left_out", len(table.angles), 0, table.count, notes)
    return GridInterpolant(kind, (alpha, dt, da), grid.nodes, hull_of(table.angles), report)


def _contract(near: FloatArray, weights: FloatArray) -> FloatArray:
    """Sum over the last axis but one of (m, ..., s, 2) with weights (m, s).

    Written out term by term: the order of the sum, hence its last bit, is the same for one point and many.
    """
    shape = (-1, *(1,) * (near.ndim - 2))
    total = near[..., 0, :] * weights[:, 0].reshape(shape)
    for s in range(1, weights.shape[1]):
        total = total + near[..., s, :] * weights[:, s].reshape(shape)
    return np.asarray(total)


def _straight_note(grid: AngleGrid, kind: InterpolationKind) -> tuple[str, ...]:
    names = ("alpha", "tab", "aileron")
    two = [name for name, levels in zip(names, grid.levels, strict=True) if len(levels) == 2]
    if kind != "cubic" or not two:
        return ()
    return (f"two levels only, joined straight: {', '.join(two)}",)


def _unjudged_note(grid: AngleGrid) -> tuple[str, ...]:
    if any(len(levels) > 2 for levels in grid.levels):
        return ()
    return ("no angle has three levels, so no row lies between others and the error cannot be estimated",)
