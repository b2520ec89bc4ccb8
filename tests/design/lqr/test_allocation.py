from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize, minimize_scalar

from design.lqr.allocation import TabRatio, tab_travel
from design.lqr.structures import Structure
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.tracking import holding_torques, steady_state
from design.outcome import Outcome
from model.actuators import Actuator, ActuatorLimits
from model.examples import wind_tunnel
from model.flight import flight_condition
from model.motion import required_torque
from model.trim import TrimRequest, trim
from tests.design.lqr_cases import EXAMPLES, WIND_TUNNEL_WEIGHTS, example

IDEAL = Actuator()
RULES = ("zero_aileron_torque", "least_torque", "least_power", TabRatio(-0.4))
LIMITED = Structure(
    tab=Actuator(limits=ActuatorLimits(torque=2.0, power=3.0)),
    aileron=Actuator(limits=ActuatorLimits(torque=10.0, power=60.0)),
)


def costs(holding, structure):
    """What each rule makes least, as functions of the tab's travel, from the torques themselves."""
    tab, aileron = structure.tab.limits, structure.aileron.limits
    both = [1.0 if None in pair else pair for pair in ((tab.torque, aileron.torque), (tab.power, aileron.power))]
    (t, a), (p_t, p_a) = [(1.0, 1.0) if pair == 1.0 else pair for pair in both]

    def torques(k):
        return holding @ np.array([k, 1.0])

    return {
        "zero_aileron_torque": lambda k: torques(k)[1] ** 2,
        "least_torque": lambda k: (torques(k)[0] / t) ** 2 + (torques(k)[1] / a) ** 2,
        "least_power": lambda k: (torques(k)[0] * k / p_t) ** 2 + (torques(k)[1] / p_a) ** 2,
    }


@pytest.mark.parametrize("structure", [Structure(), LIMITED], ids=["without limits", "with limits"])
@pytest.mark.parametrize("name", EXAMPLES)
def test_each_rule_is_the_optimum_that_scipy_finds(name, structure):
    model, _ = example(name)
    _, holding = holding_torques(model)
    for rule, cost in costs(holding[0, 1], structure).items():
        found = steady_state(model, rule, structure).N_x[0, 1, 0, 0]
        best = min(
            (minimize_scalar(cost, bracket=(k, k + 0.3), tol=1e-12) for k in np.linspace(-2.0, 1.0, 7)),
            key=lambda result: result.fun,
        )
        assert cost(found) <= best.fun * (1 + 1e-9) + 1e-20
        assert found == pytest.approx(best.x, rel=1e-5)


def test_least_torque_is_that_of_the_totals_too():
    """Seed 2.5: the tab angles of least total torque lie on a line of the same slope; through trim if trim is on it."""
    system = wind_tunnel()
    condition = flight_condition(0.0, "dynamic_pressure", 980.0)
    alpha = np.deg2rad(5.0)
    model, _ = example("wind_tunnel")
    slope = steady_state(model.take((0, 2)), "least_torque").N_x[0, 0]

    def least(aileron):
        def total(tab):
            state = np.array([tab[0], 0.0, aileron, 0.0])
            return np.sum(required_torque(system, condition, alpha, state, np.zeros(2)) ** 2)

        return minimize(total, [0.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15}).x[0]

    assert (least(0.1) - least(0.0)) / 0.1 == pytest.approx(slope, rel=2e-5)
    by_rule = trim(system, condition, TrimRequest(alpha, 0.0, "least_torque"))
    assert by_rule.state[..., 0] == pytest.approx(least(0.0), abs=1e-6)


def test_weights_are_parts_of_the_limits():
    """A tab of little torque is spared: with its limit lower and lower, its torque goes to zero."""
    model, _ = example("wind_tunnel_23012")
    torque = []
    for limit in (1.0, 0.1, 1e-3):
        tab = Actuator(limits=ActuatorLimits(torque=limit))
        torque.append(np.abs(steady_state(model, "least_torque", replace(LIMITED, tab=tab)).N_u[..., 0, 0]))
    assert np.all(torque[1] < torque[0])
    assert np.all(torque[2] < 1e-3 * torque[0])
    # One limit alone compares nothing: both torques count alike then.
    alone = Structure(tab=Actuator(limits=ActuatorLimits(torque=1e-3)))
    np.testing.assert_array_equal(
        steady_state(model, "least_torque", alone).N_x, steady_state(model, "least_torque").N_x
    )


def test_least_power_lies_between_the_torques_that_vanish():
    """It is no worse than the tab held still, the aileron floated by the tab, or a tab without torque."""
    model, _ = example("wind_tunnel_23012")
    _, holding = holding_torques(model)
    found = steady_state(model, "least_power").N_x[..., 0, 0]
    for index in np.ndindex(found.shape):
        H, cost = holding[index], costs(holding[index], Structure())["least_power"]
        others = (0.0, -H[0, 1] / H[0, 0], -H[1, 1] / H[1, 0])
        assert all(cost(found[index]) <= cost(k) for k in others)


floats = st.floats(-10.0, 10.0)


@given(floats, floats, floats, floats)
def test_least_power_of_any_stiffness(a, b, c, d):
    """Against a brute scan: torques of any sign and size, vanishing ones too."""
    holding = np.array([[a, b], [c, d]])
    k = tab_travel(holding, "least_power", IDEAL, IDEAL)
    cost = costs(holding, Structure())["least_power"]
    if not np.isfinite(k):
        # Nothing to choose by, or an optimum further away than any tab goes.
        assert max(a * a, b * b, c * c) <= 1e-30 * abs(c * d)
        return
    scan = np.concatenate([np.linspace(-30.0, 30.0, 301), np.geomspace(1e-4, 1e4, 101), -np.geomspace(1e-4, 1e4, 101)])
    assert cost(k) <= min(cost(x) for x in scan) * (1 + 1e-6) + 1e-12


def test_of_two_least_powers_the_smaller_angle_counts():
    """An aileron that the tab does not touch: a tab that stays, and one that floats, both have no power."""
    assert tab_travel(np.array([[1.0, 2.0], [0.0, 3.0]]), "least_power", IDEAL, IDEAL) == 0.0


@pytest.mark.parametrize("rule", RULES, ids=str)
def test_a_given_ratio_and_every_rule_rest_on_the_reference(rule):
    model, controller = example("wind_tunnel_23012")
    design = design_lqr(model, replace(controller, tab_allocation=rule))
    assert design.outcomes.ok.all()
    loop, rest = lqr_loop(model, design), steady_state(model, rule)
    state = np.linalg.solve(loop.closed, -loop.reference_input)
    output = (loop.closed_outputs @ state + loop.reference_feedthrough)[..., 0]
    np.testing.assert_allclose(output[..., 0], 1.0, rtol=1e-9)
    np.testing.assert_allclose(output[..., 1], rest.N_x[..., 0, 0], rtol=1e-9)
    torques = -np.einsum("...ij,...j->...i", model.stiffness, output[..., [1, 0]])
    np.testing.assert_allclose(output[..., 4:], torques, rtol=1e-8, atol=1e-8 * np.abs(torques).max())
    np.testing.assert_allclose(state[..., 4, 0], 0.0, atol=1e-9)
    if isinstance(rule, TabRatio):
        np.testing.assert_allclose(output[..., 1], -0.4, rtol=1e-9)


def test_a_point_without_an_optimum_is_infeasible_and_keeps_its_neighbours():
    """A tab that moves no torque at one point: nothing to choose its angle by, except the power of moving it at all."""
    model, _ = example("wind_tunnel")
    A, stiffness = model.A.copy(), model.stiffness.copy()
    stiffness[1, 0, :, 0] = 0.0
    A[..., 1::2, 0::2] = np.linalg.solve(model.inertia, stiffness)
    model = replace(model, A=A)
    for rule in RULES[:2]:
        design = design_lqr(model, LqrController("lqr", WIND_TUNNEL_WEIGHTS, rule))
        assert design.outcomes.ok.sum() == 7
        assert design.outcomes.codes[1, 0] == Outcome.INFEASIBLE
        assert f"tab_allocation {rule}" in design.outcomes.reasons[1, 0]
        assert np.isnan(steady_state(model, rule).N_x[1, 0]).all()
    for rule in RULES[2:]:
        assert design_lqr(model, LqrController("lqr", WIND_TUNNEL_WEIGHTS, rule)).outcomes.ok.all()
    assert steady_state(model, "least_power").N_x[1, 0, 0, 0] == 0.0


@pytest.mark.parametrize("rule", RULES, ids=str)
def test_grid_equals_points(rule):
    model, _ = example("airliner_aileron")
    whole = steady_state(model, rule, LIMITED)
    for index in [(0, 0), (2, 5)]:
        alone = steady_state(model.take(index), rule, LIMITED)
        np.testing.assert_allclose(whole.take(index).N_x, alone.N_x, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(whole.take(index).N_u, alone.N_u, rtol=1e-12, atol=1e-12)


def test_what_is_no_allocation():
    model, _ = example("wind_tunnel")
    with pytest.raises(ValueError, match="least_noise"):
        steady_state(model, "least_noise")
    for ratio in (np.nan, 2e3):
        with pytest.raises(ValueError, match="within"):
            TabRatio(ratio)
