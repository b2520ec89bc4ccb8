"""Weights that were found, solved for with certificate and judged exactly: no code of the search has a part in it."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from design.lqr.flown import flown_loop
from design.lqr.step_figures import step_figures
from design.lqr.synthesis import LqrDesign, design_lqr
from design.lqr.weight_candidates import Candidates
from design.lqr.weight_searches import HAND, Searches
from design.outcome import Outcomes
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: How often limits are corrected by what the search was found to misjudge, and by how much of them at most.
_CORRECTIONS, _CORRECTION = 4, 0.1
#: Digits of a correction: those that do not depend on what else is judged with it.
_DIGITS = 6


@dataclass(frozen=True, eq=False)
class Judged(GridArrays):
    """Designs of N weights; nan where there is none.

    Attributes
    ----------
    maxima : (N, names) largest acceptable values of Bryson's rule
    design : gains and their certificates
    achieved : (N, s) values of the specs' quantities, by `design.assess`
    minimised : (N,) what was made least
    """

    maxima: FloatArray
    design: LqrDesign
    achieved: FloatArray
    minimised: FloatArray


def judged(candidates: Candidates, z: FloatArray, points: IntArray) -> Judged:
    """Designs of weights z (N, J) at the points of these numbers (N,)."""
    search, structure = candidates.search, candidates.plant.structure
    maxima, model = search.maxima(z), candidates.model.take(points)
    designs = []
    for i, values in enumerate(maxima):
        weights = replace(search.start, **dict(zip(search.names, map(float, values), strict=True)))
        controller = replace(search.controller, weights=weights)
        designs.append(design_lqr(model.take(slice(i, i + 1)), controller, None, structure.tab, structure.aileron))
    design = _joined(designs)
    ok = design.outcomes.ok
    values, least = np.full((len(z), len(search.specs)), np.nan), np.full(len(z), np.nan)
    if ok.any():
        loop = flown_loop(model.take(ok), structure, design.K[ok], design.N[ok])
        values[ok], least[ok] = step_figures(loop, search.specs, search.minimised, search.step)
    return Judged(maxima, design, values, least)


def borne_out(searches: Searches, z: FloatArray, found: BoolArray) -> tuple[FloatArray, Judged, BoolArray]:
    """Weights z (C, J) that meet the specs by the search, changed until they do exactly.

    Where an exact value misses its limit, the search is given one that is as much stricter, and goes on from there.

    Parameters
    ----------
    searches : for the least of what is minimised
    z : (C, J)
    found : (C,) mask of those that meet the specs by the search; the others stay as they are

    Returns
    -------
    weights (C, J), their judgement over the points (C p), and the mask (C, p) of the points where all specs are met
    """
    z, limits, (count, points) = z.copy(), searches.limits.copy(), searches.points.shape
    senses = np.array([1.0 if spec.sense == "max" else -1.0 for spec in searches.specs])
    corrected, going = 0, np.ones(count, dtype=bool)
    while True:
        result = judged(searches.candidates, np.repeat(z, points, axis=0), searches.points.reshape(-1))
        values = result.achieved.reshape(limits.shape)
        met = result.design.outcomes.ok.reshape(count, points)
        for k, spec in enumerate(searches.specs):
            met &= replace(spec, limit=searches.limits[..., k]).met(values[..., k])
        going = found & ~met.all(axis=-1)
        if corrected == _CORRECTIONS or not going.any():
            return z, result, met & found[:, None]
        excess = np.clip(np.nan_to_num(senses * (values / searches.limits - 1.0), nan=_CORRECTION), 0.0, _CORRECTION)
        limits = limits * (1.0 - senses * np.where(excess > 0.0, np.round(excess + HAND, _DIGITS), 0.0))
        z[going] = replace(searches, limits=limits).take(going).settled(z[going][:, None]).z
        corrected += 1


def _joined(designs: list[LqrDesign]) -> LqrDesign:
    """Designs of single points (1) as one (N)."""
    arrays: dict[str, Any] = {
        field.name: np.concatenate([getattr(design, field.name) for design in designs])
        for field in fields(LqrDesign)
        if isinstance(getattr(designs[0], field.name), np.ndarray)
    }
    outcomes = Outcomes(
        np.concatenate([design.outcomes.codes for design in designs]),
        np.concatenate([design.outcomes.reasons for design in designs]),
    )
    return replace(designs[0], **arrays, outcomes=outcomes)
