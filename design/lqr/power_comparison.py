"""The response before and after power is weighed, at equal settling time, point by point (seed Fig 5.3)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.lqr.controller import LqrController
from design.lqr.flown import flown_loop
from design.lqr.power_figures import PowerFigures, power_figures, step_of
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, ReferenceStep
from design.lqr.retuning import Retuning
from design.lqr.synthesis import LqrDesign, design_lqr
from design.outcome import Outcomes
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray, GridArrays
from model.linear_model import LinearModel

_IDEAL = Actuator()


@dataclass(frozen=True, eq=False)
class PoweredStep(GridArrays):
    """Response to the reference step, totals; nan where there is no design.

    Attributes
    ----------
    figures : peak powers, settling time and overshoot
    time : (*G, T) [s]
    aileron, tab : (*G, T) angles [rad]
    aileron_torque, tab_torque : (*G, T) [N m]
    aileron_power, tab_power : (*G, T) torque times rate [W], positive when the motor drives the surface
    """

    figures: PowerFigures
    time: FloatArray
    aileron: FloatArray
    tab: FloatArray
    aileron_torque: FloatArray
    tab_torque: FloatArray
    aileron_power: FloatArray
    tab_power: FloatArray


@dataclass(frozen=True, eq=False)
class PowerComparison(GridArrays):
    """Both designs on the same step.

    Attributes
    ----------
    before, after : without power weighting, and with it, at the same settling time
    retuning : (*G) factors on the weights with power weighting, that keep the settling time
    outcomes : (*G,) of the design with power weighting
    """

    before: PoweredStep
    after: PoweredStep
    retuning: Retuning
    outcomes: Outcomes

    @property
    def total_ratio(self) -> FloatArray:
        """Peak total power after over before (*G,)."""
        return np.asarray(self.after.figures.total / self.before.figures.total)


def power_comparison(
    model: LinearModel,
    controller: LqrController,
    outcomes: Outcomes | None = None,
    tab: Actuator = _IDEAL,
    aileron: Actuator = _IDEAL,
    samples: int = 501,
) -> PowerComparison:
    """Design with the weights without power and, retuned to the same settling time, with power weighed.

    Parameters
    ----------
    model, outcomes, tab, aileron : as for `design.lqr.synthesis.design_lqr`
    controller : its weights weigh power, and hold the step
    samples : samples T of the responses

    Raises
    ------
    ValueError : weights that do not weigh power, or of net work without a step to be retuned on
    WeightsRefused : as `design_lqr`
    """
    weights = controller.weights
    if isinstance(weights, PowerBalancedWeights):
        step, weights = weights.step, replace(weights, keep_settling=True)
    elif isinstance(weights, NetWorkWeights) and weights.retuned_on is not None:
        step = weights.retuned_on
    else:
        raise ValueError("a comparison needs weights that weigh power, and a step on which it is judged")
    plain = design_lqr(model, replace(controller, weights=weights.base), outcomes, tab, aileron)
    weighed = design_lqr(model, replace(controller, weights=weights), outcomes, tab, aileron)
    if weighed.retuning is None:
        raise ValueError("weights that keep the settling time have no factors")
    before, after = (_response(model, design, step, samples) for design in (plain, weighed))
    return PowerComparison(before, after, weighed.retuning, weighed.outcomes)


def _response(model: LinearModel, design: LqrDesign, step: ReferenceStep, samples: int) -> PoweredStep:
    ok: BoolArray = design.outcomes.ok
    loop = flown_loop(model.take(ok), design.structure, design.K[ok], design.N[ok])
    response = step_of(loop, step, samples)
    signal = {name: response.outputs[..., response.index(name)] for name in response.names}
    return PoweredStep(
        figures=power_figures(loop, step),
        time=response.time,
        aileron=signal["da"],
        tab=signal["dt"],
        aileron_torque=signal["T_a"],
        tab_torque=signal["T_t"],
        aileron_power=signal["T_a"] * signal["da_rate"],
        tab_power=signal["T_t"] * signal["dt_rate"],
    ).spread(ok)
