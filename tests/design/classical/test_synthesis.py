"""Synthesis to specs against brute force on the exact figures, and against what the specs demand."""

import numpy as np
import pytest

from design.assess import achieved, assess
from design.classical.gain_search import kappa_of
from design.classical.normal_form import NormalForm
from design.classical.synthesis import GAIN_UNITS, ClassicalController, design_classical, gain_values
from design.classical.tab_loop import tab_loop
from design.outcome import Outcome, Outcomes
from design.specs import Spec

NF_SPECS = (
    Spec("damping_ratio", "min", 0.5),
    Spec("gain_margin", "min", 6.0),
    Spec("phase_margin", "min", np.pi / 4),
    Spec("settling_time", "max", 0.6),
    Spec("overshoot", "max", 0.2),
)
NF = ClassicalController("nf", "negative_feedback", NF_SPECS, 2.0 * np.pi * 100.0)
PF = ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),))
PF_TOO_MUCH = ClassicalController("pf", "positive_feedback", NF_SPECS[:3])


def _exact(plant, actuator, controller, gains):
    loop = tab_loop(plant.model, plant.servo, actuator, controller, gains)
    return loop, assess(loop, np.array([np.deg2rad(10.0)]), 1.0)


@pytest.fixture(scope="module")
def designs(plant_a, plant_b, tab_actuator):
    found = {}
    for plant_name, plant in (("A", plant_a), ("B", plant_b)):
        for controller in (NF, PF):
            ok = Outcomes.all_ok(plant.grid.shape)
            found[plant_name, controller.name] = design_classical(plant.servo, tab_actuator, controller, 1.0, ok)
    return found


@pytest.mark.parametrize("controller", [NF, PF], ids=["nf", "pf"])
@pytest.mark.parametrize("name", ["A", "B"])
def test_every_point_of_the_examples_meets_its_specs_exactly(request, designs, tab_actuator, name, controller):
    plant = request.getfixturevalue(f"plant_{name.lower()}")
    gains, outcomes = designs[name, controller.name]
    assert outcomes.ok.all()
    loop, exact = _exact(plant, tab_actuator, controller, gain_values(gains))
    assert np.all(np.linalg.eigvals(loop.closed).real < 0)
    for spec in controller.specs:
        assert np.all(spec.met(achieved(exact, spec.quantity))), spec
    assert all(np.all(gain.values >= 0) for gain in gains)
    assert {g.name: g.unit for g in gains} == GAIN_UNITS[controller.kind]


@pytest.mark.parametrize("controller", [NF, PF], ids=["nf", "pf"])
def test_brute_force_finds_nothing_faster(plant_a, tab_actuator, designs, controller):
    """Ten thousand candidates a point, judged exactly: 2 % is the most that any gains by."""
    gains, _ = designs["A", controller.name]
    rng = np.random.default_rng(7)
    for index in [(0, 0), (0, 3), (1, 2)]:
        servo, model = plant_a.servo.take(index), plant_a.model.take(index)
        form = NormalForm.of(servo.take(None), tab_actuator, controller.kind, controller.rate_filter)
        ours = np.array([g.values[index] for g in gains])
        count = 5000
        u = rng.uniform(0.0, 1.0, (count, len(gains)))
        anywhere = kappa_of(form, np.zeros(count, int), u) * form.gain_units[0]
        nearby = ours * rng.uniform(0.7, 1.4, (count, len(gains)))
        tried = np.concatenate([anywhere, nearby])
        at = np.zeros(len(tried), int)
        values = dict(zip(GAIN_UNITS[controller.kind], tried.T, strict=True))
        loop = tab_loop(model.take(None).take(at), servo.take(None).take(at), tab_actuator, controller, values)
        r = np.linalg.eigvals(loop.closed)
        damped = np.min(-r.real / np.abs(r), axis=-1) >= controller.specs[0].limit
        exact = assess(loop.take(damped), np.array([0.1]), 1.0, samples=201)
        meets = np.all([s.met(achieved(exact, s.quantity)) for s in controller.specs], axis=0)
        mine = dict(zip(GAIN_UNITS[controller.kind], ours, strict=True))
        bandwidth = assess(tab_loop(model, servo, tab_actuator, controller, mine), np.array([0.1]), 1.0).step.bandwidth
        assert meets.any()
        assert np.max(exact.step.bandwidth[meets]) <= 1.02 * bandwidth


def test_specs_out_of_reach_are_infeasible_with_reason_and_numbers(plant_a, tab_actuator):
    gains, outcomes = design_classical(
        plant_a.servo, tab_actuator, PF_TOO_MUCH, 1.0, Outcomes.all_ok(plant_a.grid.shape)
    )
    assert np.all(outcomes.codes == Outcome.INFEASIBLE)
    assert all(np.isnan(g.values).all() for g in gains)
    assert all("gain margin at least 6 dB" in reason and "nearest design" in reason for reason in outcomes.reasons.flat)


def test_the_best_reachable_value_is_that_of_brute_force(plant_a, tab_actuator):
    """Damping of positive feedback with 6 dB and 45 deg kept, over a fine grid of both gains judged exactly."""
    index = (0, 1)
    _, outcomes = design_classical(plant_a.servo.take(index), tab_actuator, PF_TOO_MUCH, 1.0, Outcomes.all_ok(()))
    reason = str(outcomes.reasons)
    assert reason.startswith("asked: damping ratio at least 0.5; with all other specs met the best reachable is")
    reached = float(reason.split("best reachable is damping ratio ")[1].split(";")[0])
    servo, model = plant_a.servo.take(index).take(None), plant_a.model.take(index).take(None)
    unit = NormalForm.of(servo, tab_actuator, "positive_feedback", None).gain_units[0]
    f, ki = np.meshgrid(np.linspace(0.0, 0.9, 120), np.geomspace(0.01, 1.0, 60), indexing="ij")
    values = {"K_f": f.ravel() * unit[0], "K_i": ki.ravel() * unit[1]}
    at = np.zeros(f.size, int)
    loop = tab_loop(model.take(at), servo.take(at), tab_actuator, PF_TOO_MUCH, values)
    exact = assess(loop.take(np.max(np.linalg.eigvals(loop.closed).real, axis=-1) < 0), np.array([0.1]), 1.0, 101)
    margins = [s.met(achieved(exact, s.quantity)) for s in PF_TOO_MUCH.specs[1:]]
    best = np.max(achieved(exact, "damping_ratio")[np.all(margins, axis=0)])
    assert reached == pytest.approx(best, rel=0.02)


def test_one_blocking_spec_is_named_with_its_best_value(plant_a, tab_actuator):
    """Settling in a time no gain reaches: that spec alone is in the way, and its best value is attainable."""
    specs = (*NF_SPECS[:3], Spec("settling_time", "max", 0.05))
    controller = ClassicalController("nf", "negative_feedback", specs, 2.0 * np.pi * 100.0)
    ok = Outcomes.all_ok(plant_a.grid.shape)
    _, outcomes = design_classical(plant_a.servo, tab_actuator, controller, 1.0, ok)
    reason = outcomes.reasons[0, 0]
    assert outcomes.codes[0, 0] == Outcome.INFEASIBLE
    assert "settling time at most 0.05 s" in reason
    reachable = float(reason.split("best reachable is settling time ")[1].split(" s")[0])
    assert 0.05 < reachable < 0.3
    relaxed = (*NF_SPECS[:3], Spec("settling_time", "max", 1.02 * reachable))
    _, outcomes = design_classical(
        plant_a.servo,
        tab_actuator,
        ClassicalController("nf", "negative_feedback", relaxed, 2.0 * np.pi * 100.0),
        1.0,
        ok,
    )
    assert outcomes.ok[0, 0]


def test_batched_equals_single(plant_a, tab_actuator, designs):
    gains, _ = designs["A", "nf"]
    one, outcomes = design_classical(plant_a.servo.take((1, 1)), tab_actuator, NF, 1.0, Outcomes.all_ok(()))
    assert outcomes.ok
    for whole, single in zip(gains, one, strict=True):
        assert single.values == pytest.approx(whole.values[1, 1], rel=1e-9)


def test_points_that_failed_before_stay_as_they_are(plant_a, tab_actuator):
    where = np.zeros(plant_a.grid.shape, bool)
    where[0, 1] = True
    before = Outcomes.all_ok(plant_a.grid.shape).failing(where, Outcome.EXCLUDED, lambda index: "by request")
    gains, outcomes = design_classical(plant_a.servo, tab_actuator, PF, 1.0, before)
    assert outcomes.codes[0, 1] == Outcome.EXCLUDED
    assert outcomes.reasons[0, 1] == "by request"
    assert np.isnan(gains[0].values[0, 1])
    assert np.isfinite(gains[0].values[0, 0])


def test_a_quantity_that_cannot_steer_is_refused(plant_a, tab_actuator):
    controller = ClassicalController("pf", "positive_feedback", (Spec("disk_margin", "min", 0.5),))
    with pytest.raises(ValueError, match="disk_margin"):
        design_classical(plant_a.servo, tab_actuator, controller, 1.0, Outcomes.all_ok(plant_a.grid.shape))


def test_a_design_slower_than_one_radian_a_second_is_a_design(plant_a, tab_actuator):
    """The ranks of the search must not depend on the unit of time: here the aileron's frequency is 0.3 rad/s."""
    from dataclasses import replace

    from model.flight import flight_condition
    from model.linearise import linearise
    from model.servo_tab import servo_tab
    from model.trim import TrimRequest, trim

    condition = flight_condition(0.0, "airspeed", np.array([0.2]))
    slow = linearise(plant_a.system, condition, trim(plant_a.system, condition, TrimRequest(alpha=0.0)))
    servo, actuator = servo_tab(slow), replace(tab_actuator, servo_bandwidth=2.5)
    assert servo.natural_frequency[0] < 0.4
    gains, outcomes = design_classical(servo, actuator, PF, 200.0, Outcomes.all_ok((1,)))
    assert outcomes.ok.all(), outcomes.reasons
    loop = tab_loop(slow, servo, actuator, PF, gain_values(gains))
    exact = assess(loop, np.array([0.1]), 200.0)
    assert exact.step.bandwidth[0] < 1.0
    assert PF.specs[0].met(achieved(exact, "damping_ratio")).all()


def test_a_spec_missed_ten_thousand_times_over_is_still_the_one_that_blocks(plant_a, tab_actuator):
    specs = (*NF_SPECS[:3], Spec("settling_time", "max", 1e-5))
    controller = ClassicalController("nf", "negative_feedback", specs, 2.0 * np.pi * 100.0)
    _, outcomes = design_classical(plant_a.servo.take((0, 0)), tab_actuator, controller, 1.0, Outcomes.all_ok(()))
    reason = str(outcomes.reasons)
    assert reason.startswith("asked: settling time at most 1e-05 s")
    assert 0.05 < float(reason.split("best reachable is settling time ")[1].split(" s")[0]) < 0.3


@pytest.mark.parametrize("cutoff_hz", [100.0, 300.0])
def test_a_resonance_between_the_samples_flatters_nobody(unsteady_a, tab_actuator, cutoff_hz):
    """A slow servo and no damping asked for: lightly damped modes ring on between the search's samples."""
    from dataclasses import replace

    specs = (Spec("gain_margin", "min", 4.0), Spec("settling_time", "max", 0.4), Spec("overshoot", "max", 0.02))
    controller = ClassicalController("nf", "negative_feedback", specs, 2.0 * np.pi * cutoff_hz)
    actuator = replace(tab_actuator, servo_bandwidth=2.0 * np.pi * 5.0)
    ok = Outcomes.all_ok(unsteady_a.grid.shape)
    gains, outcomes = design_classical(unsteady_a.servo, actuator, controller, 1.0, ok)
    assert outcomes.ok.all()
    _, exact = _exact(unsteady_a, actuator, controller, gain_values(gains))
    for spec in specs:
        assert np.all(spec.met(achieved(exact, spec.quantity))), spec
