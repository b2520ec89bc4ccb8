"""What a search of weights is about, said of a loop whatever its weights: values of specs, and what is made least."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from design.assess import achieved, assess
from design.loop import Loop
from design.lqr.power_figures import power_figures
from design.lqr.power_weights import ReferenceStep
from design.lqr.weight_request import Minimised
from design.specs import Spec
from model.arrays import FloatArray


def step_figures(
    loop: Loop, specs: tuple[Spec, ...], minimised: Minimised, step: ReferenceStep
) -> tuple[FloatArray, FloatArray]:
    """Values (N, s) of the specs' quantities and what is made least (N,), on the reference step.

    Parameters
    ----------
    loop : (N) of state feedback, finite at every point; it follows a reference
    specs : of the quantities that `design.lqr.weight_request.SENSES` names; their limits do not count
    minimised : see `design.lqr.weight_request.WeightSearch`
    step : the references' sizes, and how long they are followed
    """
    sizes = {"r_a": step.aileron, "r_t": step.tab}
    reference = np.array([sizes[name] for name in loop.references])
    assessment = assess(loop, reference, step.duration, samples=2)
    values = np.full((len(loop.A), len(specs)), np.nan)
    for k, spec in enumerate(specs):
        values[:, k] = achieved(assessment, spec.quantity)
    tab, aileron = assessment.demand
    found: dict[Minimised, Callable[[], FloatArray]] = {
        "total_rms_power": lambda: tab.rms_power + aileron.rms_power,
        "peak_aileron_torque": lambda: aileron.peak_torque,
        "peak_total_power": lambda: power_figures(loop, step).total,
        "energy_out": lambda: tab.energy_out + aileron.energy_out,
    }
    return values, np.asarray(found[minimised]())
