"""Which actuator a designed controller needs: candidates judged on what the design asks for over the envelope (6.3.2).

A candidate's rotor is accelerated with the surface. That costs torque, which its headroom counts, and it changes the
plant that the controller was designed for, which it does not: with `fed_back` the surface gets the rotor's inertia
(`schedules.rotor_inertia`) and the same request is designed again, at every gear ratio that is looked at. The ratio
that is best then can be far from the one that is best for the design without a rotor, and a ratio that is best for the
very design that was made with it need not be the best there is (both on the wind-tunnel example). So ratios are
compared each on its own design.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.actuator_sizing.selection import Candidate, Fit, RatioRange, fit, select
from design.classical.controller import ClassicalController
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.rotor_inertia import plant_with_rotor
from schedules.run import design
from schedules.study import Study
from schedules.surface_requirement import ActuatorRequirement, Sized, actuator_requirement

#: Designs that one candidate may take, and how many of them look its range of gear ratios through.
MOST_DESIGNS, LOOKED_THROUGH = 32, 9
#: Of a range of gear ratios each is this much larger than the one before it.
RATIO_STEP = 1.02


@dataclass(frozen=True, eq=False)
class FedBack:
    """A candidate on the design that has its rotor.

    Attributes
    ----------
    fit : at the best gear ratio, on the design that was made with it
    rotor_inertia : at the surface, of that design [kg m^2]
    required : what that design asks for
    designed : the controller, designed again
    designs : how many designs it took; 0 where the rotor changes no design
    converged : whether no ratio beside the best one is better: of a range, 2 % more or less
    lost : flat indices of the points that have a design without the rotor and none with it
    """

    fit: Fit
    rotor_inertia: float
    required: ActuatorRequirement
    designed: DesignedController
    designs: int
    converged: bool
    lost: tuple[int, ...]

    @property
    def enough(self) -> bool:
        """Whether the candidate meets every requirement, and the rotor costs no point its design."""
        return self.fit.enough and not self.lost


@dataclass(frozen=True, eq=False)
class Choice:
    """A candidate on the design as it is, and on the design with its rotor; None where that was not asked for."""

    fit: Fit
    fed_back: FedBack | None

    @property
    def enough(self) -> bool:
        """Whether the candidate is enough, by the better informed of the two."""
        return self.fit.enough if self.fed_back is None else self.fed_back.enough

    @property
    def least(self) -> float:
        """The least headroom, by the better informed of the two; nan when no point is known."""
        return self.fit.least if self.fed_back is None else self.fed_back.fit.least


@dataclass(frozen=True, eq=False)
class Selection:
    """The requirement of a design, and every candidate judged: those that are enough first, then by least headroom."""

    required: ActuatorRequirement
    choices: tuple[Choice, ...]


def select_actuator(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    sized: Sized,
    candidates: Sequence[Candidate],
    feed_back: bool = False,
) -> Selection:
    """Judge candidates for one actuator of a design.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : a controller with a loop in continuous time
    sized : the actuator, the manoeuvre and the loads
    candidates : to judge, each at its best gear ratio
    feed_back : whether the design is made again with each candidate's rotor

    Raises
    ------
    ValueError : see `actuator_requirement`
    ControllerRefused : weights that cannot work at any point with a rotor
    """
    required = actuator_requirement(plant, designed, sized)
    choices = [
        Choice(found, fed_back(study, plant, designed, sized, required, found) if feed_back else None)
        for found in select(candidates, required.surface)
    ]
    ranked = sorted(choices, key=lambda each: (not each.enough, np.isnan(each.least), -each.least))
    return Selection(required, tuple(ranked))


def fed_back(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    sized: Sized,
    required: ActuatorRequirement,
    start: Fit,
) -> FedBack:
    """A candidate on the design that has its rotor, at the gear ratio with the largest least headroom there.

    Ratios all over the range are looked at first, then those at ever smaller steps beside the best one, each on the
    design that is made with it; one that costs points their design comes after every one that does not. The tab of a
    tab-only controller is driven through what its actuator makes of a command, whatever its inertia: such a design
    is not made again.

    Parameters
    ----------
    study, plant, designed, sized : as in `select_actuator`
    required : of the design without a rotor
    start : the candidate on it
    """
    candidate = start.candidate
    if candidate.inertia == 0.0 or isinstance(designed.request, ClassicalController):
        return FedBack(start, candidate.inertia * start.ratio**2, required, designed, 0, True, ())
    ratios, tried = _ladder(candidate), dict[int, FedBack]()

    def better(i: int, j: int) -> bool:
        return _rank(tried[i]) > _rank(tried[j])

    def look(places: Iterable[int]) -> None:
        for i in places:
            if 0 <= i < len(ratios) and i not in tried and len(tried) < MOST_DESIGNS:
                tried[i] = _with_rotor(study, plant, designed, sized, required, candidate, ratios[i])

    look(np.unique(np.rint(np.linspace(0, len(ratios) - 1, LOOKED_THROUGH)).astype(int)).tolist())
    best = max(tried, key=lambda i: _rank(tried[i]))
    step = -(-(len(ratios) - 1) // (2 * (LOOKED_THROUGH - 1)))
    while step:
        look((best - step, best + step))
        beside = [i for i in (best - step, best + step) if i in tried and better(i, best)]
        if beside:
            best = max(beside, key=lambda i: _rank(tried[i]))
        else:
            step = 0 if step == 1 else -(-step // 2)
    known = all(i in tried for i in (best - 1, best + 1) if 0 <= i < len(ratios))
    return replace(tried[best], designs=len(tried), converged=known)


def most_designs(candidate: Candidate) -> int:
    """How many designs feeding back a rotor may take, of a state feedback."""
    return min(MOST_DESIGNS, len(_ladder(candidate))) if candidate.inertia > 0.0 else 0


def _ladder(candidate: Candidate) -> tuple[float, ...]:
    """The gear ratios that are told apart."""
    if not isinstance(candidate.gear_ratio, RatioRange):
        return candidate.ratios
    low, high = candidate.ratios
    count = 2 + int(np.log(high / low) / np.log(RATIO_STEP))
    return tuple(np.geomspace(low, high, count).tolist())


def _rank(found: FedBack) -> tuple[int, float]:
    """What makes a ratio better than another."""
    return -len(found.lost), -np.inf if np.isnan(found.fit.least) else found.fit.least


def _with_rotor(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    sized: Sized,
    required: ActuatorRequirement,
    candidate: Candidate,
    ratio: float,
) -> FedBack:
    """The candidate at one gear ratio, on the design that is made with it."""
    rotor = candidate.inertia * ratio**2
    changed = plant_with_rotor(plant, sized.actuator, rotor)
    again = design(study, changed, designed.request)
    ok = again.outcomes.ok
    needed = required.take(ok).spread(ok)
    if np.any(ok):
        needed = actuator_requirement(changed, again, sized, rotor)
    found = replace(fit(replace(candidate, gear_ratio=ratio), needed.surface), candidate=candidate)
    lost = tuple(int(i) for i in np.flatnonzero(designed.outcomes.ok & ~ok))
    return FedBack(found, rotor, needed, again, 1, True, lost)
