"""Peak powers balanced by the weights: figures against python-control, before and after, and failures."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest

from design.delay.step_response import delayed_step_response
from design.lqr.cost import cost_of
from design.lqr.output_weights import OutputWeights
from design.lqr.power_comparison import power_comparison
from design.lqr.power_figures import power_figures
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, ReferenceStep
from design.lqr.retuning import scaled_cost
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.tracking import augment_with_integral
from design.lqr.weights import ExplicitWeights, weight_matrices
from design.outcome import Outcome, Outcomes
from model.actuators import Actuator
from tests.design.lqr_cases import EXAMPLES, WIND_TUNNEL_WEIGHTS, example

STEP = ReferenceStep(np.deg2rad(10.0), 1.0)


def balanced(tab, aileron, keep_settling=True, base=WIND_TUNNEL_WEIGHTS, step=STEP):
    return PowerBalancedWeights(base, tab, aileron, step, keep_settling)


def sampled(loop, step, samples=40001):
    """Peaks, settling and overshoot of one point by ct.forced_response, from dense samples alone."""
    system = ct.ss(loop.closed, loop.reference_input, loop.closed_outputs, loop.reference_feedthrough)
    time = np.linspace(0.0, step.duration, samples)
    r = np.tile(np.array([step.aileron, step.tab])[: len(loop.references), None], samples)
    y = dict(zip(loop.outputs, ct.forced_response(system, time, r).outputs + loop.offset[:, None], strict=True))
    p_t, p_a = y["T_t"] * y["dt_rate"], y["T_a"] * y["da_rate"]
    moved = (y["da"] - loop.offset[0]) / step.aileron
    settled = time[np.flatnonzero(np.abs(moved - 1.0) > 0.02)[-1] + 1]
    peaks = [np.max(np.abs(p)) for p in (p_t, p_a)]
    return [*peaks, np.max(np.abs(p_t) + np.abs(p_a)), np.max(np.abs(p_t + p_a)), settled, moved.max() - 1.0]


@pytest.mark.parametrize("reference", ["aileron", "aileron_and_tab"])
def test_figures_by_python_control(reference):
    model, _ = example("wind_tunnel")
    step = replace(STEP, tab=np.deg2rad(-6.0))
    weights = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.02)
    lagged = Actuator(torque_loop_bandwidth=200.0), Actuator(torque_loop_bandwidth=300.0)
    loop = lqr_loop(model, design_lqr(model, LqrController("n", weights, reference=reference), None, *lagged))
    found = power_figures(loop, step)
    fields = ("tab", "aileron", "total", "net", "settling_time", "overshoot")
    for index in [(0, 0), (1, 3)]:
        expected = sampled(loop.take(index), step)
        ours = [getattr(found, name)[index] for name in fields]
        np.testing.assert_allclose(ours, expected, rtol=2e-4)
        assert all(mine >= theirs * (1 - 1e-12) for mine, theirs in zip(ours[:4], expected[:4], strict=True))


def test_figures_of_points_without_a_loop_or_without_rest_are_nan():
    model, controller = example("wind_tunnel")
    design = design_lqr(model, controller)
    K = design.K.copy()
    K[0, 1], K[1, 2] = np.nan, 0.0
    found = power_figures(lqr_loop(model, replace(design, K=K)), STEP)
    whole = power_figures(lqr_loop(model, design), STEP)
    good = np.ones((2, 4), dtype=bool)
    good[0, 1] = good[1, 2] = False
    for name in ("tab", "total", "settling_time", "overshoot"):
        assert np.isnan(getattr(found, name)[~good]).all()
        np.testing.assert_array_equal(getattr(found, name)[good], getattr(whole, name)[good])


def test_power_weighting_lowers_the_peak_power_at_equal_settling_time():
    """Seed Fig 5.3, ten degrees: both totals and both actuators, at every point; python-control says the same."""
    model, controller = example("wind_tunnel")
    asked = replace(controller, weights=balanced(1.0, 20.0))
    found = power_comparison(model, asked)
    before, after = found.before.figures, found.after.figures
    assert found.outcomes.ok.all()
    np.testing.assert_allclose(after.settling_time, before.settling_time, rtol=1e-5)
    np.testing.assert_allclose(after.tab, 1.0, rtol=1e-5)
    np.testing.assert_allclose(after.aileron, 20.0, rtol=1e-5)
    for name in ("tab", "aileron", "total", "net"):
        assert np.all(getattr(after, name) < 0.8 * getattr(before, name))
    assert np.all(found.total_ratio < 0.8)
    # What it costs is overshoot: reported, and no more than a twentieth of the step.
    assert np.all(after.overshoot > before.overshoot)
    assert np.all(after.overshoot < before.overshoot + 0.05)
    loop = lqr_loop(model, design_lqr(model, asked))
    plain = lqr_loop(model, design_lqr(model, controller))
    for index in np.ndindex(2, 4):
        old, new = (sampled(each.take(index), STEP, 10001) for each in (plain, loop))
        assert new[2] < 0.8 * old[2]
        assert new[3] < 0.8 * old[3]
        assert new[4] == pytest.approx(old[4], rel=1e-3)
        ours = [getattr(after, name)[index] for name in ("tab", "aileron", "total", "net", "settling_time")]
        np.testing.assert_allclose(ours, new[:5], rtol=1e-3)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_share_of_one_actuator_lowers_the_total_of_both(name):
    """The aileron's peak at four fifths of its smallest over the grid, the tab's weights along with the aileron's."""
    model, controller = example(name)
    step = replace(STEP, duration=3.0 if name == "airliner_aileron" else 1.0)
    plain = power_figures(lqr_loop(model, design_lqr(model, controller)), step)
    weights = balanced(None, 0.8 * plain.aileron.min(), base=controller.weights, step=step)
    found = power_comparison(model, replace(controller, weights=weights))
    assert found.outcomes.ok.all()
    assert np.all(found.total_ratio < 0.85)
    np.testing.assert_allclose(found.after.figures.settling_time, plain.settling_time, rtol=0.05)


def test_responses_before_and_after():
    model, controller = example("wind_tunnel")
    found = power_comparison(model, replace(controller, weights=balanced(1.0, 20.0)), samples=2001)
    for each in (found.before, found.after):
        assert each.time.shape == each.aileron_power.shape == (2, 4, 2001)
        np.testing.assert_allclose(each.aileron[..., -1], np.deg2rad(10.0), atol=1e-6)
        sampled_peak = np.max(np.abs(each.aileron_power), axis=-1)
        assert np.all(sampled_peak <= each.figures.aileron * (1 + 1e-9))
        np.testing.assert_allclose(sampled_peak, each.figures.aileron, rtol=5e-3)
        rate = np.gradient(each.tab, each.time[0, 0], axis=-1)
        difference = np.abs(rate * each.tab_torque - each.tab_power)[..., 3:-3]
        assert np.all(difference.max(axis=-1) < 0.05 * each.figures.tab)


def test_factors_are_on_torque_and_rate_and_on_the_integrals():
    """What was found, put into explicit weights by hand, designs the same gains."""
    model, controller = example("wind_tunnel")
    design = design_lqr(model, replace(controller, weights=balanced(1.0, 20.0)))
    tuned = design.retuning
    for factor in (tuned.tab, tuned.aileron, tuned.integrals):
        assert np.all(factor > 1.0)
    base = weight_matrices(WIND_TUNNEL_WEIGHTS)
    for index in [(0, 1), (1, 3)]:
        rho_t, rho_a, sigma = (factor[index] for factor in (tuned.tab, tuned.aileron, tuned.integrals))
        by_hand = ExplicitWeights(base.Q * np.diag([1.0, rho_t, 1.0, rho_a, sigma]), base.R * np.diag([rho_t, rho_a]))
        alone = design_lqr(model.take(index), replace(controller, weights=by_hand))
        np.testing.assert_allclose(alone.K, design.K[index], rtol=1e-9)
    assert np.all(design.return_difference_min >= 1.0 - 1e-6)


def test_a_cost_that_is_multiplied_as_a_whole_is_the_same_design():
    """Why the speed is restored by the integrals: with the angles' weights along, the balance would be undone."""
    model, controller = example("wind_tunnel")
    base = weight_matrices(WIND_TUNNEL_WEIGHTS)
    times_nine = ExplicitWeights(9.0 * base.Q, 9.0 * base.R)
    np.testing.assert_allclose(
        design_lqr(model, replace(controller, weights=times_nine)).K, design_lqr(model, controller).K, rtol=1e-9
    )


def test_scaling_keeps_a_cost_with_a_cross_term_semidefinite():
    model, _ = example("wind_tunnel")
    plant = augment_with_integral(model)
    cost = cost_of(NetWorkWeights(WIND_TUNNEL_WEIGHTS, 1.0, 1.0, 1.0), plant)
    scaled = scaled_cost(cost, plant, np.array([3.0, 0.2, 7.0]))
    joint = np.block([[scaled.Q, scaled.N], [scaled.N.T, scaled.R]])
    unit = 1.0 / np.sqrt(np.diag(joint))
    assert np.linalg.eigvalsh(joint * np.outer(unit, unit))[0] > -1e-12
    assert scaled.N[3, 1] == pytest.approx(0.2 * cost.N[3, 1])


def test_free_settling_meets_the_powers_and_takes_the_time_it_takes():
    model, controller = example("wind_tunnel")
    design = design_lqr(model, replace(controller, weights=balanced(1.0, 20.0, keep_settling=False)))
    assert design.outcomes.ok.all()
    np.testing.assert_array_equal(design.retuning.integrals, 1.0)
    after = power_figures(lqr_loop(model, design), STEP)
    np.testing.assert_allclose(after.tab, 1.0, rtol=1e-5)
    np.testing.assert_allclose(after.aileron, 20.0, rtol=1e-5)
    assert np.all(after.settling_time > design.retuning.before.settling_time)


def test_more_power_than_before_makes_it_faster():
    """A share is a share: with settling free, weights fall where there is power to spare."""
    model, controller = example("wind_tunnel")
    design = design_lqr(model, replace(controller, weights=balanced(3.0, 60.0, keep_settling=False)))
    assert design.outcomes.ok.all()
    assert np.all(design.retuning.aileron < 1.0)
    assert np.all(design.retuning.after.settling_time < design.retuning.before.settling_time)


def test_powers_that_cannot_be_had_are_infeasible_where_they_cannot():
    """Trim torque times the rate that the step takes is a floor, higher in faster air; neighbours keep their design."""
    model, controller = example("wind_tunnel")
    design = design_lqr(model, replace(controller, weights=balanced(None, 9.0)))
    assert design.outcomes.ok[:, 0].all()
    assert not design.outcomes.ok[:, 3].any()
    for index in map(tuple, np.argwhere(~design.outcomes.ok)):
        assert design.outcomes.codes[index] == Outcome.INFEASIBLE
        assert "9 W at the aileron, settling within 0.159" in design.outcomes.reasons[index]
        assert "the nearest have" in design.outcomes.reasons[index]
        for values in (design.K, design.retuning.aileron, design.retuning.after.total, design.residual):
            assert np.isnan(values[index]).all()
    short = balanced(1.0, 20.0, step=replace(STEP, duration=0.1))
    late = design_lqr(model, replace(controller, weights=short))
    assert not late.outcomes.ok.any()
    assert "does not settle within 0.1 s" in late.outcomes.reasons[0, 0]


def test_grid_equals_points_and_failures_stay_where_they_are():
    model, controller = example("wind_tunnel")
    asked = replace(controller, weights=balanced(1.0, 18.0))
    whole = design_lqr(model, asked)
    A = model.A.copy()
    A[0, 1] = np.nan
    where = np.zeros((2, 4), dtype=bool)
    where[1, 0] = True
    outcomes = Outcomes.all_ok((2, 4)).failing(where, Outcome.EXCLUDED, lambda index: "mine")
    damaged = design_lqr(replace(model, A=A), asked, outcomes)
    assert damaged.outcomes.ok.sum() == 6
    assert damaged.outcomes.reasons[1, 0] == "mine"
    assert np.isnan(damaged.retuning.tab[0, 1])
    assert np.isnan(damaged.retuning.before.total[1, 0])
    for index in [(0, 0), (1, 3)]:
        alone = design_lqr(model.take(index), asked)
        for field in ("tab", "aileron", "integrals"):
            found = getattr(whole.retuning, field)[index]
            assert getattr(alone.retuning, field) == pytest.approx(found, rel=1e-10)
            assert getattr(damaged.retuning, field)[index] == pytest.approx(found, rel=1e-10)
        np.testing.assert_allclose(alone.K, whole.K[index], rtol=1e-9)
    nothing = design_lqr(model, asked, Outcomes.all_ok((2, 4)).failing(~np.zeros((2, 4), bool), Outcome.EXCLUDED, str))
    assert not nothing.outcomes.ok.any()


def test_a_delay_is_in_the_figures_that_are_balanced():
    model, controller = example("wind_tunnel")
    late = Actuator(delay=0.001)
    asked = replace(controller, weights=balanced(1.5, 22.0))
    design = design_lqr(model, asked, None, late, late)
    assert design.outcomes.ok.all()
    loop = lqr_loop(model, design)
    assert loop.delay == (0.001, 0.001)
    found = power_figures(loop, STEP)
    np.testing.assert_allclose(found.aileron, 22.0, rtol=1e-5)
    assert np.all(np.abs(design.K / design_lqr(model, asked).K - 1.0).max(axis=(-2, -1)) > 1e-3)


def test_a_design_that_fails_before_anything_is_balanced_says_why():
    """Weights beyond the arithmetic: not the balance is at fault, and it is not what is said."""
    model, controller = example("wind_tunnel")
    base = replace(WIND_TUNNEL_WEIGHTS, aileron_integral=1e14)
    design = design_lqr(model, replace(controller, weights=balanced(1.0, 20.0, base=base)))
    assert (design.outcomes.codes == Outcome.NOT_CERTIFIED).all()
    assert "relative residual" in design.outcomes.reasons[0, 0]


def test_unsteady_air_lags_delays_and_weights_of_outputs_together(unsteady_a):
    """Everything at once: the figures that were asked for are those of the loop that is flown, exact delay included."""
    outputs = ("dt", "dt_rate", "da_error", "da_rate", "int_a", "da_acceleration")
    base = OutputWeights(outputs, np.diag([30.0, 0.02, 800.0, 0.08, 3e5, 1e-8]), np.diag([4.0, 0.25]))
    actuators = Actuator(torque_loop_bandwidth=500.0, delay=0.001), Actuator(torque_loop_bandwidth=400.0, delay=0.001)
    asked = LqrController("n", balanced(1.5, 20.0, base=base), "least_torque", delay_states=3)
    design = design_lqr(unsteady_a.model, asked, None, *actuators)
    assert design.outcomes.ok.all()
    assert design.K.shape == (2, 4, 2, 15)
    loop = lqr_loop(unsteady_a.model, design)
    plain = design_lqr(unsteady_a.model, replace(asked, weights=base), None, *actuators)
    before = power_figures(lqr_loop(unsteady_a.model, plain), STEP)
    response = delayed_step_response(loop, np.array([STEP.aileron]), STEP.duration, 20001)
    signal = {name: response.outputs[..., response.index(name)] for name in loop.outputs}
    np.testing.assert_allclose(np.abs(signal["T_a"] * signal["da_rate"]).max(axis=-1), 20.0, rtol=1e-3)
    np.testing.assert_allclose(np.abs(signal["T_t"] * signal["dt_rate"]).max(axis=-1), 1.5, rtol=1e-3)
    np.testing.assert_allclose(design.retuning.after.settling_time, before.settling_time, rtol=1e-5)
    assert np.all(design.retuning.after.total < before.total)
