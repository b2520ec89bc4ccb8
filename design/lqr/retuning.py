"""Weights scaled point by point until powers and settling of the reference step are what is wanted (seed 5.2).

Up to three factors at every point, and as many figures that they are for:

======= ============================================ =========================================
factor  multiplies                                   until
======= ============================================ =========================================
rho_t   the weights of the tab's torque and rate     the tab's peak power is its share
rho_a   the weights of the aileron's torque and rate the aileron's peak power is its share
sigma   the weights of the integrals                 the aileron settles as it did without power
======= ============================================ =========================================

They are sought all at once, by their logarithms, each trial a design and its exact step response. Peak powers have
kinks where another peak becomes the largest, settling times jump where a ripple leaves the band, and not every power
can be had at every settling time: a point where the figures are not met to `TOLERANCE` gets no weights, but is told
what came nearest.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from design.lqr.cost import Cost
from design.lqr.flown import flown_loop
from design.lqr.power_figures import PowerFigures, power_figures
from design.lqr.power_weights import ReferenceStep
from design.lqr.riccati import solve_riccati
from design.lqr.root_search import search_roots
from design.lqr.tracking import SteadyState, TrackingPlant, feed_forward
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray, ObjectArray
from model.linear_model import LinearModel

#: Largest error of a figure, as a part of it.
TOLERANCE = 1e-6
#: How many responses are held at once.
PART = 1000


@dataclass(frozen=True)
class Wanted:
    """What the reference step is to need.

    Attributes
    ----------
    step : the reference step
    tab_power, aileron_power : peaks [W]; None asks nothing, and scales the weights of that actuator like the other's
    settling : whether the aileron is to settle as with the cost before
    """

    step: ReferenceStep
    tab_power: float | None
    aileron_power: float | None
    settling: bool

    @property
    def asked(self) -> list[int]:
        """Numbers of the figures that something is asked of, in the order of the table."""
        given = (self.tab_power is not None, self.aileron_power is not None, self.settling)
        return [i for i, asked in enumerate(given) if asked]

    @property
    def directions(self) -> FloatArray:
        """How each unknown moves the logarithms of the three factors (k, 3)."""
        directions = np.eye(3)
        if self.tab_power is None:
            directions[1, 0] = 1.0
        if self.aileron_power is None:
            directions[0, 1] = 1.0
        return directions[self.asked]

    def logarithms(self, figures: PowerFigures) -> FloatArray:
        """Of the figures that something is asked of (*G, k)."""
        with np.errstate(divide="ignore"):
            values = np.log(np.stack([figures.tab, figures.aileron, figures.settling_time], axis=-1))
        return np.asarray(values[..., self.asked])

    def targets(self, before: PowerFigures) -> FloatArray:
        """Logarithms (*G, k) of what they are to be; nan where the aileron did not settle before."""
        power = [np.full_like(before.tab, np.nan if p is None else p) for p in (self.tab_power, self.aileron_power)]
        values = np.log(np.stack([*power, before.settling_time], axis=-1))
        return np.asarray(values[..., self.asked])


@dataclass(frozen=True, eq=False)
class Retuning(GridArrays):
    """Factors found, each (*G,); nan where none were.

    Attributes
    ----------
    tab, aileron, integrals : rho_t, rho_a and sigma
    before, after : figures of the step without regard to power, and with these factors
    """

    tab: FloatArray
    aileron: FloatArray
    integrals: FloatArray
    before: PowerFigures
    after: PowerFigures


@dataclass(frozen=True, eq=False)
class Retuned:
    """The scaled cost (*G, ...), what it took, and reasons (*G,), object array of str, why a point has none."""

    cost: Cost
    retuning: Retuning
    reasons: ObjectArray


@dataclass(frozen=True, eq=False)
class _Designs:
    """What is designed, at N points."""

    model: LinearModel
    plant: TrackingPlant
    rest: SteadyState
    step: ReferenceStep

    def figures(self, cost: Cost, factors: FloatArray, points: IntArray) -> PowerFigures:
        """Figures (M,) with factors (M, 3) on the cost at the points of these numbers (M,), `PART` at a time."""
        slices = [slice(first, first + PART) for first in range(0, max(points.size, 1), PART)]
        parts = [self._part(cost, factors[at], points[at]) for at in slices]
        return PowerFigures(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(PowerFigures)))

    def _part(self, cost: Cost, factors: FloatArray, points: IntArray) -> PowerFigures:
        plant, rest = self.plant.take(points), self.rest.take(points)
        cost = scaled_cost(cost.at(points), plant, factors)
        K = solve_riccati(plant.A, plant.B, cost.Q, cost.R, cost.N).K
        return power_figures(flown_loop(self.model.take(points), plant.structure, K, feed_forward(K, rest)), self.step)


def scaled_cost(cost: Cost, plant: TrackingPlant, factors: FloatArray) -> Cost:
    """The cost with the factors (*G, 3) on its weights, in the order of the table."""
    root = np.sqrt(factors)
    x = np.ones((*root.shape[:-1], len(plant.states)))
    for i, rate in enumerate(("dt_rate", "da_rate")):
        x[..., plant.states.index(rate)] = root[..., i]
    for integral in plant.structure.integrals:
        x[..., plant.states.index(integral)] = root[..., 2]
    return cost.scaled(x, root[..., :2])


def retuned(
    model: LinearModel, plant: TrackingPlant, rest: SteadyState, before: Cost, cost: Cost, wanted: Wanted, ok: BoolArray
) -> Retuned:
    """Scale `cost` at the points of `ok` until the figures are what is wanted.

    A point without a design before anything is scaled keeps the factors 1, so that its design fails for its own reason.

    Parameters
    ----------
    model, plant, rest : (*G) what is designed
    before : the cost without regard to power, whose settling time is kept
    cost : the cost that is scaled
    wanted : the figures
    ok : (*G,)
    """
    designs = _Designs(model.take(ok), plant.take(ok), rest.take(ok), wanted.step)
    some, every = cost.at(ok), np.arange(np.count_nonzero(ok))
    same = np.ones((every.size, 3))
    at_first, unscaled = (designs.figures(each, same, every) for each in (before.at(ok), some))
    targets = wanted.targets(at_first)
    posed = np.isfinite(at_first.total) & np.isfinite(unscaled.total)
    searched = np.flatnonzero(posed & np.isfinite(targets).all(axis=-1))

    def errors(unknowns: FloatArray, points: IntArray) -> FloatArray:
        chosen = np.tile(searched[points], len(unknowns))
        factors = np.exp(unknowns @ wanted.directions).reshape(-1, 3)
        found = wanted.logarithms(designs.figures(some, factors, chosen)) - targets[chosen]
        return found.reshape(unknowns.shape)

    roots = search_roots(errors, searched.size, len(wanted.asked), TOLERANCE)
    factors, met = same.copy(), np.zeros(every.size, dtype=bool)
    factors[searched] = np.exp(roots.unknowns @ wanted.directions)
    met[searched] = np.abs(roots.errors).max(axis=-1, initial=0.0) <= TOLERANCE
    nearest = designs.figures(some, factors, every)
    reasons, whole = np.full(ok.shape, None, dtype=object), np.ones((*ok.shape, 3))
    reasons[ok] = [_why(wanted, at_first.take(i), nearest.take(i)) if posed[i] and not met[i] else None for i in every]
    whole[ok] = np.where(met[:, None], factors, 1.0)
    found = np.where(met[:, None], factors, np.nan)
    retuning = Retuning(found[:, 0], found[:, 1], found[:, 2], at_first, nearest)
    return Retuned(scaled_cost(cost, plant, whole), retuning.spread(ok), reasons)


def _why(wanted: Wanted, before: PowerFigures, nearest: PowerFigures) -> str:
    """Why a point has no factors."""
    if wanted.settling and not np.isfinite(before.settling_time):
        return (
            f"without regard to power the aileron does not settle within {wanted.step.duration:.6g} s: "
            "there is no settling time to keep"
        )
    asked, found = [], []
    powers = ("tab", wanted.tab_power, nearest.tab), ("aileron", wanted.aileron_power, nearest.aileron)
    for name, power, value in powers:
        if power is not None:
            asked.append(f"{power:.6g} W at the {name}")
            found.append(f"{float(value):.6g} W at the {name}")
    if wanted.settling:
        asked.append(f"settling within {float(before.settling_time):.6g} s")
        found.append(f"settling within {float(nearest.settling_time):.6g} s")
    return f"no factors of the weights were found for {', '.join(asked)}; the nearest have {', '.join(found)}"
