"""The search where the quick one leaves a doubt: many starts, finer samples, and gains that meet the specs at all.

Where none of the starts leads to gains that meet the specs, all specs are tightened together, from less than nothing
on: that leads to such gains if there are any, and else to the nearest design, whose largest miss is least.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.classical.ascent import Ascent, Climb
from design.classical.found import FINER, Found, best_of, closer_look, modes_of, taken
from design.classical.open_gains import OpenGains
from design.classical.problem import Problem
from design.classical.starts import many_starts, quick_starts
from design.classical.steering import StepReference
from design.specs import Spec
from model.arrays import FloatArray, IntArray

#: Steps of all starts, and of the most promising ones; and how many these are.
MANY_STEPS, STEPS, PROMISING = 6, 45, 6
#: How many times as many samples as a quick search has.
FINE = 2
#: What a miss counts against the aim when starts are compared, and when two searches are in the same place.
PRICE, SAME = 3.0, 1e-3


def thorough(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], begin: Found) -> Found:
    """Largest bandwidth that meets the specs at each of P points, or the nearest design; also from where to `begin`."""
    problem = Problem.of(family, reference, specs, fineness=FINE)
    starts = np.concatenate([begin.z[None], every_start(family)])
    points = begin.aim.size
    climb, at = _promising(problem, starts)
    found = best_of(climb, at, points)
    lost = np.flatnonzero(~found.met)
    if lost.size:
        near = np.concatenate([climb.z.reshape(-1, *begin.z.shape), starts])[:, lost]
        found = found.replaced(lost, _nearest(*taken(family, reference, specs, lost), near))
    return _unflattered(family, reference, specs, found)


def tightened(
    family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], which: tuple[bool, ...], begin: FloatArray
) -> Found:
    """Those of the specs that are to be tightened, by the same part of each limit, as far as the others allow.

    Parameters
    ----------
    which : (S,) which specs
    begin : (S, P, J) places to begin from

    Returns
    -------
    `Found` whose aim is the part, negative where they must be relaxed instead.
    """
    # Designs that are far from the specs are slow: their responses are followed for as long as it takes.
    problem = Problem.of(family, replace(reference, horizon=np.inf), specs, which, fineness=FINE)
    climb, at = _promising(problem, begin)
    return best_of(climb, at, begin.shape[1])


def every_start(family: OpenGains) -> FloatArray:
    """Unknowns (S, P, J) of all starts."""
    return np.concatenate([quick_starts(family), many_starts(family)])


def _promising(problem: Problem, begin: FloatArray) -> tuple[Climb, IntArray]:
    """Searches from starts (S, P, J), all of them for a few steps, the most promising of each point to the end.

    Returns
    -------
    The searches that went on (count, P) in one row, and their points.
    """
    begin = np.maximum(begin, problem.family.least)
    (many, points, j), count = begin.shape, min(PROMISING, begin.shape[0])
    every = np.tile(np.arange(points), many)
    first = Ascent(problem.take(every), begin.reshape(-1, j)).run(MANY_STEPS)
    miss = np.clip(np.nan_to_num(first.values.miss, nan=np.inf), 0.0, 1e6)
    rank = np.where(first.values.stable, first.values.aim - PRICE * miss, -1e9).reshape(many, points)
    # Of searches that have come to the same place one is enough.
    z = first.z.reshape(many, points, j)
    for k in range(1, many):
        same = np.abs(z[k] - z[:k]).max(axis=-1) < SAME
        rank[k] = np.where(same.any(axis=0), -np.inf, rank[k])
    best = np.argsort(-rank, axis=0, kind="stable")[:count]
    at = np.tile(np.arange(points), count)
    return Ascent(problem.take(at), first.z[best.ravel() * points + at]).run(STEPS), at


def _nearest(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], begin: FloatArray) -> Found:
    """All specs tightened together from places (S, P, J): the fastest gains that meet them, or the nearest design."""
    found = tightened(family, reference, specs, (True,) * len(specs), begin)
    met = np.flatnonzero(found.met & (found.aim >= 0.0))
    found = replace(found, met=np.zeros_like(found.met))
    if met.size:
        problem = Problem.of(*taken(family, reference, specs, met), fineness=FINE)
        found = found.replaced(met, best_of(Ascent(problem, found.z[met]).run(STEPS), np.arange(met.size), met.size))
    return found


def _unflattered(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], found: Found) -> Found:
    """Where a closer look finds a winner flattered, search again from it with the samples of that look, or finer."""
    for fineness in (2 * FINER, 4 * FINER):
        flattered = _flattered(family, reference, specs, found)
        if flattered.size == 0:
            return found
        part, z = taken(family, reference, specs, flattered), found.z[flattered]
        problem = Problem.of(*part, fineness=fineness, modes=modes_of(part[0], z))
        again = best_of(Ascent(problem, z).run(STEPS), np.arange(flattered.size), flattered.size)
        found = found.replaced(flattered, again)
    met = found.met.copy()
    met[_flattered(family, reference, specs, found)] = False
    return replace(found, met=met)


def _flattered(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], found: Found) -> IntArray:
    """Places (P,) of the designs that seemed to meet the specs, and at a closer look do not."""
    at = np.flatnonzero(found.met)
    if at.size == 0:
        return at
    met, _ = closer_look(*taken(family, reference, specs, at), found.z[at])
    return at[~met]
