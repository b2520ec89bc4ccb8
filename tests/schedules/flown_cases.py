"""Controllers of given gains, not judged, and hinge moments that turn about a trim: what is flown off its design."""

from dataclasses import dataclass, replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.outcome import Outcome
from model.hinge_moments.expansion import HingeMoments, HingeMomentSource
from model.section import Body, Inertia
from schedules.designed import DesignedController

FILTER = 2.0 * np.pi * 100.0
NF = ClassicalController("nf", "negative_feedback", rate_filter=FILTER)
PF = ClassicalController("pf", "positive_feedback")
NF_RATE = replace(NF, tab_command="rate")
#: Gains that are stable at every point of the wind-tunnel example, and most of the way around it.
GAINS = {"K_theta": 120.0, "K_d": 0.02, "K_p": 0.6, "K_i": 20.0, "K_f": 0.4}


def given(study, plant, request, gains=None, ok=None):
    """A classical controller of gains that vary a little over the grid; none where the mask is False."""
    shape = plant.outcomes.ok.shape
    ok = plant.outcomes.ok if ok is None else ok & plant.outcomes.ok
    vary = 1.0 + 0.01 * np.arange(plant.outcomes.ok.size).reshape(shape)
    slow = {"K_i": 2.0} if request.kind == "positive_feedback" else {}
    gains = gains or {name: {**GAINS, **slow}[name] * vary for name in request.gain_units}
    values = {name: np.where(ok, gains[name], np.nan) for name in request.gain_units}
    return designed_of(
        study, plant, request, values, plant.outcomes.failing(~ok, Outcome.INFEASIBLE, lambda _: "left out")
    )


def designed_of(study, plant, request, values, outcomes):
    loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, values)
    named = tuple(Gain(name, unit, values[name]) for name, unit in request.gain_units.items())
    none = np.full(outcomes.ok.shape, np.nan)
    return DesignedController(request, outcomes, named, loop, None, none.astype(complex), none, (), None)


@dataclass(frozen=True)
class Turned:
    """Hinge moments whose gradient at one point is multiplied by factors (2, 3), and whose value there is kept."""

    source: HingeMomentSource
    point: tuple[float, float, float]
    factors: np.ndarray
    domain: str = "every angle"

    def at(self, alpha, dt, da):
        moments, here = self.source.at(alpha, dt, da), self.source.at(*self.point)
        more = (self.factors - 1.0) * here.gradient
        away = np.stack(np.broadcast_arrays(alpha, dt, da), axis=-1) - np.array(self.point)
        return HingeMoments(moments.value + away @ more.T, moments.gradient + more)

    def covers(self, alpha, dt, da):
        return self.source.covers(alpha, dt, da)


def turned_system(system, trim, factors):
    """The section with everything that `factors` (by name) multiplies, about one trim."""
    matrix = np.ones((2, 3))
    for name, place in {"C_Ht_dt": (0, 1), "C_Ht_da": (0, 2), "C_Ha_dt": (1, 1), "C_Ha_da": (1, 2)}.items():
        matrix[place] = factors.get(name, 1.0)
    point = float(trim.alpha), float(trim.state[0]), float(trim.state[2])
    source = Turned(system.aerodynamics.source, point, matrix)
    bodies = {
        name: Body(*(getattr(body, part) * factors.get(f"{name}_{part}", 1.0) for part in vars(body)))
        for name, body in vars(system.inertia).items()
    }
    return replace(system, aerodynamics=replace(system.aerodynamics, source=source), inertia=Inertia(**bodies))
