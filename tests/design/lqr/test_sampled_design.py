"""Gains for a sample time, against python-control, scipy, and what is known in closed form."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

import design.lqr.sampled_design
from design.lqr.controller import LqrController
from design.lqr.cost import cost_of
from design.lqr.power_weights import PowerBalancedWeights, ReferenceStep
from design.lqr.sampled_design import design_lqr_sampled, sampled_gains, sampled_lqr_loop
from design.lqr.sampled_problem import sampled_problem
from design.lqr.synthesis import design_lqr
from design.lqr.tracking import augment_with_integral
from design.lqr.weights import ExplicitWeights, WeightsRefused, weight_matrices
from design.outcome import Outcome, Outcomes
from design.sampling import Sampling
from model.actuators import Actuator
from tests.design.lqr_cases import EXAMPLES, WIND_TUNNEL_WEIGHTS, example

NUMBERS = ("K", "N", "X", "residual", "spectral_radius")


def van_loan(A, B, Q, R, T):
    """Plant and cost of one sample, by the exponential that Van Loan published (1978)."""
    n, m = B.shape
    W, cost = np.zeros((n + m, n + m)), scipy.linalg.block_diag(Q, R)
    W[:n, :n], W[:n, n:] = A, B
    exponential = scipy.linalg.expm(np.block([[-W.T, cost], [np.zeros_like(W), W]]) * T)
    move = exponential[n + m :, n + m :]
    cost = move.T @ exponential[: n + m, n + m :]
    return move[:n, :n], move[:n, n:], 0.5 * (cost + cost.T)


def by_hand(model, weights, T, samples):
    """A, B, Q, R, N of one point for a whole delay of both commands, written out; held commands ordered by age."""
    A = np.zeros((5, 5))
    A[:4, :4], A[4, 2] = model.A, -1.0
    B = np.vstack([model.B, np.zeros((1, 2))])
    Ad, Bd, cost = van_loan(A, B, weights.Q, weights.R, T)
    discrete = ct.c2d(ct.ss(model.A, model.B, np.eye(4), 0), T)
    np.testing.assert_allclose(Ad[:4, :4], discrete.A, rtol=1e-10, atol=1e-12)
    Ad[4] = 0.0
    Ad[4, :4], Ad[4, 4], Bd[4] = -0.5 * T * (np.eye(4)[2] + discrete.A[2]), 1.0, -0.5 * T * discrete.B[2]
    Q, N, R = cost[:5, :5], cost[:5, 5:], cost[5:, 5:]
    if not samples:
        return Ad, Bd, Q, R, N
    n = 5 + 2 * samples
    F, G, P, S = np.zeros((n, n)), np.zeros((n, 2)), np.zeros((n, n)), np.zeros((n, 2))
    F[:5, :5], F[:5, n - 2 :] = Ad, Bd
    F[7:, 5 : n - 2], G[5:7] = np.eye(n - 7), np.eye(2)
    # The price of a torque by itself is charged with its command, all other costs when it has arrived.
    alone = T * weights.R
    P[:5, :5], P[:5, n - 2 :], P[n - 2 :, :5], P[n - 2 :, n - 2 :] = Q, N, N.T, R - alone
    return F, G, P, alone, S


@pytest.mark.parametrize("samples", [0, 1, 2])
@pytest.mark.parametrize("T", [1e-3, 5e-3, 2e-2])
def test_against_python_controls_dlqr(T, samples):
    model, controller = example("wind_tunnel")
    design = design_lqr_sampled(model, controller, Sampling(T, samples * T))
    assert design.outcomes.ok.all()
    assert design.states == ("dt", "dt_rate", "da", "da_rate", "int_a", *(
        f"{u}_{age + 1}" for u in ("T_t", "T_a") for age in range(samples)
    ))  # fmt: skip
    by_age = [*range(5), *(5 + i * samples + age for age in range(samples) for i in range(2))]
    for index in [(0, 0), (0, 3), (1, 2)]:
        K, X, poles = ct.dlqr(*by_hand(model.take(index), weight_matrices(controller.weights), T, samples))
        ours = design.K[index][:, by_age]
        np.testing.assert_allclose(ours, K, atol=1e-7 * np.abs(K).max())
        assert design.spectral_radius[index] == pytest.approx(np.abs(poles).max(), rel=1e-6)
        at = design.X[index][np.ix_(by_age, by_age)]
        np.testing.assert_allclose(at, X, atol=1e-6 * np.abs(X).max())
    assert design.residual.max() < 1e-12


def test_fast_sampling_gives_the_continuous_gains():
    """``K_T = K + T/2 K (A - B K) + O(T^2)``: the law that the held command needs to be right in the middle."""
    model, controller = example("wind_tunnel")
    continuous, plant = design_lqr(model, controller), augment_with_integral(model)
    K = continuous.K
    slope = 0.5 * K @ (plant.A - plant.B @ K)
    size = np.abs(slope).max(axis=-1, keepdims=True)
    errors = []
    for T in (2e-5, 1e-5):
        design = design_lqr_sampled(model, controller, Sampling(T, 0.0))
        assert design.states == plant.states
        errors.append(np.abs((design.K - K) / T - slope) / size)
        assert np.max(np.abs((design.N - continuous.N) / T)) < 2e4
    assert errors[1].max() < 0.01
    assert 1.8 < errors[0].max() / errors[1].max() < 2.2
    tiny = design_lqr_sampled(model, controller, Sampling(1e-8, 1e-8))
    assert tiny.outcomes.ok.all()
    np.testing.assert_allclose(tiny.K[..., :5], K, atol=1e-3 * np.abs(K).max())
    assert np.abs(tiny.K[..., 5:]).max() < 1e-4
    np.testing.assert_allclose(tiny.N, continuous.N, rtol=1e-3)


@pytest.mark.parametrize("samples", [1, 3])
def test_whole_delays_predict_the_state(samples):
    """With a delay the best law is the one without it, of the state when the command arrives: ``u = -K x(t + d)``."""
    T = 4e-3
    model, controller = example("wind_tunnel_23012")
    prompt = design_lqr_sampled(model, controller, Sampling(T, 0.0))
    late = design_lqr_sampled(model, controller, Sampling(T, samples * T))
    loop = sampled_lqr_loop(model, prompt)
    move = np.linalg.matrix_power(in_coded_integral(loop.F, T), samples)
    enter = loop.G.copy()
    enter[..., 4, :] -= 0.5 * T * enter[..., 2, :]  # from w to the integral that has seen the new error
    np.testing.assert_allclose(late.K[..., :5], prompt.K @ move, atol=1e-8 * np.abs(late.K).max())
    for age in range(1, samples + 1):
        reach = np.linalg.matrix_power(in_coded_integral(loop.F, T), age - 1) @ enter
        ours = late.K[..., [4 + age, 4 + samples + age]]
        np.testing.assert_allclose(ours, prompt.K @ reach, atol=1e-8 * np.abs(late.K).max())
    # What moves is the same, and is over with the delay besides.
    np.testing.assert_allclose(late.spectral_radius, prompt.spectral_radius, rtol=1e-9)


def in_coded_integral(F, T):
    """A loop over ``[x, w]`` in the states ``[x, int]``, ``int = w - T/2 da``."""
    change = np.eye(5)
    change[4, 2] = -0.5 * T
    return change @ F @ np.linalg.inv(change)


def test_the_solution_is_the_cost_of_the_flight():
    """``s'X s``: the continuous cost of the coded flight, the integral within a sample going on from the coded one."""
    T, index = 8e-3, (1, 1)
    model, controller = example("wind_tunnel")
    weights = weight_matrices(controller.weights)
    design, point = design_lqr_sampled(model, controller, Sampling(T, 0.0)).take(index), model.take(index)
    A = np.zeros((8, 8))
    A[:4, :4], A[:4, 5:7], A[4, 2] = point.A, point.B, -1.0  # x, int, u, cost is summed apart
    start = np.random.default_rng(5).normal(size=5)
    x, integral, total = start[:4], start[4], 0.0
    nodes, w = np.polynomial.legendre.leggauss(12)
    moves = [scipy.linalg.expm(A[:7, :7] * T * t) for t in 0.5 * (nodes + 1.0)]
    whole = scipy.linalg.expm(A[:7, :7] * T)
    for _ in range(400):
        u = -design.K @ np.append(x, integral)
        begin = np.concatenate([x, [integral], u])
        between = np.array([move @ begin for move in moves])
        costs = np.einsum("ti,ij,tj->t", between[:, :5], weights.Q, between[:, :5]) + u @ weights.R @ u
        total += 0.5 * T * (w @ costs)
        new = (whole @ begin)[:4]
        integral -= 0.5 * T * (x[2] + new[2])
        x = new
    assert total == pytest.approx(start @ design.X @ start, rel=1e-9)


@settings(max_examples=25, deadline=None)
@given(
    T=st.floats(2e-4, 2e-2),
    delay=st.floats(0.0, 2.5),
    seed=st.integers(0, 1000),
)
def test_return_difference_identity(T, delay, seed):
    """``(I + L)* (R + B'XB) (I + L) = [G; I]* [Q N; N' R] [G; I]`` on the unit circle: X, K and the problem agree."""
    index = (0, 1)
    model, controller = example("wind_tunnel")
    sampling = Sampling(T, delay * T)
    design = design_lqr_sampled(model.take(index), controller, sampling)
    plant = augment_with_integral(model.take(index))
    problem = sampled_problem(plant, cost_of(controller.weights, plant), sampling)
    assert problem.states == design.states
    z = np.exp(1j * np.random.default_rng(seed).uniform(0.1, np.pi, 4))
    for each in z:
        G = np.linalg.solve(each * np.eye(len(problem.A)) - problem.A, problem.B)
        inner = np.vstack([G, np.eye(2)])
        cost = np.block([[problem.Q, problem.N], [problem.N.T, problem.R]])
        L = np.eye(2) + design.K @ G
        left = L.conj().T @ (problem.R + problem.B.T @ design.X @ problem.B) @ L
        right = inner.conj().T @ cost @ inner
        np.testing.assert_allclose(left, right, atol=1e-6 * np.abs(right).max())


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("sampling", [Sampling(2e-3, 0.0), Sampling(2e-3, 2e-3), Sampling(3e-3, 4e-3)])
def test_rest_is_on_the_reference(name, sampling):
    """Feed-forward alone holds the steady state: the integral has nothing left to do, held commands included."""
    model, controller = example(name)
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, sampling))
    s = np.linalg.solve(np.eye(loop.F.shape[-1]) - loop.closed, loop.reference_input)[..., 0]
    assert np.abs(s[..., 2] - 1.0).max() < 1e-8
    assert np.abs(s[..., [1, 3]]).max() < 1e-7
    assert np.abs(s[..., -1]).max() < 1e-8
    assert np.abs(s[..., -1] * loop.K[..., 1, -1]).max() < 1e-6 * np.abs(loop.K[..., 1, 2]).max()


def test_the_integral_takes_out_what_the_model_has_wrong():
    T = 2e-3
    model, controller = example("wind_tunnel")
    design = design_lqr_sampled(model, controller, Sampling(T, T))
    A = model.A.copy()
    A[..., 3, :] *= 1.1
    wrong = sampled_lqr_loop(replace(model, A=A, B=0.95 * model.B), design)
    assert np.abs(np.linalg.eigvals(wrong.closed)).max() < 1.0
    s = np.linalg.solve(np.eye(wrong.F.shape[-1]) - wrong.closed, wrong.reference_input)[..., 0]
    assert np.abs(s[..., 2] - 1.0).max() < 1e-8
    assert np.abs(s[..., -1]).min() > 1e-6


def test_grid_equals_points_and_failures_stay_alone():
    model, controller = example("wind_tunnel")
    A = model.A.copy()
    A[0, 2] = np.nan
    model, sampling = replace(model, A=A), Sampling(3e-3, 4e-3)
    outcomes = Outcomes.all_ok((2, 4)).failing(np.eye(2, 4, dtype=bool), Outcome.EXCLUDED, lambda index: "mine")
    grid = design_lqr_sampled(model, controller, sampling, outcomes)
    assert grid.outcomes.ok.tolist() == [[False, True, False, True], [True, False, True, True]]
    for index in np.ndindex(2, 4):
        before = Outcomes(*(np.array(a[index], dtype=object) for a in (outcomes.codes, outcomes.reasons)))
        point = design_lqr_sampled(model.take(index), controller, sampling, before)
        assert point.outcomes.reasons[()] == grid.outcomes.reasons[index]
        for field in NUMBERS:
            np.testing.assert_allclose(getattr(grid.take(index), field), getattr(point, field), rtol=1e-10, atol=1e-12)
            assert np.isnan(getattr(grid.take(index), field)).all() == (not grid.outcomes.ok[index])
    loop = sampled_lqr_loop(model, grid)
    assert np.isnan(loop.closed[0, 0]).all()
    assert np.isfinite(loop.closed[0, 1]).all()


def test_names_and_units_of_gains():
    model, controller = example("wind_tunnel")
    lagged = Actuator(torque_loop_bandwidth=500.0)
    design = design_lqr_sampled(model, controller, Sampling(4e-3, 6e-3), None, lagged, Actuator(delay=2e-3))
    assert design.outcomes.ok.all()
    assert design.states[5:] == ("tab_torque", "T_t_1", "T_t_2", "T_a_1", "T_a_2")
    found = {gain.name: gain for gain in sampled_gains(design)}
    assert len(found) == 2 * len(design.states) + 2
    units = {
        "K_T_t_T_t_1": "1", "K_T_a_T_t_2": "1", "K_T_a_int_a": "N m/(rad s)", "K_T_t_da_rate": "N m s/rad",
        "K_T_t_dt": "N m/rad", "N_T_a_r_a": "N m/rad", "K_T_a_tab_torque": "1",
    }  # fmt: skip
    assert {name: found[name].unit for name in units} == units
    np.testing.assert_array_equal(found["K_T_a_T_t_2"].values, design.K[..., 1, 7])


@pytest.mark.parametrize(("reference", "states"), [("none", 4), ("aileron_and_tab", 6)])
def test_other_structures(reference, states):
    T = 3e-3
    model, controller = example("wind_tunnel")
    weights = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.02)
    controller = replace(controller, reference=reference, weights=weights)
    design = design_lqr_sampled(model, controller, Sampling(T, T))
    assert design.outcomes.ok.all()
    assert len(design.states) == states + 2
    loop = sampled_lqr_loop(model, design)
    if reference == "none":
        assert design.N.shape == (2, 4, 2, 0)
        return
    s = np.linalg.solve(np.eye(loop.F.shape[-1]) - loop.closed, loop.reference_input)
    np.testing.assert_allclose(s[..., [2, 0], :], np.broadcast_to(np.eye(2), (2, 4, 2, 2)), atol=1e-8)


def test_lag_states_of_the_air(unsteady_a):
    """They stand behind the integral, and before the commands under way; continuous in the end."""
    controller = LqrController("lqr", WIND_TUNNEL_WEIGHTS)
    design = design_lqr_sampled(unsteady_a.model, controller, Sampling(2e-3, 3e-3))
    assert design.outcomes.ok.all()
    assert design.states[4:] == ("int_a", "lag_1", "lag_2", "T_t_1", "T_t_2", "T_a_1", "T_a_2")
    loop = sampled_lqr_loop(unsteady_a.model, design)
    s = np.linalg.solve(np.eye(loop.F.shape[-1]) - loop.closed, loop.reference_input)[..., 0]
    assert np.abs(s[..., 2] - 1.0).max() < 1e-8
    assert np.abs(s[..., -1]).max() < 1e-8
    fast, continuous = (
        design_lqr_sampled(unsteady_a.model, controller, Sampling(1e-7, 0.0)).K,
        design_lqr(unsteady_a.model, controller).K,
    )
    np.testing.assert_allclose(fast, continuous, atol=1e-3 * np.abs(continuous).max())


def test_scaled_weights_are_those_of_the_continuous_design():
    model, controller = example("wind_tunnel")
    model = model.take((slice(0, 1), slice(0, 2)))
    wanted = PowerBalancedWeights(WIND_TUNNEL_WEIGHTS, None, 8.0, ReferenceStep(np.deg2rad(10.0), 1.0), False)
    controller, sampling = replace(controller, weights=wanted), Sampling(1e-5, 0.0)
    continuous = design_lqr(model, controller)
    assert continuous.outcomes.ok.all()
    design = design_lqr_sampled(model, controller, sampling)
    np.testing.assert_array_equal(design.retuning.aileron, continuous.retuning.aileron)
    np.testing.assert_allclose(design.K, continuous.K, atol=0.01 * np.abs(continuous.K).max())
    again = design_lqr_sampled(model, controller, sampling, retuning=continuous.retuning)
    np.testing.assert_array_equal(again.K, design.K)
    factors = continuous.retuning.aileron.copy()
    factors[0, 1] = np.nan
    partly = design_lqr_sampled(model, controller, sampling, retuning=replace(continuous.retuning, aileron=factors))
    assert partly.outcomes.ok.tolist() == [[True, False]]
    assert partly.outcomes.codes[0, 1] == Outcome.INFEASIBLE
    np.testing.assert_array_equal(partly.K[0, 0], design.K[0, 0])
    plain = design_lqr_sampled(model, example("wind_tunnel")[1], sampling, retuning=continuous.retuning)
    assert plain.retuning is None


def test_a_sample_time_that_hides_a_mode():
    """Both surfaces swing undamped at w: sampled every pi/w they stand still, and no held torque moves them."""
    model, controller = example("wind_tunnel")
    A = model.A.copy()
    A[0, 0] = [[0, 1, 0, 0], [-400.0, 0, 0, 0], [0, 0, 0, 1], [0, 0, -400.0, 0]]
    B = model.B.copy()
    B[0, 0] = [[0, 0], [5.0, 0], [0, 0], [0, 5.0]]
    model, controller = replace(model, A=A, B=B), replace(controller, reference="none")
    hidden = design_lqr_sampled(model, controller, Sampling(np.pi / 20.0, 0.0))
    # Rounding leaves a trace of control, so that it is the solution which fails, not the rank.
    assert hidden.outcomes.codes[0, 0] == Outcome.NOT_CERTIFIED
    assert "no certified solution of the discrete Riccati equation" in hidden.outcomes.reasons[0, 0]
    assert np.isnan(hidden.K[0, 0]).all()
    assert design_lqr_sampled(model, controller, Sampling(0.8 * np.pi / 20.0, 0.0)).outcomes.ok[0, 0]


def test_a_sample_too_long_for_the_numbers():
    model, controller = example("wind_tunnel")
    design = design_lqr_sampled(model, controller, Sampling(60.0, 0.0))
    assert not design.outcomes.ok.any()
    assert all("60 s leaves double precision" in reason for reason in design.outcomes.reasons.ravel())
    ill = design_lqr_sampled(model, controller, Sampling(0.3, 0.3))
    assert np.isnan(ill.K[~ill.outcomes.ok]).all()
    assert all(reason for reason in ill.outcomes.reasons[~ill.outcomes.ok])


def test_weights_that_see_no_integral_are_refused():
    model, _ = example("wind_tunnel")
    weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
    Q = weights.Q.copy()
    Q[4, 4] = 0.0
    blind = LqrController("blind", ExplicitWeights(Q, weights.R))
    with pytest.raises(WeightsRefused, match="z = 1") as refused:
        design_lqr_sampled(model, blind, Sampling(1e-3, 1e-3))
    assert refused.value.matrix == "Q"
    assert refused.value.eigenvalue == pytest.approx(0.0, abs=1e-6)


def test_a_gain_that_does_not_stabilise_is_withdrawn(monkeypatch):
    """Were a solution wrong, the closed loop would tell."""
    model, controller = example("wind_tunnel")
    solve = design.lqr.sampled_design.solve_discrete_riccati

    def wrong(*arguments):
        solution = solve(*arguments)
        K = solution.K.copy()
        K[3] *= -1.0
        return replace(solution, K=K)

    monkeypatch.setattr(design.lqr.sampled_design, "solve_discrete_riccati", wrong)
    found = design_lqr_sampled(model, controller, Sampling(2e-3, 2e-3))
    assert np.flatnonzero(~found.outcomes.ok).tolist() == [3]
    assert found.outcomes.codes[0, 3] == Outcome.NOT_CERTIFIED
    assert "modulus" in found.outcomes.reasons[0, 3]
    assert np.isnan(found.K[0, 3]).all()


@pytest.mark.parametrize(
    ("sampling", "what"),
    [
        (Sampling(0.0, 0.0), "sample time"),
        (Sampling(np.nan, 0.0), "sample time"),
        (Sampling(1e-3, -1e-3), "not negative"),
        (Sampling(1e-3, np.inf), "finite"),
    ],
)
def test_times_out_of_range(sampling, what):
    model, controller = example("wind_tunnel")
    with pytest.raises(ValueError, match=what):
        design_lqr_sampled(model, controller, sampling)


def test_certificates_are_of_the_loop_that_is_coded():
    model, controller = example("wind_tunnel")
    found = design_lqr_sampled(model, controller, Sampling(5e-3, 3e-3))
    poles = np.linalg.eigvals(sampled_lqr_loop(model, found).closed)
    np.testing.assert_allclose(found.spectral_radius, np.abs(poles).max(axis=-1), rtol=1e-12)
    assert found.residual.max() < 1e-12
    np.testing.assert_allclose(found.X, found.X.mT)
    assert np.linalg.eigvalsh(found.X).min() > -1e-9 * np.abs(found.X).max()
