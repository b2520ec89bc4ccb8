"""Loops that are faster by far than their delays are withdrawn without counting all their unstable poles."""

from dataclasses import replace

import numpy as np

from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.weights import BrysonWeights
from design.outcome import Outcome
from model.actuators import Actuator

WEIGHTS = BrysonWeights(
    aileron=0.035, aileron_rate=3.5, tab=0.17, tab_rate=7.0, aileron_integral=0.0017, tab_torque=0.5, aileron_torque=2.0
)


def test_a_delay_of_a_second_is_withdrawn_at_once(plant_a):
    late = Actuator(delay=1.0)
    extreme = replace(WEIGHTS, tab_torque=1e6, aileron_torque=1e6)
    design = design_lqr(plant_a.model, LqrController("lqr", extreme), tab=late, aileron=late)
    assert np.all(design.outcomes.codes == Outcome.NOT_CERTIFIED)
    assert all("could not be proved stable" in reason for reason in design.outcomes.reasons.flat)


def test_a_short_delay_is_still_proved(plant_a):
    design = design_lqr(
        plant_a.model, LqrController("lqr", WEIGHTS), tab=Actuator(delay=0.0005), aileron=Actuator(delay=0.0005)
    )
    assert design.outcomes.ok.all(), design.outcomes.reasons
