"""What speed costs: the least peak torque of the aileron for each settling time, point by point: a Pareto front."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.lqr.weight_judged import borne_out
from design.lqr.weight_request import WeightSearch
from design.lqr.weight_search import candidates_of, found_weights, infeasible_reasons, limits_of, on_grid
from design.lqr.weight_searches import HAND, Searches
from design.outcome import Outcome, Outcomes
from model.actuators import Actuator
from model.arrays import FloatArray, GridArrays, IntArray
from model.linear_model import LinearModel

_IDEAL = Actuator()
#: The first limit of a span is above the fastest that was found by this part.
_ABOVE_FASTEST = 5e-3
#: Least part of the torque that a slower place must save to be on the front.
_SAVED = 1e-3


@dataclass(frozen=True, eq=False)
class TradeOff(GridArrays):
    """Fronts over the grid, K places each, from the fastest to the slowest; nan behind the last one.

    Along a front the settling time rises and the torque falls, both strictly. Every place meets all other specs.

    Attributes
    ----------
    settling_time : (*G, K) of the aileron, within 2 % [s]
    aileron_torque : (*G, K) peak of ``abs(T_a)`` [N m], trim included
    limit : (*G, K) settling time that was allowed where it was found [s]
    maxima : (*G, K, names) largest acceptable values of Bryson's rule, SI
    K : (*G, K, 2, n) gains, as those of `design.lqr.synthesis.LqrDesign`
    outcomes : (*G,) infeasible where the specs cannot be met however slow it may be
    search : what was asked for
    """

    settling_time: FloatArray
    aileron_torque: FloatArray
    limit: FloatArray
    maxima: FloatArray
    K: FloatArray
    outcomes: Outcomes
    search: WeightSearch


@dataclass(frozen=True, eq=False)
class _Front(GridArrays):
    """Of C points, as in `TradeOff`."""

    settling_time: FloatArray
    aileron_torque: FloatArray
    limit: FloatArray
    maxima: FloatArray
    K: FloatArray


def trade_off(
    model: LinearModel,
    search: WeightSearch,
    limits: tuple[float, ...] | None = None,
    count: int = 8,
    outcomes: Outcomes | None = None,
    tab: Actuator = _IDEAL,
    aileron: Actuator = _IDEAL,
) -> TradeOff:
    """Least peak torque of the aileron for each of some settling times, at every point whose outcome is ok.

    Parameters
    ----------
    model : (*G) plant
    search : what is to be met; the limit of its settling time is the slowest that is looked at. Minimised is the peak
        torque, whatever it asks for
    limits : settling times [s] up to the slowest; None spans the fastest that can be reached to the slowest
    count : of the limits of a span, in a geometric series
    outcomes, tab, aileron : as for `design.lqr.weight_search.search_weights`

    Raises
    ------
    ValueError : specs without a settling time; limits that are not positive or above the slowest, less than two of them
    WeightsRefused, ValueError : as `design.lqr.weight_search.search_weights`
    """
    settling = search.settling
    if settling is None:
        raise ValueError("a trade-off against the settling time needs a limit of it among the specs")
    size = count if limits is None else len(limits)
    slow = search.specs[settling].limit
    if size < 2 or (limits is not None and not (min(limits) > 0.0 and np.all(max(limits) <= np.asarray(slow)))):
        raise ValueError(
            f"a trade-off needs two or more settling times up to the slowest, {slow} s, not {limits or count}"
        )
    search = replace(search, minimised="peak_aileron_torque")
    candidates, outcomes = candidates_of(model, search, outcomes, tab, aileron)
    ok = outcomes.ok
    points = np.arange(int(ok.sum()))
    curve, names, n = np.full((points.size, size), np.nan), len(search.names), candidates.plant.B.shape[-2]
    maxima, gains = (np.full((*curve.shape, *more), np.nan) for more in ((names,), (2, n)))
    front = _Front(curve, curve, curve, maxima, gains)
    if points.size:
        slowest = Searches(candidates, points[:, None], limits_of(search.specs, ok)[:, None])
        z, found = found_weights(slowest)
        _, reasons = infeasible_reasons(slowest, z, found)
        said = on_grid(reasons, ok)
        outcomes = outcomes.failing(np.array(said, dtype=bool), Outcome.INFEASIBLE, lambda index: str(said[index]))
        if found.any():
            front = _fronts(slowest.take(found), z[found], settling, limits, size).spread(found)
    whole = front.spread(ok)
    return TradeOff(whole.settling_time, whole.aileron_torque, whole.limit, whole.maxima, whole.K, outcomes, search)


def _fronts(slowest: Searches, z: FloatArray, settling: int, limits: tuple[float, ...] | None, size: int) -> _Front:
    """Fronts of C points.

    Parameters
    ----------
    slowest : searches (C) of one point each for the slowest limit
    z : (C, J) their weights
    settling : number of the spec
    limits, size : of the settling time, or None, and how many
    """
    points, last = len(z), slowest.limits[:, 0, settling]
    fast = replace(slowest, aim=settling).explored(z[:, None])
    if limits is None:
        fastest = np.minimum(last * np.exp(fast.z[:, -1]) * (1.0 + _ABOVE_FASTEST), last)
        asked = fastest[:, None] * (last / fastest)[:, None] ** np.linspace(0.0, 1.0, size)
    else:
        asked = np.broadcast_to(np.sort(limits), (points, size))
    each = np.repeat(slowest.limits, size, axis=0)
    each[:, 0, settling] = asked.reshape(-1)
    searches = Searches(slowest.candidates, np.repeat(slowest.points, size, axis=0), each)
    middle = searches.take(np.arange(points) * size + size // 2).explored(np.stack([z, fast.z[:, :-1]], axis=1))
    begin = np.stack([fast.z[:, :-1], middle.z, z], axis=1)
    place = searches.settled(np.repeat(begin, size, axis=0))
    # Each limit goes on from the weights of the next faster and the next slower one too.
    own, k = place.z.reshape(points, size, -1), np.arange(size)
    begin = np.stack([own, own[:, np.maximum(k - 1, 0)], own[:, np.minimum(k + 1, size - 1)]], axis=2)
    place = searches.settled(begin.reshape(points * size, 3, -1))
    _, found, met = borne_out(searches, place.z, place.miss <= HAND)
    shape = points, size
    time, torque = found.achieved[:, settling].reshape(shape), found.minimised.reshape(shape)
    time = np.where(met.reshape(shape), time, np.nan)
    order, length = front_of(time, torque)

    def in_order(of_all: FloatArray) -> FloatArray:
        axes = (..., *(None,) * (of_all.ndim - 2))
        behind = np.arange(size) >= length[:, None]
        return np.where(behind[axes], np.nan, np.take_along_axis(of_all, order[axes], axis=1))

    maxima, K = (each.reshape(*shape, *each.shape[1:]) for each in (found.maxima, found.design.K))
    return _Front(*map(in_order, (time, torque, asked, maxima, K)))


def front_of(time: FloatArray, torque: FloatArray) -> tuple[IntArray, IntArray]:
    """Which of K places are on the front of each of N points, from the fastest: a slower one that saves enough.

    Parameters
    ----------
    time, torque : (N, K), nan where there is none

    Returns
    -------
    order (N, K) of the places, those of the front first, and its length (N,)
    """
    order, length = np.empty(time.shape, dtype=np.int64), np.empty(len(time), dtype=np.int64)
    for p in range(len(time)):
        front: list[int] = []
        for k in map(int, np.lexsort((torque[p], time[p]))):
            if np.isfinite(time[p, k]) and (not front or torque[p, k] < (1.0 - _SAVED) * torque[p, front[-1]]):
                front.append(k)
        order[p], length[p] = [*front, *(k for k in range(time.shape[1]) if k not in front)], len(front)
    return order, length
