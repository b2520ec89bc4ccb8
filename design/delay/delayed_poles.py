"""Closed-loop poles of loops with transport delays, exact, with a proof that none of the rightmost is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.characteristic import SHORTEST, Characteristic, characteristic, finite_points
from design.delay.newton import rightmost_first
from design.delay.starts import dense_starts, starts
from design.delay.winding import roots_inside
from design.frequency.poles import pole_order, poles
from design.loop import Loop
from model.arrays import ComplexArray, FloatArray, GridArrays

#: Poles that are kept on top of the number of states.
MORE = 6


@dataclass(frozen=True, eq=False)
class DelayedPoles(GridArrays):
    """The rightmost of the endlessly many closed-loop poles of a loop with delays.

    Attributes
    ----------
    poles : (*G, n + MORE) in `pole_order`, nan padded [rad/s]; without a delay, the n that there are
    complete_beyond : (*G,) real part [rad/s]: proved to be all the poles with a larger one. nan where nothing is
        proved (a matrix that is not finite, or poles so close together that rounding hides them), and there no
        pole is given
    """

    poles: ComplexArray
    complete_beyond: FloatArray


def delayed_poles(loop: Loop) -> DelayedPoles:
    """The n + MORE rightmost closed-loop poles, roots of ``det(sI - A + sum_i b_i k_i exp(-s delay_i))``.

    Found from the eigenvalues of a loop with approximate delays and from the asymptotes of the chains, by Newton's
    method, at last on the determinant in state space: ``f / f' = 1 / trace(D^-1 D')``. Then the number of roots to
    the right of the last one that is kept is counted on a contour, independently (`design.delay.winding`).

    Parameters
    ----------
    loop : over any grid; points whose matrices are not finite have no poles

    Raises
    ------
    ValueError : a delay is negative or not finite
    """
    points = finite_points(loop)
    n = loop.A.shape[-1]
    found = np.full((*points.shape, n + MORE), complex(np.nan, np.nan))
    beyond = np.full(points.shape, np.nan)
    if max(loop.delay) <= SHORTEST:
        found[points, :n] = poles(loop.closed[points])
        beyond[points] = -np.inf
    elif points.any():
        f = characteristic(loop, points)
        proved = [_proved(f.take(part), n + MORE) for part in f.parts]
        roots, line = (np.concatenate(each) for each in zip(*proved, strict=True))
        found[points] = pole_order(np.asarray(roots * f.scale[:, None], dtype=complex))
        beyond[points] = line * f.scale
    return DelayedPoles(found, beyond)


def _proved(f: Characteristic, width: int) -> tuple[ComplexArray, FloatArray]:
    """The `width` rightmost roots (N, width), nan padded, and the line (N,) to the right of which they are all.

    Where the count does not confirm them, as many of the rightmost as it does confirm; nan where it confirms none.
    """
    kept, line = _confirmed(f, rightmost_first(f, starts(f, width)), width, least=width)
    again = np.isnan(line)
    if again.any():
        rest = f.take(again)
        roots = rightmost_first(rest, dense_starts(rest, 3 * width))
        kept[again], line[again] = _confirmed(rest, roots, width, least=1)
    return kept, line


def _confirmed(f: Characteristic, roots: ComplexArray, width: int, least: int) -> tuple[ComplexArray, FloatArray]:
    """As `_proved`, of roots (N, M) by falling real part, as many as are confirmed from `width` down to `least`."""
    kept, line = np.full((roots.shape[0], width), complex(np.nan, np.nan)), np.full(roots.shape[0], np.nan)
    left = np.flatnonzero(np.isfinite(roots[:, 0]))
    for count in range(width, least - 1, -1):
        if not left.size:
            break
        some, rest = roots[left], f.take(left)
        edge = _gap(rest, some, count)
        inside = some.real > edge[:, None]
        confirmed = roots_inside(rest, -edge, np.ones(left.size)) == inside.sum(axis=-1)
        kept[left[confirmed]] = np.where(inside, some, np.nan)[confirmed, :width]
        line[left[confirmed]] = edge[confirmed]
        left = left[~confirmed]
    return kept, line


def _gap(f: Characteristic, roots: ComplexArray, count: int) -> FloatArray:
    """Real part (N,) in the middle of the gap after the first `count` roots (N, M), one less if that parts a pair."""
    real = np.concatenate([roots.real, np.full((roots.shape[0], 2), np.nan)], axis=-1)
    last = np.minimum(count, np.isfinite(roots).sum(axis=-1))
    earlier, before, after = (
        np.take_along_axis(real, at[:, None], axis=-1)[:, 0] for at in (np.maximum(last - 2, 0), last - 1, last)
    )
    parted = before == after
    before, after = np.where(parted, earlier, before), np.where(parted, before, after)
    beyond = before - 0.5 / f.delays.max(axis=-1)
    return np.asarray(np.where(np.isnan(after), beyond, 0.5 * (before + after)))
