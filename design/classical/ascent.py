"""From starting points uphill to the best gains, all points at once, by sequential quadratic programming.

Aim and walls are known with their exact first and second derivatives, so each step is Newton's: the best step of the
problem whose walls are flat and whose aim is bent by the curvature of aim and walls, each wall's as hard as it pushes.
A step is kept when the aim less the price of the way back to all specs has risen; else it is tried again with the walls
where it found them, and then shorter. Where the search stands decides what it does next, and nothing else: it is
deterministic, and no point knows of the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.judged import Judged, Values
from design.classical.problem import Problem
from design.classical.quadratic_step import quadratic_step
from design.classical.requirement import ABSENT
from model.arrays import BoolArray, FloatArray, IntArray

#: First reach of a step, along the basis of the unknowns, and how it changes.
REACH, LONGER, SHORTER = 0.6, 2.5, 0.3
#: Reach of the part by which specs are tightened: down, and up.
PART_REACH = (5.0, 2.0)
#: Least bending of the aim, along the basis: what is flat or bent the wrong way is taken as bent so.
LEAST_BEND = 0.05
#: Pushes of the walls, in all, that are taken at their word; beyond it the walls leave no room, and say nothing about
#: the curvature. And pushes that differ by less than this are the same.
LARGEST_PUSH, SAME_PUSH = 10.0, 0.05
#: Price of the way back to all specs, along the basis, over the slope of the aim, and over the walls' push up to a
#: highest one; and how steep walls are at least and at most for that.
PRICE, OVER_PUSH, HIGHEST, FLAT, STEEP = 1.0, 2.0, 50.0, 0.5, 10.0
#: A search has arrived when no wall is overstepped by more than this, and its step would gain and reach no more.
OVERSTEPPED, GAIN, ARRIVED = 5e-4, 1e-3, 0.03
#: Shortest reach worth going on with.
SMALLEST = 1e-5


@dataclass(frozen=True, eq=False)
class Climb:
    """Where each of K searches has come to: unknowns (K, J), their values, and whether (K,) that is an optimum."""

    z: FloatArray
    values: Values
    arrived: BoolArray

    def with_rows(self, rows: IntArray, other: Climb) -> Climb:
        """These, with some of the rows from another."""
        z, arrived = self.z.copy(), self.arrived.copy()
        z[rows], arrived[rows] = other.z, other.arrived
        return Climb(z, self.values.with_rows(rows, other.values), arrived)


class Ascent:
    """K searches in one problem each, step by step, from starts z (K, J) that may have been `judged` before."""

    def __init__(self, problem: Problem, z: FloatArray, judged: Judged | None = None) -> None:
        self._whole, self._problem = problem, problem
        self._rows = np.arange(z.shape[0])  # those of the whole that are still worked on
        self._z = np.maximum(z, problem.family.least)
        self._judged = problem.judge(self._z) if judged is None else judged
        self._basis = problem.family.basis(self._z)
        self._push, self._correction = np.zeros((2, *self._judged.slopes.walls.shape))
        self._reach = np.full(z.shape[0], REACH)
        self._corrected, self._arrived = np.zeros((2, z.shape[0]), dtype=bool)
        self._going = np.ones(z.shape[0], dtype=bool)
        values = self._judged.values
        self._best_z, self._best_aim = self._z.copy(), np.where(values.met, values.aim, -np.inf)
        self._found = Climb(self._z, values, self._arrived)

    def stop(self, rows: BoolArray) -> None:
        """Give up some of the searches (K,)."""
        self._going &= ~rows[self._rows]

    def run(self, steps: int) -> Climb:
        """So many steps, or fewer if all come to an end before.

        Returns
        -------
        Where the searches are; or the best place that met the specs on the way, where they are not met at its end.
        """
        for _ in range(steps):
            if not np.any(self._going):
                break
            self._step()
        self._record()
        back = np.flatnonzero(~self._found.values.met & (self._best_aim > -np.inf))
        if back.size:
            z = self._best_z[back]
            best = Climb(z, self._whole.take(back).judge(z).values, np.zeros(back.size, dtype=bool))
            self._found = self._found.with_rows(back, best)
        return self._found

    def _record(self) -> None:
        """Write down where the searches are that are worked on."""
        here = Climb(self._z, self._judged.values, self._arrived)
        whole = self._rows.size == self._found.arrived.size
        self._found = here if whole else self._found.with_rows(self._rows, here)

    def _forget_finished(self) -> None:
        """Go on with those searches only that have not come to an end, once they are the fewer."""
        if 2 * np.count_nonzero(self._going) > self._going.size:
            return
        self._record()
        kept = np.flatnonzero(self._going)
        self._rows, self._problem = self._rows[kept], self._problem.take(kept)
        self._judged = self._judged.take(kept)
        for name in ("_z", "_basis", "_push", "_correction", "_reach", "_corrected", "_arrived", "_going"):
            setattr(self, name, getattr(self, name)[kept])

    def _step(self) -> None:
        """One step of every search that is still going."""
        self._forget_finished()
        now, family, j = self._judged, self._problem.family, self._z.shape[1]
        v, push, foreseen = self._newton(now)
        moved = (self._basis @ v[:, :j, None])[..., 0]
        gain = v[:, -1] if self._problem.tightens else (now.slopes.aim * moved).sum(axis=-1)
        size = np.max(np.abs(v[:, :j]), axis=-1)
        held = size > 0.99 * self._reach
        there = (np.max(now.slopes.walls, axis=-1) < OVERSTEPPED) & now.values.met
        there &= (np.abs(gain) < GAIN) & (size < ARRIVED) & ~held
        self._arrived |= self._going & there
        self._going &= ~there
        if not np.any(self._going):
            return
        z = np.maximum(self._z + moved, family.least)
        new, basis = self._problem.judge(z), family.basis(z)
        uphill = np.abs(now.slopes.aim[:, None] @ self._basis).max(axis=(-2, -1))
        steep = self._steepness(now, self._basis)
        price = np.maximum(
            PRICE * np.maximum(uphill, 0.3), OVER_PUSH * np.minimum((push * steep).sum(axis=-1), HIGHEST)
        )
        risen = self._priced(new, self._steepness(new, basis), price) - self._priced(now, steep, price)
        better = risen > -1e-6
        # A step that bent walls have spoilt is tried again with the walls where it found them, before it is cut short.
        again = ~better & ~self._corrected & new.values.stable
        correction = np.where(again[:, None], np.clip(new.slopes.walls - foreseen, -1.0, 1.0), 0.0)
        longer, shorter = np.where(held, LONGER * self._reach, self._reach), SHORTER * np.minimum(self._reach, size)
        reach = np.where(better, longer, np.where(again, self._reach, shorter))
        going, taken = self._going, better & self._going
        self._reach = np.where(going, reach, self._reach)
        self._correction = np.where(going[:, None], correction, self._correction)
        self._corrected = np.where(going, again, self._corrected)
        self._push = np.where(going[:, None], _at_their_word(push), self._push)
        self._z, self._basis = np.where(taken[:, None], z, self._z), np.where(taken[:, None, None], basis, self._basis)
        self._judged = now.replaced(taken, new)
        best = taken & new.values.met & (new.values.aim > self._best_aim[self._rows])
        self._best_z[self._rows[best]], self._best_aim[self._rows[best]] = z[best], new.values.aim[best]
        self._going &= self._reach > SMALLEST

    def _newton(self, now: Judged) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Best steps (K, n) along the basis, and of the part where specs are tightened; the walls' pushes (K, M); and
        where the walls are after the step as far as flat ones go (K, M).
        """
        (k, j), basis, slopes = self._z.shape, self._basis, now.slopes
        tightens = self._problem.tightens
        n = j + tightens
        slope, bend = np.zeros((k, n)), np.zeros((k, n, n))
        gradient = np.zeros((*slopes.walls.shape, n))
        gradient[:, :, :j] = slopes.gradient @ basis
        slope[:, :j] = (slopes.aim[:, None] @ basis)[:, 0]
        low, high = np.empty((k, n)), np.empty((k, n))
        room = (self._problem.family.least - self._z) / np.diagonal(basis, axis1=1, axis2=2)
        low[:, :j], high[:, :j] = np.maximum(-self._reach[:, None], room), self._reach[:, None]
        if tightens:
            gradient[:, :, j], slope[:, j], bend[:, j, j] = slopes.give, now.values.stable, LEAST_BEND
            low[:, j], high[:, j] = -PART_REACH[0], PART_REACH[1]
        # Walls that are nowhere near need not be looked at.
        near = np.flatnonzero((slopes.walls > 0.5 * ABSENT).any(axis=0))
        walls, steep = (slopes.walls + self._correction)[:, near], gradient[:, near]
        curves, push = slopes.curvature[:, near], self._push[:, near]
        guess = np.concatenate([(push > 0.0) | (walls > 0.0), np.zeros((k, 2 * n), dtype=bool)], axis=1)
        v, last = np.zeros((k, n)), push
        differs = np.ones(k, dtype=bool)
        for _ in range(2):
            # Which walls push, and how hard, is only known once the step is; where that differs, a second time.
            curved = (push[..., None, None] * curves).sum(axis=1) - slopes.aim_curvature
            size, way = np.linalg.eigh(basis.swapaxes(-1, -2) @ curved @ basis)
            bend[:, :j, :j] = (way * np.maximum(size, LEAST_BEND)[:, None]) @ way.swapaxes(-1, -2)
            step = quadratic_step(slope, bend, walls, steep, low, high, guess)
            v, last = np.where(differs[:, None], step.v, v), np.where(differs[:, None], step.push, last)
            before, push, guess = push, _at_their_word(step.push), step.pushing
            differs = np.abs(push - before).max(axis=-1, initial=0.0) >= SAME_PUSH
            if not differs.any():
                break
        pushes = np.zeros_like(slopes.walls)
        pushes[:, near] = last
        return v, pushes, slopes.walls + (gradient @ v[..., None])[..., 0]

    def _steepness(self, judged: Judged, basis: FloatArray) -> FloatArray:
        """How steep the walls (K, M) are along the basis, within what counts."""
        return np.asarray(np.clip(np.abs(judged.slopes.gradient @ basis).max(axis=-1), FLAT, STEEP))

    def _priced(self, judged: Judged, steep: FloatArray, price: FloatArray) -> FloatArray:
        """Aim less the price of the way back to where all walls are kept."""
        away = judged.values.miss if self._problem.tightens else np.max(judged.slopes.walls / steep, axis=-1)
        return np.asarray(judged.values.aim - price * np.maximum(away, 0.0))


def _at_their_word(push: FloatArray) -> FloatArray:
    """Pushes, all scaled down where they are excessive."""
    return np.asarray(push * np.minimum(1.0, LARGEST_PUSH / np.maximum(push.sum(axis=-1, keepdims=True), 1e-9)))
