"""What becomes of points: reasons and numbers where specs cannot be met, points that failed before, odd plants."""

from dataclasses import replace

import numpy as np
import pytest

from design.assess import achieved, assess
from design.classical.controller import ClassicalController
from design.classical.steering import StepReference
from design.classical.synthesis import design_classical, gain_values
from design.classical.tab_loop import tab_loop
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.flight import flight_condition
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import TrimRequest, trim

MARGINS = (
    Spec("damping_ratio", "min", 0.5),
    Spec("gain_margin", "min", 6.0),
    Spec("phase_margin", "min", np.pi / 4),
)
NF = ClassicalController("nf", "negative_feedback", MARGINS, 2.0 * np.pi * 100.0)
PF = ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),))


def designed(plant, actuator, controller, horizon=1.0, outcomes=None):
    reference = StepReference(np.deg2rad(10.0), horizon, plant.trim.state[..., 0])
    ok = Outcomes.all_ok(plant.grid.shape) if outcomes is None else outcomes
    return design_classical(plant.servo, actuator, controller, reference, ok)


def test_one_blocking_spec_is_named_with_its_best_value(plant_a, tab_actuator):
    """Settling in a time no gain reaches: that spec alone is in the way, and its best value is attainable."""
    impossible = replace(NF, specs=(*MARGINS, Spec("settling_time", "max", 0.05)))
    found = designed(plant_a, tab_actuator, impossible)
    why = found.infeasibility[0, 0]
    assert found.outcomes.codes[0, 0] == Outcome.INFEASIBLE
    assert "settling time at most 0.05 s" in found.outcomes.reasons[0, 0]
    assert why.blocking.quantity == "settling_time"
    assert 0.05 < why.reachable < 0.3
    assert [r.percent for r in why.relaxations] == sorted(r.percent for r in why.relaxations)
    assert why.relaxations[0].percent == pytest.approx(100.0 * (why.reachable / 0.05 - 1.0))
    relaxed = replace(NF, specs=(*MARGINS, Spec("settling_time", "max", 1.02 * why.reachable)))
    assert designed(plant_a, tab_actuator, relaxed).outcomes.ok[0, 0]


def test_a_spec_missed_ten_thousand_times_over_is_still_the_one_that_blocks(plant_a, tab_actuator):
    impossible = replace(NF, specs=(*MARGINS, Spec("settling_time", "max", 1e-5)))
    found = designed(plant_a, tab_actuator, impossible)
    assert found.outcomes.reasons[0, 0].startswith("asked: settling time at most 1e-05 s")
    assert 0.05 < found.infeasibility[0, 0].reachable < 0.3


def test_points_that_failed_before_stay_as_they_are(plant_a, tab_actuator):
    where = np.zeros(plant_a.grid.shape, bool)
    where[0, 1] = True
    before = Outcomes.all_ok(plant_a.grid.shape).failing(where, Outcome.EXCLUDED, lambda index: "by request")
    found = designed(plant_a, tab_actuator, PF, outcomes=before)
    assert found.outcomes.codes[0, 1] == Outcome.EXCLUDED
    assert found.outcomes.reasons[0, 1] == "by request"
    assert np.isnan(found.gains[0].values[0, 1])
    assert np.isfinite(found.gains[0].values[0, 0])


def test_a_design_slower_than_one_radian_a_second_is_a_design(plant_a, tab_actuator):
    """The ranks of the search must not depend on the unit of time: here the aileron's frequency is 0.3 rad/s."""
    condition = flight_condition(0.0, "airspeed", np.array([0.2]))
    slow = linearise(plant_a.system, condition, trim(plant_a.system, condition, TrimRequest(alpha=0.0)))
    servo, actuator = servo_tab(slow), replace(tab_actuator, servo_bandwidth=2.5)
    assert servo.natural_frequency[0] < 0.4
    reference = StepReference(np.deg2rad(10.0), 200.0, np.zeros(1))
    found = design_classical(servo, actuator, PF, reference, Outcomes.all_ok((1,)))
    assert found.outcomes.ok.all(), found.outcomes.reasons
    loop = tab_loop(slow, servo, actuator, PF, gain_values(found.gains))
    exact = assess(loop, np.array([0.1]), 200.0)
    assert exact.step.bandwidth[0] < 1.0
    assert PF.specs[0].met(achieved(exact, "damping_ratio")).all()


@pytest.mark.parametrize("cutoff_hz", [100.0, 300.0])
def test_a_resonance_between_the_samples_flatters_nobody(unsteady_a, tab_actuator, cutoff_hz):
    """A slow servo and no damping asked for: lightly damped modes ring on between the search's samples."""
    specs = (Spec("gain_margin", "min", 4.0), Spec("settling_time", "max", 0.4), Spec("overshoot", "max", 0.02))
    controller = ClassicalController("nf", "negative_feedback", specs, 2.0 * np.pi * cutoff_hz)
    actuator = replace(tab_actuator, servo_bandwidth=2.0 * np.pi * 5.0)
    found = designed(unsteady_a, actuator, controller)
    assert found.outcomes.ok.all()
    loop = tab_loop(unsteady_a.model, unsteady_a.servo, actuator, controller, gain_values(found.gains))
    exact = assess(loop, np.array([np.deg2rad(10.0)]), 1.0)
    for spec in specs:
        assert np.all(spec.met(achieved(exact, spec.quantity))), spec


def test_no_authority_is_infeasible_with_its_reason(plant_a, tab_actuator):
    without = replace(plant_a.servo, G=0.0 * plant_a.servo.G)
    reference = StepReference(np.deg2rad(10.0), 1.0, plant_a.trim.state[..., 0])
    found = design_classical(without, tab_actuator, PF, reference, Outcomes.all_ok(plant_a.grid.shape))
    assert np.all(found.outcomes.codes == Outcome.INFEASIBLE)
    assert "tab can move" in found.outcomes.reasons[0, 0]
