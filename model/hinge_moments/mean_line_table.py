"""A mean line from a table of its points: any camber."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from model.arrays import FloatArray
from model.hinge_moments.camber import Bend, MeanLine

#: Points closer together than this part of the chord say nothing about the slope between them.
CLOSEST = 1e-9
#: No mean line may have more points.
MAX_POINTS = 500


def mean_line_of_points(x: FloatArray, z: FloatArray, name: str = "mean line table") -> MeanLine:
    """Mean line through points from the leading to the trailing edge, smooth between them.

    A cubic spline (third derivative continuous at the second and the last but one point) has a slope that is a
    parabola between points. Truncated powers write it exactly, so hinge moments and pressures of any table are
    closed forms too. The chord line joins the first and the last point; it need not be the axis of the table.

    Parameters
    ----------
    x, z : (n,) positions and ordinates of the mean line, fractions of the chord; x increasing from 0 to 1, at least
        four points

    Raises
    ------
    ValueError : fewer than 4 or more than `MAX_POINTS` points, a number that is not finite, x not increasing
        from 0 to 1, or an ordinate beyond half a chord
    """
    x, z = np.asarray(x, float), np.asarray(z, float)
    _check(x, z)
    chord_line = z[0] + (z[-1] - z[0]) * x
    cubic, square, line, _ = CubicSpline(x, z - chord_line, bc_type="not-a-knot").c
    # -dz/dx on the first piece is -(line + 2 square x + 3 cubic x^2); each next one adds to the last power.
    curvature = -6.0 * np.concatenate([cubic[:1], np.diff(cubic)])
    parabolas = tuple(Bend(float(at), float(v)) for at, v in zip(x[:-1], curvature, strict=True) if v != 0.0)
    return MeanLine(name, -float(line[0]), (Bend(0.0, -2.0 * float(square[0])),), parabolas)


def _check(x: FloatArray, z: FloatArray) -> None:
    if x.ndim != 1 or x.shape != z.shape or not 4 <= len(x) <= MAX_POINTS:
        raise ValueError(f"a mean line needs 4 to {MAX_POINTS} points, each with its x and z")
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(z))):
        raise ValueError("points of a mean line must be finite")
    if x[0] != 0.0 or x[-1] != 1.0 or np.any(np.diff(x) <= 0):
        raise ValueError("x must increase from 0 at the leading edge to 1 at the trailing edge")
    if np.min(np.diff(x)) < CLOSEST:
        raise ValueError(f"points of a mean line lie too close together: at least {CLOSEST:g} of the chord apart")
    if np.max(np.abs(z)) > 0.5:
        raise ValueError("ordinates are fractions of the chord: none may exceed 0.5")
