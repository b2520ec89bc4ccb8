"""The angle at which an equation of hinge moments holds: found on a grid of angles, refined by Newton's method.

Sources of hinge moments need not be linear, so an equation may have several solutions, or none within a limit.
The range is sampled; of the cells in which the equation changes sign the one nearest to neutral is refined by
Newton's method, kept inside the cell by bisection. A linear equation is met by the first step. Every point
goes its own way and stands still once it has converged, so its answer does not depend on its company.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays

#: Angles at which an equation is sampled over its range: two degrees apart over a half turn.
SAMPLES = 91
#: An angle that moves less than this has converged [rad].
ANGLE_TOLERANCE = 1e-12
_STEPS = 100
#: Angles evaluated at a time while sampling: bounds the memory of large grids.
_BLOCK = 200_000


@dataclass(frozen=True, eq=False)
class EquationAt(GridArrays):
    """An equation at some angles: its left-hand side, the slope of it by the angle, where it may be believed."""

    value: FloatArray
    slope: FloatArray
    covered: BoolArray


#: Takes angles that broadcast to (..., *S) [rad], leading axes added in front of the problem's shape S.
Equation = Callable[[FloatArray], EquationAt]


@dataclass(frozen=True, eq=False)
class SolvedAngle(GridArrays):
    """Angles found (*S,) [rad], and whether the equation holds there.

    Where it does not, the angle is the sampled one that leaves the least, or neutral when none is covered.
    """

    angle: FloatArray
    found: BoolArray


@dataclass(frozen=True, eq=False)
class _Cell(GridArrays):
    """A stretch of angles (*S,) at whose ends the equation has different signs, and the sign at its lower end."""

    low: FloatArray
    high: FloatArray
    sign: FloatArray
    exists: BoolArray
    best: FloatArray


def solve_angle(equation: Equation, shape: tuple[int, ...], limit: float) -> SolvedAngle:
    """Solution nearest to neutral within plus and minus `limit` [rad], of a problem of this shape (*S)."""
    cell = _nearest_cell(equation, shape, limit)
    angle, converged = _refine(equation, cell)
    found = cell.exists & converged & equation(angle).covered
    return SolvedAngle(np.where(found, angle, cell.best), found)


def least_angle(
    size: Callable[[FloatArray], FloatArray], stationary: Equation, shape: tuple[int, ...], limit: float
) -> SolvedAngle:
    """Angle (*S,) within plus and minus `limit` at which a quantity is least; a limit itself may be the answer.

    Parameters
    ----------
    size : the quantity at angles (..., *S), infinite where it is not covered
    stationary : the equation that holds at its minimum: its derivative, up to a positive factor
    shape, limit : shape S of the problem; range of the angle [rad]
    """
    samples = np.linspace(-limit, limit, SAMPLES)
    best, at = np.full(shape, np.inf), np.zeros(shape, dtype=np.int64)
    for k in np.argsort(np.abs(samples), kind="stable"):
        here = np.broadcast_to(size(np.full(shape, samples[k])), shape)
        at, best = np.where(here < best, k, at), np.where(here < best, here, best)
    low, high = samples[np.maximum(at - 1, 0)], samples[np.minimum(at + 1, SAMPLES - 1)]
    below, above = stationary(low), stationary(high)
    inside = (below.value < 0.0) & (above.value > 0.0) & np.isfinite(best)
    cell = _Cell(low, high, np.full(shape, -1.0), inside, samples[at])
    angle, converged = _refine(stationary, cell)
    inside = inside & converged & stationary(angle).covered
    lower = (at == 0) & (below.value >= 0.0)
    upper = (at == SAMPLES - 1) & (above.value <= 0.0)
    answer = np.where(np.isfinite(best), np.where(inside, angle, samples[at]), 0.0)
    return SolvedAngle(answer, np.isfinite(best) & (inside | lower | upper))


def newton_angle(equation: Equation, start: FloatArray) -> SolvedAngle:
    """Solution (*S,) near a good start (*S,), by Newton's method alone."""
    angle, moving = np.array(start, float), np.isfinite(start)
    found = np.zeros(angle.shape, dtype=bool)
    angle[~moving] = 0.0
    for _ in range(20):
        step = newton_step(equation(angle))
        usable = moving & np.isfinite(step) & (np.abs(step) < np.pi)
        angle = np.where(usable, angle + np.where(usable, step, 0.0), angle)
        found = found | (usable & (np.abs(step) <= ANGLE_TOLERANCE))
        moving = usable & ~found
        if not np.any(moving):
            break
    return SolvedAngle(angle, found)


def newton_step(here: EquationAt) -> FloatArray:
    """``-value / slope`` (*S,) [rad]; infinite where the angle has no hold on the equation."""
    held = here.slope != 0.0
    step = -here.value / np.where(held, here.slope, 1.0)
    return np.asarray(np.where(held | (here.value == 0.0), step, np.inf))


def _nearest_cell(equation: Equation, shape: tuple[int, ...], limit: float) -> _Cell:
    """The cell of sign change nearest to neutral, and the sample that leaves the least, each (*S,)."""
    samples = np.linspace(-limit, limit, SAMPLES)
    low, high, sign = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    distance, least, best = np.full(shape, np.inf), np.full(shape, np.inf), np.zeros(shape)
    exists = np.zeros(shape, dtype=bool)
    before: EquationAt | None = None
    for angle, here in _sampled(equation, shape, samples):
        size = np.where(here.covered & np.isfinite(here.value), np.abs(here.value), np.inf)
        better = (size < least) | ((size == least) & np.isfinite(size) & (abs(angle) < np.abs(best)))
        least, best = np.where(better, size, least), np.where(better, angle, best)
        zero = (size == 0.0) & (abs(angle) < distance)
        low, high = np.where(zero, angle, low), np.where(zero, angle, high)
        distance, exists = np.where(zero, abs(angle), distance), exists | zero
        if before is not None:
            # Not covered at one end: the solution may still lie on the covered side; its place is checked in the end.
            start = angle - (samples[1] - samples[0])
            away = 0.0 if start < 0.0 < angle else min(abs(start), abs(angle))
            nearer = (before.value * here.value < 0.0) & (before.covered | here.covered) & (away < distance)
            low, high = np.where(nearer, start, low), np.where(nearer, angle, high)
            sign = np.where(nearer, np.sign(before.value), sign)
            distance, exists = np.where(nearer, away, distance), exists | nearer
        before = here
    return _Cell(low, high, sign, exists, best)


def _sampled(equation: Equation, shape: tuple[int, ...], samples: FloatArray) -> Iterator[tuple[float, EquationAt]]:
    """The equation at each sample in turn, evaluated some samples at a time."""
    each = max(1, _BLOCK // max(1, int(np.prod(shape))))
    for first in range(0, len(samples), each):
        some = samples[first : first + each]
        here = equation(np.broadcast_to(some.reshape(-1, *(1,) * len(shape)), (len(some), *shape)))
        for k, angle in enumerate(some):
            yield float(angle), here.take(k)


def _refine(equation: Equation, cell: _Cell) -> tuple[FloatArray, BoolArray]:
    """Angle (*S,) in each cell by Newton's method; a step that leaves the cell or shrinks too slowly is a bisection."""
    low, high = cell.low, cell.high
    first = newton_step(equation(np.zeros(low.shape)))
    angle = np.where((first > low) & (first < high), first, 0.5 * (low + high))
    moving, last = cell.exists, high - low
    converged = ~moving
    for _ in range(_STEPS):
        here = equation(angle)
        below = moving & (np.sign(here.value) == cell.sign)
        low, high = np.where(below, angle, low), np.where(moving & ~below, angle, high)
        step = newton_step(here)
        trial = angle + np.where(np.isfinite(step), step, np.inf)
        newton = (trial >= low) & (trial <= high) & (np.abs(step) <= 0.5 * last)
        new = np.where(newton, trial, 0.5 * (low + high))
        last = np.where(moving, np.abs(new - angle), last)
        angle = np.where(moving, new, angle)
        still = moving & (last > ANGLE_TOLERANCE)
        converged, moving = converged | (moving & ~still), still
        if not np.any(moving):
            break
    return np.asarray(angle), np.asarray(converged & cell.exists)
