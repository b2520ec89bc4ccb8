"""The four controllers on both wind-tunnel examples, against brute force on the exact figures of the flown loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design.assess import achieved, assess
from design.classical.controller import ClassicalController
from design.classical.steering import StepReference
from design.classical.synthesis import design_classical, design_margin_sweep, gain_values
from design.classical.tab_loop import tab_loop
from design.outcome import Outcome, Outcomes
from design.specs import Spec

STEP, HORIZON = np.deg2rad(10.0), 1.0
NF_SPECS = (
    Spec("damping_ratio", "min", 0.5),
    Spec("gain_margin", "min", 6.0),
    Spec("phase_margin", "min", np.pi / 4),
    Spec("settling_time", "max", 0.6),
    Spec("overshoot", "max", 0.2),
)
NF = ClassicalController("nf", "negative_feedback", NF_SPECS, 2.0 * np.pi * 100.0)
PF = ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),))
FOUR = (NF, PF, replace(NF, name="nf_rate", tab_command="rate"), replace(PF, name="pf_rate", tab_command="rate"))
TOO_MUCH = replace(PF, specs=NF_SPECS[:3])


def designed(plant, actuator, controller):
    reference = StepReference(STEP, HORIZON, plant.trim.state[..., 0])
    return design_classical(plant.servo, actuator, controller, reference, Outcomes.all_ok(plant.grid.shape))


def exact(plant, actuator, controller, gains):
    loop = tab_loop(plant.model, plant.servo, actuator, controller, gains)
    return loop, assess(loop, np.array([STEP]), HORIZON)


def tried(plant, actuator, controller, index, values):
    """Candidates (K, J) at one point, judged exactly: (K,) masks of those that meet all specs, and their bandwidth."""
    at = np.zeros(len(values), int)
    model, servo = (each.take(index).take(None).take(at) for each in (plant.model, plant.servo))
    gains = dict(zip(controller.gain_units, values.T, strict=True))
    loop = tab_loop(model, servo, actuator, controller, gains)
    r = np.linalg.eigvals(loop.closed)
    damping = [spec.limit for spec in controller.specs if spec.quantity == "damping_ratio"]
    keep = np.min(-r.real / np.abs(r), axis=-1) >= max(damping, default=1e-9)
    meets, bandwidth = np.zeros(len(values), bool), np.full(len(values), -np.inf)
    if keep.any():
        found = assess(loop.take(keep), np.array([STEP]), HORIZON, samples=201)
        meets[keep] = np.all([s.met(achieved(found, s.quantity)) for s in controller.specs], axis=0)
        bandwidth[keep] = found.step.bandwidth
    return meets, bandwidth


@pytest.fixture(scope="module")
def designs(plant_a, plant_b, tab_actuator):
    plants = {"A": plant_a, "B": plant_b}
    return {(name, c.name): designed(plant, tab_actuator, c) for name, plant in plants.items() for c in FOUR}


@pytest.mark.parametrize("controller", FOUR, ids=lambda c: c.name)
@pytest.mark.parametrize("name", ["A", "B"])
def test_every_point_meets_its_specs_exactly(request, designs, tab_actuator, name, controller):
    plant, found = request.getfixturevalue(f"plant_{name.lower()}"), designs[name, controller.name]
    assert found.outcomes.ok.all(), found.outcomes.reasons
    loop, judged = exact(plant, tab_actuator, controller, gain_values(found.gains))
    assert np.all(np.linalg.eigvals(loop.closed).real < 0.0)
    for spec in controller.specs:
        assert np.all(spec.met(achieved(judged, spec.quantity))), spec
    assert {g.name: g.unit for g in found.gains} == controller.gain_units


@pytest.mark.parametrize("controller", FOUR, ids=lambda c: c.name)
def test_brute_force_finds_nothing_faster(plant_a, tab_actuator, designs, controller):
    """Thousands of candidates a point, near and far, judged exactly: 2 % is the most that any gains by."""
    rng, found = np.random.default_rng(7), designs["A", controller.name]
    for index in [(0, 0), (1, 3)]:
        ours = np.array([g.values[index] for g in found.gains])
        nearby = ours * rng.uniform(0.7, 1.4, (3000, len(ours)))
        anywhere = ours * np.exp(rng.uniform(-2.5, 2.5, (4000, len(ours))))
        meets, bandwidth = tried(plant_a, tab_actuator, controller, index, np.concatenate([[ours], nearby, anywhere]))
        assert meets[0]
        assert meets[1:].any()
        assert np.max(bandwidth[meets]) <= 1.02 * bandwidth[0]


def test_positive_feedback_cannot_have_margins_and_damping(plant_a, plant_b, tab_actuator):
    """6 dB, 45 deg and 0.5: infeasible everywhere, and what can be reached is what brute force has."""
    for plant in (plant_a, plant_b):
        found = designed(plant, tab_actuator, TOO_MUCH)
        assert np.all(found.outcomes.codes == Outcome.INFEASIBLE)
        assert all(np.isnan(g.values).all() for g in found.gains)
        assert all("nearest design misses" in reason for reason in found.outcomes.reasons.flat)
    index = (0, 1)
    unit = 1.0 / np.abs(plant_b.servo.dc_gain[index])
    w = np.sqrt(plant_b.servo.static_stiffness[index])
    f, ki = np.meshgrid(np.linspace(0.0, 0.95, 120), np.geomspace(0.003, 1.0, 80), indexing="ij")
    values = np.stack([f.ravel() * unit, ki.ravel() * unit * w], axis=-1)
    assert not tried(plant_b, tab_actuator, TOO_MUCH, index, values)[0].any()
    for margin, others in (("gain_margin", TOO_MUCH.specs[:1]), ("damping_ratio", TOO_MUCH.specs[1:])):
        (wanted,) = [s for s in TOO_MUCH.specs if s.quantity == margin]
        why = designed(plant_b, tab_actuator, replace(TOO_MUCH, specs=(*others, wanted))).infeasibility[index]
        assert why.blocking is not None
        (reached,) = [r.limit for r in why.relaxations if r.spec.quantity == margin]
        at = np.zeros(len(values), int)
        model, servo = (each.take(index).take(None).take(at) for each in (plant_b.model, plant_b.servo))
        loop = tab_loop(model, servo, tab_actuator, TOO_MUCH, dict(zip(("K_f", "K_i"), values.T, strict=True)))
        stable = np.linalg.eigvals(loop.closed).real.max(axis=-1) < 0.0
        judged = assess(loop.take(stable), np.array([STEP]), HORIZON, 101)
        meets = np.all([s.met(achieved(judged, s.quantity)) for s in others], axis=0)
        best = np.max(achieved(judged, margin)[meets])
        assert reached == pytest.approx(best, rel=0.02, abs=0.3 if margin == "gain_margin" else 0.0)


@pytest.mark.parametrize(
    "spec",
    [
        Spec("bandwidth", "min", 30.0),
        Spec("delay_margin", "min", 0.012),
        Spec("disk_margin", "min", 0.9),
        Spec("sensitivity_peak", "max", 1.5),
        Spec("tab_rate", "max", np.deg2rad(250.0)),
        Spec("tab_deflection", "max", np.deg2rad(8.7)),
    ],
    ids=lambda s: s.quantity,
)
def test_each_further_quantity_steers(plant_a, tab_actuator, designs, spec):
    """Asked for more than the fastest design has, each is met, exactly, and costs bandwidth."""
    controller = replace(NF, specs=(*NF_SPECS, spec))
    found = designed(plant_a, tab_actuator, controller)
    ok = found.outcomes.ok
    assert ok.any(), found.outcomes.reasons
    gains = {name: values[ok] for name, values in gain_values(found.gains).items()}
    loop = tab_loop(plant_a.model.take(ok), plant_a.servo.take(ok), tab_actuator, controller, gains)
    judged = assess(loop, np.array([STEP]), HORIZON)
    for each in controller.specs:
        assert np.all(each.met(achieved(judged, each.quantity))), each
    _, free = exact(plant_a, tab_actuator, NF, gain_values(designs["A", "nf"].gains))
    assert np.all(judged.step.bandwidth <= free.step.bandwidth[ok] * 1.02)


def test_less_noise_than_the_fastest_design_has(plant_a, tab_actuator, designs):
    _, free = exact(plant_a, tab_actuator, NF, gain_values(designs["A", "nf"].gains))
    quieter = Spec("noise_gain", "max", 0.9 * free.noise_gain)
    found = designed(plant_a, tab_actuator, replace(NF, specs=(*NF_SPECS, quieter)))
    assert found.outcomes.ok.all(), found.outcomes.reasons
    _, judged = exact(plant_a, tab_actuator, NF, gain_values(found.gains))
    for each in (*NF_SPECS, quieter):
        assert np.all(each.met(achieved(judged, each.quantity))), each
    assert np.all(judged.step.bandwidth < free.step.bandwidth)


def test_limits_that_vary_over_the_grid(plant_a, tab_actuator, designs):
    """At every point the answer is that of its own limit."""
    limits = np.linspace(0.3, 0.6, 8).reshape(2, 4)
    varying = designed(plant_a, tab_actuator, replace(PF, specs=(Spec("damping_ratio", "min", limits),)))
    for index in [(0, 0), (1, 2)]:
        same = designed(plant_a, tab_actuator, replace(PF, specs=(Spec("damping_ratio", "min", float(limits[index])),)))
        for one, other in zip(varying.gains, same.gains, strict=True):
            assert one.values[index] == pytest.approx(other.values[index], rel=1e-9)


def test_gains_that_are_given(plant_a, tab_actuator, designs):
    """All: handed back, whatever they are. One: kept, the others the fastest with it."""
    shape = plant_a.grid.shape
    given = replace(NF, gains={"K_d": 0.01, "K_p": np.full(shape, 0.3), "K_i": 20.0})
    found = designed(plant_a, tab_actuator, given)
    assert found.outcomes.ok.all()
    assert [float(g.values[0, 0]) for g in found.gains] == [0.01, 0.3, 20.0]
    best = {g.name: g.values for g in designs["A", "nf"].gains}
    one = designed(plant_a, tab_actuator, replace(NF, gains={"K_p": 0.8 * best["K_p"]}))
    assert one.outcomes.ok.all()
    np.testing.assert_allclose(gain_values(one.gains)["K_p"], 0.8 * best["K_p"])
    _, judged = exact(plant_a, tab_actuator, NF, gain_values(one.gains))
    for spec in NF_SPECS:
        assert np.all(spec.met(achieved(judged, spec.quantity))), spec
    rng, index = np.random.default_rng(3), (0, 2)
    ours = np.array([g.values[index] for g in one.gains])
    others = ours * np.exp(rng.uniform(-1.0, 1.0, (4000, 3)))
    others[:, 1] = ours[1]
    meets, bandwidth = tried(plant_a, tab_actuator, NF, index, np.concatenate([[ours], others]))
    assert meets[0]
    assert np.max(bandwidth[meets]) <= 1.02 * bandwidth[0]


@pytest.mark.parametrize("controller", FOUR, ids=lambda c: c.name)
def test_transport_delays(plant_a, tab_actuator, controller):
    """The specs are met with the delay, but for what its approximant in the search leaves out."""
    late = replace(tab_actuator, delay=0.001)
    found = designed(plant_a, late, controller)
    assert found.outcomes.ok.all(), found.outcomes.reasons
    _, judged = exact(plant_a, late, controller, gain_values(found.gains))
    for spec in controller.specs:
        missed = -spec.distance(achieved(judged, spec.quantity)) / spec.scale
        assert np.all(missed < 2e-3), spec


def test_batched_equals_single(plant_a, tab_actuator, designs):
    for controller in FOUR:
        plant = plant_a
        reference = StepReference(STEP, HORIZON, plant.trim.state[1, 1, 0])
        one = design_classical(plant.servo.take((1, 1)), tab_actuator, controller, reference, Outcomes.all_ok(()))
        for whole, single in zip(designs["A", controller.name].gains, one.gains, strict=True):
            # The thorough search of a rate command ends on a plateau: rounding moves it along, a little.
            assert single.values == pytest.approx(whole.values[1, 1], rel=1e-5)


def test_the_design_margin_is_the_edge_of_the_feasible(plant_a, tab_actuator):
    """All specs tightened by a little less can be met, by a little more they cannot."""
    reference = StepReference(STEP, HORIZON, plant_a.trim.state[..., 0])
    ok = Outcomes.all_ok(plant_a.grid.shape)
    for controller in (PF, TOO_MUCH, replace(NF, specs=NF_SPECS[:3])):
        found = design_margin_sweep(plant_a.servo, tab_actuator, controller, reference, ok)
        assert np.all(np.isfinite(found.margin))
        assert set(found.binding.flat) <= {s.quantity for s in controller.specs}
        for shift, feasible in ((-0.01, True), (0.03, False)):
            specs = tuple(s.tightened(found.margin + shift) for s in controller.specs)
            assert np.all(designed(plant_a, tab_actuator, replace(controller, specs=specs)).outcomes.ok == feasible)


def test_what_cannot_be_searched_is_refused(plant_a, tab_actuator):
    ideal = replace(tab_actuator, servo_bandwidth=None, servo_damping_ratio=None)
    with pytest.raises(ValueError, match="no largest bandwidth"):
        designed(plant_a, ideal, PF)
    with pytest.raises(ValueError, match="K_theta"):
        designed(plant_a, replace(tab_actuator, rate_loop_bandwidth=None), replace(PF, tab_command="rate"))
    with pytest.raises(ValueError, match="aileron_torque cannot steer"):
        designed(plant_a, tab_actuator, replace(PF, specs=(Spec("aileron_torque", "max", 1.0),)))
    with pytest.raises(ValueError, match="no gain K_f"):
        designed(plant_a, tab_actuator, replace(NF, gains={"K_f": 1.0}))
