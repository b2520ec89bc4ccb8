"""Search for the fastest gains that meet the specs, every point for itself and all points at once.

First quickly: from one or a few starts at each point uphill (`design.classical.ascent`). What that leaves in doubt,
because no start or not every promising one has come to the same place, or because a closer look finds the winner
flattered by what is between the samples, is searched thoroughly (`design.classical.thorough_search`). The search is
deterministic, and a point's answer does not depend on its neighbours.
"""

from __future__ import annotations

import numpy as np

from design.classical.ascent import Ascent
from design.classical.found import Found, best_of, closer_look, joined, places, taken
from design.classical.open_gains import OpenGains
from design.classical.problem import Problem
from design.classical.starts import quick_starts
from design.classical.steering import StepReference
from design.classical.thorough_search import thorough
from design.specs import Spec
from model.arrays import BoolArray

#: Points searched together, quickly and thoroughly; bounds the memory.
BLOCK, FEW = 128, 32
#: Steps of a quick search.
STEPS = 14
#: A start that misses no spec by more than this part of its limit is near; one that misses by more than that is
#: hopeless where another one is not.
NEAR, HOPELESS = 0.6, 0.7
#: A drive that lags by less than this, over 1 / omega_n, is much faster than the aileron.
FAST_DRIVE = 0.15
#: Logarithms of bandwidths that are the same.
SAME = 5e-3


def fastest(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...]) -> Found:
    """Largest bandwidth that meets `specs` at each of P points; where nothing meets them, the nearest design.

    Parameters
    ----------
    family : loops of P points
    reference : its trim (P,)
    specs : their limits numbers or (P,)
    """
    with np.errstate(all="ignore"):
        parts = [
            taken(family, reference, specs, slice(i, i + BLOCK)) for i in range(0, family.form.frequency.size, BLOCK)
        ]
        return joined([_fastest(*part) for part in parts])


def _fastest(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...]) -> Found:
    found, sure = quick(family, reference, specs)
    at = np.flatnonzero(sure)
    if at.size:
        looked_at = (family, reference, specs) if at.size == sure.size else taken(family, reference, specs, at)
        met, knife_edge = closer_look(*looked_at, found.z[at])
        sure[at] = met & ~knife_edge
    for part in places(~sure, FEW):
        found = found.replaced(part, thorough(*taken(family, reference, specs, part), found.take(part)))
    return found


def quick(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...]) -> tuple[Found, BoolArray]:
    """From a few starts; and where (P,) those that were promising have all come to the same place.

    With a servo of second order that is not much faster than the aileron, and damping asked for, the other starts are
    tried only where the first one is not near. Else there often are several optima: far larger gains may be borne, and
    a rate command has an inner gain to choose as well.
    """
    begin = quick_starts(family)
    count, points, j = begin.shape
    problem = Problem.of(family, reference, specs)
    first = problem.judge(np.maximum(begin[0], family.least))
    near = first.values.stable & (first.values.miss < NEAR) & (family.form.lag > FAST_DRIVE)
    damped = any(spec.quantity == "damping_ratio" for spec in specs)
    if family.form.order != 2 or family.form.rate_command or not damped:
        near[:] = False
    at, hopeful = np.arange(points), np.ones(points, dtype=bool)
    if near.all():
        ascent = Ascent(problem, begin[0], first)
    else:
        at = np.concatenate([at, np.tile(np.flatnonzero(~near), count - 1)])
        begin = np.concatenate([begin[0], begin[1:, ~near].reshape(-1, j)])
        problem = problem.take(at)
        judged = problem.judge(np.maximum(begin, problem.family.least))
        hopeful = judged.values.stable & ((judged.values.miss < HOPELESS) | (problem.family.form.lag < FAST_DRIVE))
        hopeful |= np.bincount(at, hopeful, points)[at] == 0
        ascent = Ascent(problem, begin, judged)
        ascent.stop(~hopeful)
    climb = ascent.run(STEPS)
    found = best_of(climb, at, points)
    elsewhere = hopeful & (~climb.arrived | (climb.values.aim < found.aim[at] - SAME))
    return found, found.met & found.arrived & (np.bincount(at, elsewhere, points) == 0)
