"""Bryson weights that meet specs with the least power of the actuators: at each point, or the same ones everywhere.

The specs are those of `design.lqr.weight_request.WeightSearch`. What the search finds is solved for and judged anew by
`design.lqr.synthesis` and `design.assess`, and is kept only where these bear it out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.classical.infeasibility import Infeasibility, Relaxation, in_words
from design.lqr.cost import cost_of
from design.lqr.regulator import finite
from design.lqr.synthesis import LqrDesign, design_lqr
from design.lqr.tracking import augment_with_integral, steady_state
from design.lqr.weight_candidates import Candidates
from design.lqr.weight_judged import Judged, borne_out, judged
from design.lqr.weight_request import WeightSearch
from design.lqr.weight_searches import EVERY, HAND, Searches
from design.lqr.weights import BrysonWeights
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray, GridArrays, ObjectArray
from model.linear_model import LinearModel

_IDEAL = Actuator()


@dataclass(frozen=True, eq=False)
class WeightsFound(GridArrays):
    """Weights over the grid and what they lead to; nan where the outcome is not ok.

    Attributes
    ----------
    maxima : (*G, names) largest acceptable values of Bryson's rule, SI
    design : gains and their certificates
    achieved : (*G, s) value of each spec's quantity, as `design.assess` has it
    minimised : (*G,) what was made least, in its unit (`design.lqr.weight_request.UNITS`)
    infeasible : (*G,) `Infeasibility` of the points where no weights meet the specs, None elsewhere; with one set of
        weights for all points None everywhere
    outcomes : (*G,); a reason names the spec in the way, its limit, and the best value reached
    search : what was asked for
    """

    maxima: FloatArray
    design: LqrDesign
    achieved: FloatArray
    minimised: FloatArray
    infeasible: ObjectArray
    outcomes: Outcomes
    search: WeightSearch

    def weights(self, index: tuple[int, ...]) -> BrysonWeights:
        """The weights at one point.

        Raises
        ------
        ValueError : there are none
        """
        if not self.outcomes.ok[index]:
            raise ValueError(f"no weights at {index}: {self.outcomes.reasons[index]}")
        values = map(float, self.maxima[index])
        return replace(self.search.start, **dict(zip(self.search.names, values, strict=True)))


def search_weights(
    model: LinearModel,
    search: WeightSearch,
    outcomes: Outcomes | None = None,
    tab: Actuator = _IDEAL,
    aileron: Actuator = _IDEAL,
    common: bool = False,
    exchange: bool = False,
) -> WeightsFound:
    """Weights that meet all specs with the least of what is minimised, at every point whose outcome is ok.

    The best that was found from many starts: no proof that there is nothing better, or that what was not found does
    not exist.

    Parameters
    ----------
    model : (*G) plant
    search : what is asked for
    outcomes : (*G) what became of each point before; all ok when None
    tab, aileron : actuators: bandwidth of the torque loops, delay. Their limits steer where they are among the specs
    common : one set of weights for all points, the worst of which needs least; else each point has its own
    exchange : every point goes on from the weights of the others that suit it best: seldom missed is then what one of
        them found, but what a point gets depends on which others there are

    Raises
    ------
    WeightsRefused : the weights to start from define no regulator
    ValueError : actuators or a structure that do not exist, limits that do not fit the grid
    """
    candidates, outcomes = candidates_of(model, search, outcomes, tab, aileron)
    ok = outcomes.ok
    if not ok.any():
        return _nothing(design_lqr(model, search.controller, outcomes, tab, aileron), search)
    points, limits = np.arange(int(ok.sum())), limits_of(search.specs, ok)
    searches = Searches(candidates, points[:, None], limits[:, None])
    if common:
        searches = Searches(candidates, points[None], limits[None])
    z, found = found_weights(searches)
    if exchange and not common:
        place = searches.exchanged(z)
        now = place.miss <= HAND
        z, found = np.where(now[:, None], place.z, z), found | now
    z, result, met = borne_out(searches, z, found)
    infeasible, reasons = np.full((2, points.size), None, dtype=object)
    if common:
        met = np.repeat(met.all(axis=-1), points.size)
        if not found.all():
            reasons[:] = _common_reason(searches, result, ok)
    else:
        infeasible, reasons = infeasible_reasons(searches, z, found)
    whole = result.spread(ok)
    said = WeightsFound(
        whole.maxima, whole.design, whole.achieved, whole.minimised, on_grid(infeasible, ok), outcomes, search
    )
    return _withdrawn(said, on_grid(reasons, ok), met.reshape(-1), ok)


def candidates_of(
    model: LinearModel, search: WeightSearch, outcomes: Outcomes | None, tab: Actuator, aileron: Actuator
) -> tuple[Candidates, Outcomes]:
    """What is designed and judged at the points that can be, flattened, and the outcomes (*G,) that say which.

    Raises
    ------
    WeightsRefused, ValueError : as `search_weights`
    """
    structure = search.controller.structure(tab, aileron)
    plant = augment_with_integral(model, structure)
    rest = steady_state(model, search.controller.tab_allocation, structure)
    if outcomes is None:
        outcomes = Outcomes.all_ok(model.A.shape[:-2])
    known = finite(model.A) & finite(model.B)
    outcomes = outcomes.failing(
        ~known, Outcome.NOT_CERTIFIED, lambda index: "the linear model holds numbers that are not finite"
    )
    outcomes = outcomes.failing(~rest.attainable, Outcome.INFEASIBLE, lambda index: str(rest.reasons[index]))
    ok = outcomes.ok
    cost = cost_of(search.start, plant)
    return Candidates(search, model.take(ok), plant.take(ok), rest.take(ok), cost), outcomes


def limits_of(specs: tuple[Spec, ...], ok: BoolArray) -> FloatArray:
    """Limits (P, s) of specs at the points of a mask (*G,)."""
    limits = np.empty((int(ok.sum()), len(specs)))
    for k, spec in enumerate(specs):
        limits[:, k] = np.broadcast_to(spec.limit, ok.shape)[ok]
    return limits


def found_weights(searches: Searches) -> tuple[FloatArray, BoolArray]:
    """Best weights (C, J) by the search, and the mask (C,) of those that meet all specs.

    The others miss them as little as can be, the largest miss of any spec being the least.
    """
    place = searches.explored(np.zeros((len(searches.points), 1, len(searches.candidates.search.searched))))
    z, found = place.z.copy(), place.miss <= HAND
    if not found.all():
        # The price of a miss is finite: weights that miss nothing, but need much more, may have been passed by.
        some = searches.take(~found)
        nearest = replace(some, aim=EVERY).explored(z[~found][:, None]).z
        again = some.settled(nearest[:, None])
        better = again.miss <= HAND
        z[~found] = np.where(better[:, None], again.z, nearest)
        found[~found] = better
    return z, found


def infeasible_reasons(searches: Searches, z: FloatArray, found: BoolArray) -> tuple[ObjectArray, ObjectArray]:
    """`Infeasibility` and reason (C,) of the searches of one point each that found nothing; None of the others.

    Parameters
    ----------
    searches, z, found : of `found_weights`
    """
    infeasible, reasons = np.full((2, len(z)), None, dtype=object)
    if not found.all():
        infeasible[~found] = why_infeasible(searches.take(~found), z[~found])
        span = searches.candidates.search.span
        for c in np.flatnonzero(~found):
            said = infeasible[c].describe()
            reasons[c] = f"no weights within {span:g} times those to start from were found: {said}"
    return infeasible, reasons


def why_infeasible(searches: Searches, nearest: FloatArray) -> list[Infeasibility]:
    """For each of C searches that find nothing: which one spec to relax, and what the nearest weights miss.

    Parameters
    ----------
    searches : of one point each
    nearest : (C, J) weights of the least largest miss
    """
    points = searches.points[:, 0]
    at_nearest = judged(searches.candidates, nearest, points).achieved
    relaxed: list[list[Relaxation]] = [[] for _ in points]
    asked = [
        [_at(spec, limit) for spec, limit in zip(searches.specs, row, strict=True)] for row in searches.limits[:, 0]
    ]
    for k in range(len(searches.specs)):
        place = replace(searches, aim=k).from_leaps(nearest)
        values = judged(searches.candidates, place.z[:, : nearest.shape[-1]], points).achieved[:, k]
        for c in map(int, np.flatnonzero((place.miss <= HAND) & np.isfinite(values))):
            percent = 100.0 * _part_missed(asked[c][k], values[c])
            relaxed[c].append(Relaxation(asked[c][k], float(values[c]), percent))
    found = []
    for c, specs in enumerate(asked):
        missed = [k for k, spec in enumerate(specs) if not _part_missed(spec, at_nearest[c, k]) <= 0.0]
        found.append(
            Infeasibility(
                tuple(sorted(relaxed[c], key=lambda relaxation: relaxation.percent)),
                tuple(specs[k] for k in missed),
                tuple(float(at_nearest[c, k]) for k in missed),
            )
        )
    return found


def on_grid(values: ObjectArray, ok: BoolArray) -> ObjectArray:
    """Objects of the points of a mask (*G,) over the grid."""
    whole = np.full(ok.shape, None, dtype=object)
    whole[ok] = values
    return whole


def _withdrawn(found: WeightsFound, reasons: ObjectArray, met: BoolArray, ok: BoolArray) -> WeightsFound:
    """Without the weights of the points that have a reason (*G,), or do not meet the specs (P,) exactly."""
    outcomes = found.outcomes.failing(
        np.array(reasons, dtype=bool), Outcome.INFEASIBLE, lambda index: str(reasons[index])
    )
    missed = ok.copy()
    missed[ok] = ~met

    def not_borne_out(index: tuple[int, ...]) -> str:
        if not found.design.outcomes.ok[index]:
            return str(found.design.outcomes.reasons[index])
        values = map(in_words, found.search.specs, found.achieved[index])
        return f"judged exactly, the weights that were found do not meet all specs: {', '.join(values)}"

    outcomes = outcomes.failing(missed, Outcome.NOT_CERTIFIED, not_borne_out)
    kept = outcomes.ok
    left = found.take(kept).spread(kept)
    design = replace(left.design, outcomes=outcomes)
    return replace(left, design=design, outcomes=outcomes, infeasible=found.infeasible)


def _nothing(design: LqrDesign, search: WeightSearch) -> WeightsFound:
    """Of a grid without a point to search at."""
    grid = design.outcomes.ok.shape
    maxima, achieved = np.full((*grid, len(search.names)), np.nan), np.full((*grid, len(search.specs)), np.nan)
    infeasible = np.full(grid, None, dtype=object)
    return WeightsFound(maxima, design, achieved, np.full(grid, np.nan), infeasible, design.outcomes, search)


def _at(spec: Spec, limit: float) -> Spec:
    return Spec(spec.quantity, spec.sense, float(limit), spec.source)


def _part_missed(spec: Spec, value: float) -> float:
    """How far a value misses a spec, as a part of the limit."""
    return float(-spec.distance(np.asarray(value)) / spec.scale)


def _common_reason(searches: Searches, result: Judged, ok: BoolArray) -> str:
    """Which spec the nearest weights of all points miss most, where, and by how much."""
    asked = [[_at(spec, limit) for spec, limit in zip(searches.specs, row, strict=True)] for row in searches.limits[0]]
    missed = np.array([list(map(_part_missed, *row)) for row in zip(asked, result.achieved, strict=True)])
    point, k = divmod(int(np.argmax(np.nan_to_num(missed, nan=np.inf))), len(searches.specs))
    spec, index = asked[point][k], tuple(int(i) for i in np.argwhere(ok)[point])
    asked_for, reached = in_words(spec, spec.limit, bound=True), in_words(spec, result.achieved[point, k])
    return (
        "no one set of weights was found that meets all specs at all points: "
        f"asked {asked_for}; the nearest has {reached} at {index}"
    )
