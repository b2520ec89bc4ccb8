"""Everything that is said of a closed loop, from the one loop that is flown; and the verdicts on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.frequency.margins import Margins, margins
from design.frequency.poles import least_damping_ratio, poles
from design.loop import Loop
from design.response.demand import ActuatorDemand, actuator_demands
from design.response.step_metrics import StepMetrics, step_metrics
from design.response.step_response import step_response
from design.specs import SPEC_PACKS, Spec, Verdict
from model.actuators import Actuator
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class Assessment(GridArrays):
    """Figures of a loop over the grid.

    Attributes
    ----------
    poles : (*G, n) closed-loop poles [rad/s]
    margins : one for each actuator input at which the loop is cut, the other inputs closed
    step : the aileron's response to the reference step
    demand : one for each actuator of the loop
    actuators : names of cuts and actuators, in that order
    """

    poles: ComplexArray
    margins: tuple[Margins, ...]
    step: StepMetrics
    demand: tuple[ActuatorDemand, ...]
    actuators: tuple[str, ...]


def assess(loop: Loop, reference: FloatArray, duration: float, samples: int = 501) -> Assessment:
    """Judge a loop whose matrices are finite at every point.

    Parameters
    ----------
    loop : over any grid (`Loop.take` the points that carry gains)
    reference : (p,) sizes of the step in each reference [rad]
    duration : how long the step is followed [s]
    samples : samples of the step; peaks and times are refined between them
    """
    response = step_response(loop, reference, duration, samples)
    return Assessment(
        poles=poles(loop.closed),
        margins=_margins_of_cuts(loop),
        step=step_metrics(loop, response, "da", reference),
        demand=actuator_demands(loop, response, loop.inputs),
        actuators=loop.inputs,
    )


def _margins_of_cuts(loop: Loop) -> tuple[Margins, ...]:
    """Margins at every actuator input; one batch where the inputs' delays allow it."""
    if len(set(loop.delay)) == 1:
        stacked = margins(loop.cuts())
        return tuple(stacked.take(i) for i in range(len(loop.inputs)))
    return tuple(margins(loop.cut(name)) for name in loop.inputs)


def achieved(assessment: Assessment, quantity: str) -> FloatArray | None:
    """(*G,) value of a quantity of `design.specs.QUANTITIES`; None when this loop does not have it.

    Of several cuts the worst one counts.
    """
    cuts = assessment.margins
    worst: dict[str, Callable[[], FloatArray]] = {
        "gain_margin": lambda: np.min([np.minimum(m.gain_margin_up_db, -m.gain_margin_down_db) for m in cuts], axis=0),
        "phase_margin": lambda: np.min([m.phase_margin for m in cuts], axis=0),
        "disk_margin": lambda: np.min([m.disk_margin for m in cuts], axis=0),
        "sensitivity_peak": lambda: np.max([m.sensitivity_peak for m in cuts], axis=0),
        "damping_ratio": lambda: least_damping_ratio(assessment.poles),
        "settling_time": lambda: assessment.step.settling_time,
        "overshoot": lambda: assessment.step.overshoot,
    }
    if quantity in worst:
        return np.asarray(worst[quantity]())
    actuator, what = quantity.split("_", 1)
    if actuator not in assessment.actuators:
        return None
    return np.asarray(getattr(assessment.demand[assessment.actuators.index(actuator)], f"peak_{what}"))


def limit_specs(actuators: dict[str, Actuator]) -> tuple[Spec, ...]:
    """The actuators' limits as specs; a limit that is absent is no spec."""
    specs = []
    for name, actuator in actuators.items():
        limits = actuator.limits
        for what in ("deflection", "rate", "torque", "power"):
            limit = getattr(limits, what)
            if limit is not None:
                specs.append(Spec(f"{name}_{what}", "max", limit, "limits"))
    return tuple(specs)


def verdicts(
    assessment: Assessment,
    judged: BoolArray,
    asked: tuple[Spec, ...],
    pack: str,
    actuators: dict[str, Actuator],
) -> tuple[Verdict, ...]:
    """Verdict on each spec asked for, of the pack and of the actuators' limits, over the grid.

    Parameters
    ----------
    assessment : over the whole grid, nan where a point carries no design
    judged : (*G,) mask of the points that carry one
    """
    found = []
    for spec in (*asked, *SPEC_PACKS[pack], *limit_specs(actuators)):
        values = achieved(assessment, spec.quantity)
        if values is not None:
            found.append(Verdict(spec, np.where(judged, values, np.nan), judged, judged & spec.met(values)))
    return tuple(found)
