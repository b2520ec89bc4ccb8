"""The fastest tab-only design within the limits of the tab's actuator (6.3.2, turned round).

Rate and deflection are specs like others: the search for the fastest gains takes them as they are
(`design.classical.steering`). Torque and power do not steer it. For them the limit of the rate is lowered further,
point by point, until they are met too: the torque of a tab that moves at a lower rate is lower, the steady hinge moment
apart, which nothing lowers. Of the rates tried the largest that meets all limits is kept, found by halving the interval
of its logarithm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.synthesis import gain_values
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.arrays import BoolArray, FloatArray, Floats, ObjectArray
from schedules.actuator_limits import Limited
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.judging import judged
from schedules.run import design
from schedules.slower import Slower
from schedules.study import Study

#: Smallest part of the rate that is tried, and how often the interval down to it is halved.
SLOWEST, HALVINGS = 1.0 / 64.0, 8
#: Limits that steer the search.
_STEERING = ("deflection", "rate")


def slower_tab_only(study: Study, plant: PlantEnvelope, designed: DesignedController, limited: Limited) -> Slower:
    """Slow a design down where it breaks limits of the tab's actuator; what holds stays as it is.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : a tab-only controller, its gains chosen by specs
    limited : limits of the tab's actuator

    Raises
    ------
    ValueError : all gains are given, so that nothing can be chosen
    """
    request = designed.request
    assert isinstance(request, ClassicalController)
    if request.all_gains_given:
        raise ValueError(f"all gains of the controller {request.name} are given: there is no design to choose")
    peaks = limited.peaks_of(designed)
    best = _Best.of(designed, limited)
    broken = designed.outcomes.ok & ~limited.met(peaks)
    steady = _steady(designed, limited)
    hopeless = broken & np.any(steady > limited.values, axis=-1)
    best.give_up(hopeless, limited, steady, "to hold the reference alone takes")
    left = broken & ~hopeless
    limits = dict(zip(limited.names, limited.values.tolist(), strict=True))
    steering = {name: limit for name, limit in limits.items() if name in _STEERING}
    if steering and np.any(left):
        first = _within(study, plant, request, steering, left)
        asks = limited.peaks_of(first)
        best.take(first, left & limited.met(asks), "specs")
        best.fail(left & ~first.outcomes.ok, first, limited)
        left = left & first.outcomes.ok & ~limited.met(asks)
        peaks = np.where(left[..., None], asks, peaks)
        rate = _rate_of(first)
    else:
        rate = _rate_of(designed)
    if np.any(left):
        _search(study, plant, request, limited, steering, best, left, rate, peaks)
    return best.judged(study, plant, request)


def _search(
    study: Study,
    plant: PlantEnvelope,
    request: ClassicalController,
    limited: Limited,
    steering: dict[str, float],
    best: _Best,
    left: BoolArray,
    rate: FloatArray,
    peaks: FloatArray,
) -> None:
    """Lower the rate at the points of `left`, where a design of this peak rate (*G,) has these peaks (*G, k)."""
    low, high = np.full(left.shape, np.log(SLOWEST)), np.zeros(left.shape)
    found, least, used = np.zeros(left.shape, dtype=bool), peaks.copy(), limited.used(peaks)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        allowed = np.where(left, np.exp(middle) * rate, 1.0)
        trial = _within(study, plant, request, steering | {"rate": allowed}, left)
        asks, made = limited.peaks_of(trial), left & trial.outcomes.ok
        meets = made & limited.met(asks)
        best.take(trial, meets, "tab_rate")
        nearer = made & (limited.used(asks) < used)
        least[nearer], used[nearer] = asks[nearer], limited.used(asks)[nearer]
        found |= meets
        too_much = made & ~meets
        high = np.where(too_much, middle, high)
        low = np.where(left & ~too_much, middle, low)
    best.give_up(left & ~found, limited, least, "with the specs met at any rate of the tab the nearest has")


def _within(
    study: Study, plant: PlantEnvelope, request: ClassicalController, limits: Mapping[str, Floats], where: BoolArray
) -> DesignedController:
    """The fastest design at the points of a mask with the tab's motion limited too."""
    specs = list(request.specs)
    for name, limit in limits.items():
        quantity = f"tab_{name}"
        given = [spec for spec in specs if spec.quantity == quantity]
        asked = np.minimum(limit, given[0].limit) if given else np.asarray(limit)
        specs = [spec for spec in specs if spec.quantity != quantity]
        specs.append(Spec(quantity, "max", np.broadcast_to(asked, where.shape)))
    outcomes = plant.outcomes.failing(~where, Outcome.EXCLUDED, lambda _: "not searched")
    return design(study, replace(plant, outcomes=outcomes), replace(request, specs=tuple(specs), smoothness=0.0))


def _rate_of(designed: DesignedController) -> FloatArray:
    """(*G,) peak rate of the tab; nan where there is no design."""
    found = designed.assessment
    return np.full(designed.outcomes.ok.shape, np.nan) if found is None else found.demand[0].peak_rate


def _steady(designed: DesignedController, limited: Limited) -> FloatArray:
    """(*G, k) what no design goes below: the torque that holds the reference; nan for what is not a torque."""
    assert designed.assessment is not None
    least = np.full((*designed.outcomes.ok.shape, len(limited.names)), np.nan)
    if "torque" in limited.names:
        least[..., limited.names.index("torque")] = designed.assessment.demand[0].holding_torque
    return least


@dataclass(eq=False)
class _Best:
    """The design that is kept at each point, while the search goes on."""

    gains: dict[str, FloatArray]
    units: dict[str, str]
    rate: FloatArray
    outcomes: Outcomes
    steered_by: ObjectArray
    least: FloatArray

    @classmethod
    def of(cls, designed: DesignedController, limited: Limited) -> _Best:
        """The design as it is."""
        ok = designed.outcomes.ok
        return cls(
            gains={gain.name: gain.values.copy() for gain in designed.gains},
            units={gain.name: gain.unit for gain in designed.gains},
            rate=_rate_of(designed),
            outcomes=designed.outcomes,
            steered_by=np.full(ok.shape, None, dtype=object),
            least=np.full((*ok.shape, len(limited.names)), np.nan),
        )

    def take(self, trial: DesignedController, where: BoolArray, steered_by: str) -> None:
        """Keep a trial at the points of a mask."""
        for name, values in gain_values(trial.gains).items():
            self.gains[name][where] = values[where]
        self.steered_by[where] = steered_by

    def fail(self, where: BoolArray, trial: DesignedController, limited: Limited) -> None:
        """Points where the specs with the limits beside them cannot be met, for the reason that the search gives."""
        reasons, why = trial.outcomes.reasons, trial.infeasibility
        for index in map(tuple, np.argwhere(where)):
            found = None if why is None else why[index]
            for relaxed in () if found is None else found.relaxations:
                name = relaxed.spec.quantity.removeprefix("tab_")
                if name in limited.names:
                    self.least[(*index, limited.names.index(name))] = relaxed.limit
        self.outcomes = self.outcomes.failing(
            where, Outcome.INFEASIBLE, lambda index: f"within the limits of the actuator: {reasons[index]}"
        )

    def give_up(self, where: BoolArray, limited: Limited, least: FloatArray, why: str) -> None:
        """Points where nothing helps, and what came nearest (*G, k)."""
        self.least[where] = least[where]
        self.outcomes = self.outcomes.failing(
            where, Outcome.INFEASIBLE, lambda index: f"{why} {limited.said(least[index])}"
        )

    def judged(self, study: Study, plant: PlantEnvelope, request: ClassicalController) -> Slower:
        """All that is kept, judged by the specs of the request."""
        ok = self.outcomes.ok
        gains = tuple(Gain(name, self.units[name], np.where(ok, v, np.nan)) for name, v in self.gains.items())
        loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, gain_values(gains))
        designed = judged(study, plant, request, self.outcomes, gains, loop)
        kept = designed.outcomes.ok
        self.steered_by[~kept] = None
        return Slower(designed, self.steered_by, np.where(kept, _rate_of(designed) / self.rate, np.nan), self.least)
