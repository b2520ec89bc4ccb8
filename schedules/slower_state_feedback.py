"""The fastest state feedback within the limits of an actuator, of two families of weights (6.3.2, turned round).

At each point what one actuator costs is raised until its limits are met for the reference step:

================== =============================================================
family             multiplied by the factor, at least 1
================== =============================================================
`torque`           the weight of its torque, ``R_ii``
`torque_and_rate`  the weight of its torque and that of its surface's rate
================== =============================================================

The first keeps the response quick, and lets the surface move the faster the more torque costs; the second slows the
surface too. Neither need lower every peak all the way: so each family is looked through at factors half a decade apart,
and between the first that meets the limits and the one before it the edge is found by halving. Of the two families the
one whose aileron settles first is kept, point by point.
"""

from __future__ import annotations

import numpy as np

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.arrays import BoolArray, FloatArray, IntArray
from schedules.actuator_limits import Limited
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.judging import judged
from schedules.priced_feedback import FAMILIES, PricedFeedback
from schedules.slower import Slower
from schedules.study import Study

#: Factors that are looked through, and how often the step between two of them is halved.
FACTORS = 10.0 ** (0.5 * np.arange(1, 13))
HALVINGS = 12
#: A settling time [s] that comes after every other: that of a response that does not settle in its time.
_NOT_SETTLED = 1e300


def slower_state_feedback(study: Study, plant: PlantEnvelope, designed: DesignedController, limited: Limited) -> Slower:
    """Slow a design down where it breaks limits of an actuator; what holds stays as it is.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : a state feedback in continuous time, with a design at one point at least
    limited : limits of one of its actuators
    """
    ok = designed.outcomes.ok
    priced = PricedFeedback.of(study, plant, designed, limited)
    broken = np.flatnonzero(~limited.met(limited.peaks_of(designed)[ok]))
    family, factor = np.full(priced.size, -1), np.ones(priced.size)
    nearest = np.full((priced.size, len(limited.names)), np.nan)
    if broken.size:
        family[broken], factor[broken], nearest[broken] = _searched(priced, limited, broken)
    helped = np.isfinite(factor)
    least = _over_grid(np.where(helped[:, None], np.nan, nearest), ok)
    outcomes = designed.outcomes.failing(
        _over_grid(helped, ok) == 0.0,
        Outcome.INFEASIBLE,
        lambda index: f"no price of the actuator's torque and rate helps: the nearest has {limited.said(least[index])}",
    )
    final = _judged(study, plant, designed, outcomes, priced, family[helped], factor[helped], np.flatnonzero(helped))
    kept = final.outcomes.ok
    steered = np.full(ok.shape, None, dtype=object)
    steered[ok] = np.array([*FAMILIES, None], dtype=object)[family]
    steered[~kept] = None
    return Slower(final, steered, np.where(kept, _over_grid(factor, ok), np.nan), least)


def _judged(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    outcomes: Outcomes,
    priced: PricedFeedback,
    family: IntArray,
    factor: FloatArray,
    points: IntArray,
) -> DesignedController:
    """The design at points (P,) of the priced ones, judged; elsewhere the outcomes (*G,) say why there is none."""
    request = designed.request
    if not points.size:
        none = tuple(Gain(gain.name, gain.unit, np.full(outcomes.ok.shape, np.nan)) for gain in designed.gains)
        return judged(study, plant, request, outcomes, none, designed.loop)
    found = priced.feedback(family, factor, points, outcomes.ok)
    outcomes = outcomes.failing(
        outcomes.ok & ~found.outcomes.ok, Outcome.NOT_CERTIFIED, lambda index: str(found.outcomes.reasons[index])
    )
    return judged(study, plant, request, outcomes, found.gains, found.loop)


def _over_grid(values: FloatArray | BoolArray, ok: BoolArray) -> FloatArray:
    """Values (N, ...) of the points of a mask (*G,) over the grid, as numbers; nan elsewhere."""
    whole = np.full((*ok.shape, *values.shape[1:]), np.nan)
    whole[ok] = values
    return whole


def _searched(priced: PricedFeedback, limited: Limited, points: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Family (P,), factor (P,) and peaks (P, k) at points (P,): the nearest where nothing helps, factor nan."""
    count = points.size
    factors, peaks = np.full((len(FAMILIES), count), np.nan), np.full((count, len(limited.names)), np.nan)
    settling, used = np.full((len(FAMILIES), count), np.inf), np.full(count, np.inf)
    for family in range(len(FAMILIES)):
        tried = priced.peaks(family, np.repeat(FACTORS, count), np.tile(points, len(FACTORS)))
        tried = tried.reshape(len(FACTORS), count, -1)
        uses = limited.used(tried)
        best = np.argmin(uses, axis=0)
        nearest = uses[best, np.arange(count)]
        nearer = nearest < used
        used[nearer], peaks[nearer] = nearest[nearer], tried[best, np.arange(count)][nearer]
        meets = limited.met(tried)
        helped = np.flatnonzero(meets.any(axis=0))
        if helped.size:
            edge = _edge(priced, limited, family, points[helped], np.argmax(meets[:, helped], axis=0))
            factors[family, helped] = edge
            settling[family, helped] = priced.settling(family, edge, points[helped])
    # One that does not settle within the response comes after every one that does.
    order = np.where(np.isnan(factors), np.inf, np.where(np.isfinite(settling), settling, _NOT_SETTLED))
    chosen = np.argmin(order, axis=0)
    return chosen, factors[chosen, np.arange(count)], peaks


def _edge(priced: PricedFeedback, limited: Limited, family: int, points: IntArray, first: IntArray) -> FloatArray:
    """Factor (P,) at which the limits begin to be met, between the `first` of `FACTORS` and the one before it."""
    ladder = np.concatenate([[1.0], FACTORS])
    low, high = np.log(ladder[first]), np.log(ladder[first + 1])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        meets = limited.met(priced.peaks(family, np.exp(middle), points))
        low, high = np.where(meets, low, middle), np.where(meets, middle, high)
    return np.asarray(np.exp(high))
