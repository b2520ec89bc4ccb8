"""Schedules by scaling laws: what they lose against the per-point design, and nothing where the plant scales."""

from dataclasses import replace

import numpy as np
import pytest

from design.assess import achieved
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.actuators import Actuator
from schedules.analysis import analyse
from schedules.judging import judged
from schedules.pole_scaling import pole_scaling
from schedules.scaling_laws import scaling_law
from schedules.study import GridRequest

PRESSURES = (245.0, 400.0, 980.0, 1531.25)


def _judge(study, plant, request, gains, outcomes=None):
    """A controller of given gains by name, judged."""
    loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, gains)
    named = tuple(Gain(name, request.gain_units[name], gains[name]) for name in request.gain_units)
    return judged(study, plant, request, outcomes or Outcomes.all_ok(plant.grid.shape), named, loop)


@pytest.fixture(scope="module", params=["negative_feedback", "positive_feedback"])
def similar(request, wind_tunnel_study):
    """One density, an ideal rate loop and a measured rate: the same loop at every point but for the unit of time."""
    kind = request.param
    study = replace(
        wind_tunnel_study,
        grid=GridRequest((2000.0,), "dynamic_pressure", PRESSURES),
        tab_actuator=Actuator(),
        aileron_actuator=Actuator(),
    )
    plant = analyse(study)
    servo = plant.servo_tab
    omega, steady = np.sqrt(servo.static_stiffness), np.abs(servo.dc_gain)
    gains = {"K_theta": 4.0 * omega, "K_i": 0.2 * omega / steady}
    gains |= (
        {"K_p": 0.5 / steady, "K_d": 0.6 / (steady * omega)} if kind == "negative_feedback" else {"K_f": 0.3 / steady}
    )
    specs = (Spec("damping_ratio", "min", 0.1), Spec("gain_margin", "min", 1.0), Spec("overshoot", "max", 2.0))
    asked = ClassicalController(kind, kind, specs, tab_command="rate", gains=gains)
    designed = _judge(study, plant, asked, gains)
    assert designed.outcomes.ok.all()
    return study, plant, designed


def test_a_plant_that_scales_loses_nothing(similar):
    found = scaling_law(*similar)
    for law in found.laws:
        assert law.law.exponent == pytest.approx(law.predicted, abs=1e-9)
        assert law.misfit < 1e-9
    for law, design in zip(found.gains, similar[2].gains, strict=True):
        np.testing.assert_allclose(law.values, design.values, rtol=1e-9)
    assert found.loss.stable.all()
    np.testing.assert_allclose(found.loss.bandwidth_ratio, 1.0, rtol=1e-7)
    for spec in found.loss.specs:
        known = np.isfinite(spec.by_design)
        np.testing.assert_allclose(spec.by_law[known], spec.by_design[known], atol=1e-6)


def test_its_poles_fall_on_each_other(similar):
    study, plant, designed = similar
    for controller in (designed, scaling_law(study, plant, designed).flown):
        found = pole_scaling(plant, controller)
        for scaled in (
            found.closed_by_frequency, found.closed_by_pressure, found.open_by_frequency, found.open_by_pressure
        ):  # fmt: skip
            assert np.max(scaled.collapse.spread) < 1e-7


@pytest.mark.parametrize("name", ["nf", "pf"])
def test_the_loss_is_that_of_the_loop_with_these_gains(wind_tunnel_study, wind_tunnel_envelope, name):
    """Each point judged alone, from the law's two numbers."""
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller(name)
    found = scaling_law(wind_tunnel_study, plant, designed)
    condition = plant.grid.condition
    assert found.loss.flown.all()
    for index in np.ndindex(plant.grid.shape):
        gains = {}
        for law in found.laws:
            rate = law.gain == "K_d"
            x = condition.air.density * condition.airspeed if rate else condition.dynamic_pressure
            gains[law.gain] = law.law.coefficient * (x[index] / law.law.reference) ** law.law.exponent
        loop = tab_loop(
            plant.model.take(index), plant.servo_tab.take(index), wind_tunnel_study.tab_actuator, designed.request,
            {k: np.asarray(v) for k, v in gains.items()},
        )  # fmt: skip
        assert found.loss.stable[index] == (np.linalg.eigvals(loop.closed).real.max() < 0.0)
        bandwidth = found.flown.assessment.step.bandwidth[index]
        assert abs(_gain(loop, bandwidth)) == pytest.approx(np.sqrt(0.5), rel=1e-6)
        ratio = bandwidth / designed.assessment.step.bandwidth[index]
        assert found.loss.bandwidth_ratio[index] == pytest.approx(ratio, rel=1e-12)
    assert found.loss.bandwidth_ratio.flat[found.loss.slowest] == found.loss.bandwidth_ratio.min()


def _gain(loop, omega):
    return loop.C[0] @ np.linalg.solve(1j * omega * np.eye(len(loop.A)) - loop.closed, loop.reference_input[:, 0])


def test_specs_that_fail_say_where_and_by_how_much(wind_tunnel_study, wind_tunnel_envelope):
    """The example's servo does not scale with the plant: two numbers a gain cannot hold every spec."""
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("nf")
    loss = scaling_law(wind_tunnel_study, plant, designed).loss
    assert [spec.spec for spec in loss.specs] == [verdict.spec for verdict in designed.verdicts]
    damping = loss.specs[0]
    assert damping.spec.quantity == "damping_ratio"
    assert np.all(damping.by_design >= 0.0)
    assert damping.failed.any()
    np.testing.assert_array_equal(damping.failed, damping.by_law < 0.0)
    assert damping.by_law.flat[damping.worst] == damping.by_law.min()
    flown = scaling_law(wind_tunnel_study, plant, designed).flown
    values = achieved(flown.assessment, "damping_ratio")
    np.testing.assert_allclose(damping.by_law, (values - 0.5) / 0.5, rtol=1e-12)
    met = [spec for spec in loss.specs if not spec.failed.any()]
    assert met
    assert all(spec.worst is None for spec in met)


def test_points_without_a_design_are_flown_and_an_unstable_one_says_so(wind_tunnel_study, wind_tunnel_envelope):
    """A law learnt at two dynamic pressures, of an integral gain that grows much too fast."""
    plant, whole = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("nf")
    q = plant.grid.condition.dynamic_pressure
    unknown = q > 600.0
    outcomes = whole.outcomes.failing(unknown, Outcome.INFEASIBLE, lambda index: "for the test")
    growth = np.where(q > 300.0, 2.2, 1.0)
    gains = {g.name: np.where(unknown, np.nan, g.values * (growth if g.name == "K_i" else 1.0)) for g in whole.gains}
    designed = _judge(wind_tunnel_study, plant, replace(whole.request, specs=()), gains, outcomes)
    assert designed.outcomes.ok[~unknown].all()
    found = scaling_law(wind_tunnel_study, plant, designed)
    assert found.loss.flown.all()
    assert found.loss.stable[~unknown].all()
    assert not found.loss.stable[:, -1].any()
    assert all(np.isfinite(g.values).all() for g in found.gains)
    assert "real part" in found.flown.outcomes.reasons[0, -1]
    assert np.isnan(found.loss.bandwidth_ratio[unknown]).all()
    assert np.isfinite(found.loss.bandwidth_ratio[~unknown]).all()
    for spec in found.loss.specs:
        assert spec.failed[:, -1].all()


def test_state_feedback_keeps_the_gains_that_have_no_law(wind_tunnel_study, wind_tunnel_envelope):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    found = scaling_law(wind_tunnel_study, plant, designed)
    without = {law.gain for law in found.laws if law.law is None}
    crossing = {g.name for g in designed.gains if g.values.min() < 0.0 < g.values.max()}
    assert without == crossing
    assert without
    for law, new, old in zip(found.laws, found.gains, designed.gains, strict=True):
        assert np.array_equal(new.values, old.values) == (law.law is None)
    K = {g.name: g.values for g in found.gains}
    for index in np.ndindex(plant.grid.shape):
        A, B = np.zeros((5, 5)), np.zeros((5, 2))
        A[:4, :4], A[4, 2], B[:4] = plant.model.A[index], -1.0, plant.model.B[index]
        rows = [[K[f"K_{u}_{x}"][index] for x in ("dt", "dt_rate", "da", "da_rate", "int_a")] for u in ("T_t", "T_a")]
        poles = np.linalg.eigvals(A - B @ np.array(rows))
        assert found.loss.stable[index]
        said = found.flown.assessment.poles[index]
        np.testing.assert_allclose(np.sort(said.real), np.sort(poles.real), rtol=1e-6, atol=1e-6)
    assert np.all(found.loss.bandwidth_ratio > 0.9)


def test_a_controller_without_a_design_has_no_law(wind_tunnel_study, wind_tunnel_envelope):
    plant, whole = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("nf")
    nothing = whole.outcomes.failing(whole.outcomes.ok, Outcome.INFEASIBLE, lambda index: "for the test")
    gains = {g.name: np.full(plant.grid.shape, np.nan) for g in whole.gains}
    designed = _judge(wind_tunnel_study, plant, whole.request, gains, nothing)
    found = scaling_law(wind_tunnel_study, plant, designed)
    assert {law.reason for law in found.laws} == {"no point carries a gain"}
    assert not found.loss.flown.any()
    assert found.loss.slowest is None
    assert found.flown.assessment is None
    poles = pole_scaling(plant, designed)
    assert np.isnan(poles.closed_by_frequency.poles).all()
    assert np.isnan(poles.closed_by_frequency.collapse.spread).all()
    assert np.isfinite(poles.open_by_frequency.poles).all()
