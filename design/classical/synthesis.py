"""Tab-only classical controllers: what is asked for, and their design over the grid (seed chapter 4).

With ``sigma`` the sign of the servo-tab's DC gain (negative: tab up drives the aileron down), every gain is
at least zero and the laws are

- ``negative_feedback`` (4.2.1): ``dt_cmd = sigma [K_i int(r_a - da) - K_p da - K_d da']``
- ``positive_feedback`` (4.2.2): ``dt_cmd = sigma [K_i int(r_a - da) + K_f da]``
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.classical.gain_search import Infeasibility, search_gains
from design.classical.normal_form import NormalForm
from design.gains import Gain
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray
from model.servo_tab import ServoTab

Structure = Literal["negative_feedback", "positive_feedback"]

#: Gains in the order in which their loops are closed, with the unit of each.
GAIN_UNITS: dict[Structure, dict[str, str]] = {
    "negative_feedback": {"K_d": "s", "K_p": "1", "K_i": "1/s"},
    "positive_feedback": {"K_f": "1", "K_i": "1/s"},
}

LAWS: dict[Structure, str] = {
    "negative_feedback": "dt_cmd = sigma (K_i int(r_a - da) - K_p da - K_d da_rate), sigma = -1",
    "positive_feedback": "dt_cmd = sigma (K_i int(r_a - da) + K_f da), sigma = -1",
}


@dataclass(frozen=True)
class ClassicalController:
    """A tab-only controller asked for by its specs; the tab is commanded by deflection.

    Attributes
    ----------
    name : unique in its study
    kind : ``negative_feedback`` or ``positive_feedback``
    specs : what the design must meet; quantities of `design.classical.gain_search.STEERABLE`
    rate_filter : cut-off w of the filtered derivative ``w s / (s + w)`` that supplies da' [rad/s];
        None when the rate is measured. Unused by positive feedback, which needs no rate.
    """

    name: str
    kind: Structure
    specs: tuple[Spec, ...] = ()
    rate_filter: float | None = None


def design_classical(
    servo: ServoTab,
    actuator: Actuator,
    controller: ClassicalController,
    horizon: float,
    outcomes: Outcomes,
) -> tuple[tuple[Gain, ...], Outcomes]:
    """Fastest gains that meet the specs at every point: the largest bandwidth of r_a -> da.

    Parameters
    ----------
    servo : servo-tab model over the grid
    actuator : the tab's actuator; its deflection servo must be second order
    controller : structure and specs
    horizon : how long step responses are followed for settling time and overshoot [s]
    outcomes : points that are not ok are left alone

    Returns
    -------
    The gains, (*G,) each, nan where the point is not ok, and the outcomes: a point whose specs cannot be met
    together is ``infeasible``, with the blocking spec and the best value it can reach.
    """
    names = tuple(GAIN_UNITS[controller.kind])
    shape = outcomes.ok.shape
    values = np.full((len(names), *shape), np.nan)
    outcomes = _without_authority(servo, outcomes)
    ok = outcomes.ok
    if np.any(ok):
        form = NormalForm.of(servo.take(ok), actuator, controller.kind, controller.rate_filter)
        found = search_gains(form, controller.specs, horizon)
        values[:, ok] = np.moveaxis(form.gains(found.coordinates), -1, 0)
        outcomes = _mark_infeasible(outcomes, ok, found.feasible, found.infeasibility)
        values[:, ~outcomes.ok] = np.nan
    gains = tuple(Gain(name, GAIN_UNITS[controller.kind][name], v) for name, v in zip(names, values, strict=True))
    return gains, outcomes


def _without_authority(servo: ServoTab, outcomes: Outcomes) -> Outcomes:
    """Points where no deflection of the tab moves the aileron to a steady angle."""
    stiffness, gain = servo.static_stiffness, servo.static_tab_effect
    with np.errstate(invalid="ignore"):
        bad = ~((stiffness > 0) & (gain != 0))

    def reason(index: tuple[int, ...]) -> str:
        return (
            f"the servo-tab model has stiffness {stiffness[index]:.4g} 1/s^2 and tab effect {gain[index]:.4g} 1/s^2; "
            "tab-only control needs a statically stable aileron that the tab can move"
        )

    return outcomes.failing(bad, Outcome.INFEASIBLE, reason)


def _mark_infeasible(
    outcomes: Outcomes, ok: BoolArray, feasible: BoolArray, infeasibility: tuple[Infeasibility | None, ...]
) -> Outcomes:
    """Spread the search's verdict over the grid and say what blocks each point."""
    bad = np.zeros(ok.shape, dtype=bool)
    bad[ok] = ~feasible
    order = np.full(ok.shape, -1)
    order[ok] = np.arange(int(ok.sum()))

    def reason(index: tuple[int, ...]) -> str:
        found = infeasibility[int(order[index])]
        return "no gains meet the specs" if found is None else found.describe()

    return outcomes.failing(bad, Outcome.INFEASIBLE, reason)


def gain_values(gains: tuple[Gain, ...]) -> dict[str, FloatArray]:
    """Gain arrays by name."""
    return {gain.name: gain.values for gain in gains}
