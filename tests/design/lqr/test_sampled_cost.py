from itertools import pairwise

import control as ct
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr.discrete_riccati import solve_discrete_riccati
from design.lqr.riccati import solve_riccati
from design.lqr.sampled_cost import sampled_regulator, with_input_delay
from design.lqr.weights import weight_matrices
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, tunnel_plant

FIELDS = ("A", "B", "Q", "R", "N", "command_weight")


def random_problem(seed, n=4, m=2, cross=True):
    random = np.random.default_rng(seed)
    A, B = random.normal(size=(n, n)), random.normal(size=(n, m))
    C, D = random.normal(size=(n + m, n)), random.normal(size=(n + m, m))
    return A, B, C.T @ C, D.T @ D, C.T @ D if cross else None


def tunnel():
    A, B = tunnel_plant()
    weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
    return A, B, weights.Q, weights.R


def van_loan(A, B, Q, R, N, sample_time):
    """Van Loan's block exponential, as published: for modes that do not decay much within a sample."""
    n, k = len(A), len(A) + B.shape[1]
    W, cost = np.zeros((k, k)), np.block([[Q, N], [N.T, R]])
    W[:n, :n], W[:n, n:] = A, B
    exponential = scipy.linalg.expm(np.block([[-W.T, cost], [np.zeros((k, k)), W]]) * sample_time)
    move = exponential[k:, k:]
    return move[:n, :n], move[:n, n:], move.T @ exponential[:k, k:]


@pytest.mark.parametrize("sample_time", [1e-3, 0.1, 1.0])
def test_against_van_loans_exponential(sample_time):
    for seed in range(5):
        A, B, Q, R, N = random_problem(seed)
        s = sampled_regulator(A, B, Q, R, N, sample_time)
        A_exact, B_exact, cost = van_loan(A, B, Q, R, N, sample_time)
        np.testing.assert_allclose(s.A, A_exact, atol=1e-12 * np.abs(A_exact).max())
        np.testing.assert_allclose(s.B, B_exact, atol=1e-12 * np.abs(B_exact).max())
        ours = np.block([[s.Q, s.N], [s.N.T, s.R]])
        np.testing.assert_allclose(ours, cost, rtol=0, atol=1e-11 * np.abs(cost).max())


def test_the_product_plant_against_van_loan_and_scipy():
    A, B, Q, R = tunnel()
    for sample_time in (1e-3, 1e-2):
        s = sampled_regulator(A, B, Q, R, None, sample_time)
        A_exact, B_exact, cost = van_loan(A, B, Q, R, np.zeros((5, 2)), sample_time)
        np.testing.assert_allclose(s.A, A_exact, rtol=1e-10, atol=1e-13 * np.abs(A_exact).max())
        np.testing.assert_allclose(s.B, B_exact, rtol=1e-10)
        for part, exact in ((s.Q, cost[:5, :5]), (s.N, cost[:5, 5:]), (s.R, cost[5:, 5:])):
            np.testing.assert_allclose(part, exact, atol=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize("speed", [1e-12, 1e-3, 1.0, 30.0, 1e3, 1e6])
def test_a_mode_that_decays_many_times_within_a_sample(speed):
    """``x' = -a x + b u``: e = exp(-a T); Van Loan's exponential holds exp(+a T) and overflows at a T = 710."""
    a, b, q, r, sample_time = speed, 3.0, 2.0, 5.0, 1.0
    s = sampled_regulator(*(np.array([[v]]) for v in (-a, b, q, r)), None, sample_time)
    first, second = -np.expm1(-a) / a, -np.expm1(-2 * a) / (2 * a)
    assert s.A[0, 0] == pytest.approx(np.exp(-a), rel=1e-10, abs=1e-300)
    assert s.B[0, 0] == pytest.approx(b * first, rel=1e-10)
    assert s.Q[0, 0] == pytest.approx(q * second, rel=1e-10)
    if a > 0.1:
        # x = e x + b/a (1 - e) u
        assert s.N[0, 0] == pytest.approx(q * b / a * (first - second), rel=1e-10)
        assert s.R[0, 0] == pytest.approx(r + q * (b / a) ** 2 * (1 - 2 * first + second), rel=1e-9)


def test_units_do_not_change_a_single_bit():
    """States and inputs in units powers of two apart: every entry of the answer scales exactly."""
    A, B, Q, R, _ = random_problem(3)
    random = np.random.default_rng(4)
    x, u = 2.0 ** random.integers(-30, 30, 4), 2.0 ** random.integers(-30, 30, 2)
    plain = sampled_regulator(A, B, Q, R, None, 0.5)
    scaled = sampled_regulator(
        A * x[:, None] / x, B * x[:, None] / u, Q / x / x[:, None], R / u / u[:, None], None, 0.5
    )
    np.testing.assert_array_equal(scaled.A, plain.A * x[:, None] / x)
    np.testing.assert_array_equal(scaled.B, plain.B * x[:, None] / u)
    np.testing.assert_array_equal(scaled.Q, plain.Q / x / x[:, None])
    np.testing.assert_array_equal(scaled.N, plain.N / x[:, None] / u)
    np.testing.assert_allclose(scaled.R, plain.R / u / u[:, None], rtol=1e-14)


def simulated_cost(A, B, Q, R, N, sample_time, delay, commands, x0):
    """Cost of a trajectory by quadrature: the state carried along, the input piece by piece as it arrives."""
    n, m = B.shape
    steps = len(commands)
    sampled = np.arange(steps + 1) * sample_time
    breaks = np.unique(np.round(np.concatenate([sampled, *(sampled + d for d in delay)]), 12))
    breaks = breaks[breaks <= sampled[-1] + 1e-9]

    def rate(t, y, u):
        x = y[:n]
        stage = x @ Q @ x + u @ R @ u + 2 * x @ N @ u
        return np.append(A @ x + B @ u, stage)

    y = np.append(x0, 0.0)
    for start, end in pairwise(breaks):
        u = np.zeros(m)
        for i in range(m):
            k = int(np.floor((0.5 * (start + end) - delay[i]) / sample_time))
            if 0 <= k < steps:
                u[i] = commands[k, i]
        run = scipy.integrate.solve_ivp(rate, (start, end), y, args=(u,), rtol=1e-12, atol=1e-14, method="DOP853")
        y = run.y[:, -1]
    return y[:n], y[n]


DELAYS = [(0.0, 0.0), (0.2, 0.2), (0.0, 0.6), (0.4, 0.2), (0.07, 0.0), (0.13, 0.29), (0.05, 0.05), (0.2, 0.33)]


@pytest.mark.parametrize("cross", [False, True])
@pytest.mark.parametrize("delay", DELAYS)
def test_the_sum_is_the_cost_of_the_continuous_trajectory(delay, cross):
    """Any commands, every delay; the last ones zero, so that none is under way at the end."""
    sample_time, steps = 0.2, 9
    A, B, Q, R, N = random_problem(7, cross=cross)
    s = sampled_regulator(A, B, Q, R, N, sample_time, delay)
    random = np.random.default_rng(8)
    commands = random.normal(size=(steps, 2))
    commands[-4:] = 0.0
    x0 = random.normal(size=4)
    z = np.zeros(s.A.shape[-1])
    z[:4] = x0
    total = 0.0
    for u in commands:
        total += z @ s.Q @ z + u @ s.R @ u + 2 * z @ s.N @ u
        z = s.A @ z + s.B @ u
    x, cost = simulated_cost(A, B, Q, R, np.zeros_like(B) if N is None else N, sample_time, delay, commands, x0)
    np.testing.assert_allclose(z[:4], x, rtol=1e-9, atol=1e-10)
    assert total == pytest.approx(cost, rel=1e-9)


@pytest.mark.parametrize("delay", DELAYS)
def test_states_that_hold_commands_are_named(delay):
    """Each held state is the command of its input as many samples ago as it says."""
    A, B, Q, R, _ = random_problem(9)
    s = sampled_regulator(A, B, Q, R, None, 0.2, delay)
    commands = np.random.default_rng(1).normal(size=(8, 2))
    z = np.zeros(s.A.shape[-1])
    for u in commands:
        z = s.A @ z + s.B @ u
    assert len(s.held) == len(z) - 4
    for value, (i, age) in zip(z[4:], s.held, strict=True):
        assert value == commands[len(commands) - age, i]
    assert max([age for _, age in s.held], default=0) == max(int(np.ceil(d / 0.2 - 1e-9)) for d in delay)


def test_whole_samples_by_either_way():
    A, B, Q, R, N = random_problem(10)
    one = sampled_regulator(A, B, Q, R, N, 0.1, (0.3, 0.1 + 1e-12))
    other = with_input_delay(sampled_regulator(A, B, Q, R, N, 0.1), (3, 1))
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.held == other.held == ((0, 1), (0, 2), (0, 3), (1, 1))
    assert with_input_delay(other, (0, 0)) is other


@pytest.mark.parametrize("samples", [1, 3])
def test_the_optimum_with_equal_delays_predicts_the_state(samples):
    """All inputs late by d samples: the optimal gain is that of the prompt plant, on the state d samples from now."""
    A, B, Q, R = tunnel()
    sample_time = 2e-3
    prompt = sampled_regulator(A, B, Q, R, None, sample_time)
    late = with_input_delay(prompt, (samples, samples))
    K = solve_discrete_riccati(prompt.A, prompt.B, prompt.Q, prompt.R, prompt.N).K
    K_late = solve_discrete_riccati(late.A, late.B, late.Q, late.R, late.N)
    assert K_late.certified
    predictor = np.zeros((5, 5 + 2 * samples))
    predictor[:, :5] = np.linalg.matrix_power(prompt.A, samples)
    for column, (i, age) in enumerate(late.held):
        predictor[:, 5 + column] = np.linalg.matrix_power(prompt.A, age - 1) @ prompt.B[:, i]
    expected = K @ predictor
    assert np.all(np.abs(K_late.K - expected) <= 1e-8 * np.abs(expected).max(axis=0))


def test_short_samples_give_the_continuous_regulator():
    """K to the order of the sample time, X to its square."""
    A, B, Q, R = tunnel()
    continuous = solve_riccati(A, B, Q, R)
    errors = []
    for sample_time in (1e-4, 5e-5, 2.5e-5):
        s = sampled_regulator(A, B, Q, R, None, sample_time)
        solution = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
        assert solution.certified
        errors.append([np.abs(solution.K - continuous.K).max(), np.abs(solution.X - continuous.X).max()])
    errors = np.array(errors) / [np.abs(continuous.K).max(), np.abs(continuous.X).max()]
    assert errors[0, 0] < 1e-2
    ratios = errors[:-1] / errors[1:]
    np.testing.assert_allclose(ratios[:, 0], 2.0, rtol=0.02)
    np.testing.assert_allclose(ratios[:, 1], 4.0, rtol=0.2)


def test_the_sampled_optimum_beats_every_other_gain_in_continuous_time():
    """Cost of the sampled loop from x0, by Lyapunov's equation of the discrete loop: least for the designed gain."""
    A, B, Q, R = tunnel()
    s = sampled_regulator(A, B, Q, R, None, 0.02)
    solution = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)

    def cost(K):
        closed = s.A - s.B @ K
        stage = s.Q - s.N @ K - K.T @ s.N.T + K.T @ s.R @ K
        return scipy.linalg.solve_discrete_lyapunov(closed.T, stage)

    np.testing.assert_allclose(cost(solution.K), solution.X, rtol=1e-7, atol=1e-9 * np.abs(solution.X).max())
    random = np.random.default_rng(3)
    for _ in range(20):
        other = solution.K * (1.0 + 0.02 * random.normal(size=solution.K.shape))
        assert np.linalg.eigvalsh(cost(other) - solution.X)[0] >= -1e-9 * np.abs(solution.X).max()


@pytest.mark.parametrize("delay", [None, (0.02, 0.01), (0.013, 0.0)])
def test_dlqr_of_python_control_on_the_same_problem(delay):
    A, B, Q, R = tunnel()
    s = sampled_regulator(A, B, Q, R, None, 0.01, delay)
    solution = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    assert solution.certified
    K, _, poles = ct.dlqr(s.A, s.B, s.Q, s.R, s.N, method="scipy")
    np.testing.assert_allclose(solution.K, K, rtol=0, atol=1e-9 * np.abs(K).max())
    assert solution.spectral_radius == pytest.approx(np.abs(poles).max(), rel=1e-8)


@pytest.mark.parametrize("delay", [None, (0.1, 0.37)])
def test_grid_equals_points(delay):
    problems = [random_problem(seed) for seed in range(6)]
    A, B, Q, R, N = (np.stack([p[k] for p in problems]).reshape(2, 3, *problems[0][k].shape) for k in range(5))
    A = A * np.array([1.0, 30.0, 1e3])[:, None, None]
    A[1, 1, 0, 0] = np.nan
    grid = sampled_regulator(A, B, Q, R, N, 0.1, delay)
    for index in np.ndindex(2, 3):
        point = sampled_regulator(A[index], B[index], Q[index], R[index], N[index], 0.1, delay)
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(grid, name)[index], getattr(point, name))
    assert np.isnan(grid.A[1, 1, 0]).any()
    shared = sampled_regulator(A, B, Q[0, 0], R[0, 0], N[0, 0], 0.1, delay)
    np.testing.assert_array_equal(shared.Q[0, 0], grid.Q[0, 0])


def test_points_beyond_double_precision():
    A = np.array([[[1e4]], [[-1e4]], [[1e12]], [[np.inf]], [[1.0]]])
    s = sampled_regulator(A, np.ones((5, 1, 1)), np.eye(1), np.eye(1), None, 1.0)
    assert np.isnan(s.Q[:, 0, 0]).tolist() == [True, False, True, True, False]
    assert s.Q[4, 0, 0] == pytest.approx((np.exp(2) - 1) / 2, rel=1e-13)
    solution = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    assert solution.certified.tolist() == [False, True, False, False, True]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_what_is_left_of_the_cost_is_semidefinite(seed, cross):
    """`command_weight` is diagonal, not negative, and leaves a cost that a delay cannot make negative."""
    A, B, Q, R, N = random_problem(seed, cross=cross)
    s = sampled_regulator(A, B, Q, R, N, 0.3)
    assert np.all(np.diag(s.command_weight) >= 0)
    np.testing.assert_array_equal(s.command_weight, np.diag(np.diag(s.command_weight)))
    rest = np.block([[s.Q, s.N], [s.N.T, s.R - s.command_weight]])
    assert np.linalg.eigvalsh(rest)[0] >= -1e-11 * np.abs(rest).max()
    late = with_input_delay(s, (2, 1))
    whole = np.block([[late.Q, late.N], [late.N.T, late.R]])
    assert np.linalg.eigvalsh(whole)[0] >= -1e-11 * np.abs(whole).max()


def test_the_whole_of_a_diagonal_r_is_charged_with_the_command():
    A, B, Q, R = tunnel()
    s = sampled_regulator(A, B, Q, R, None, 0.01)
    np.testing.assert_array_equal(s.command_weight, R * 0.01)
    # Without semidefinite weights there is nothing to hand over, and no exception either.
    bad = sampled_regulator(A, B, Q, -R, None, 0.01)
    assert not np.any(bad.command_weight > 0)
    assert not solve_discrete_riccati(bad.A, bad.B, bad.Q, bad.R, bad.N).certified


@pytest.mark.parametrize("sample_time", [0.0, -1.0, np.nan, np.inf])
def test_sample_times_that_are_none(sample_time):
    A, B, Q, R = tunnel()
    with pytest.raises(ValueError, match="sample time"):
        sampled_regulator(A, B, Q, R, None, sample_time)


@pytest.mark.parametrize("delay", [(0.1,), (0.1, -0.1), (np.nan, 0.0), (0.0, np.inf), (0.0, 0.0, 0.0)])
def test_delays_that_are_none(delay):
    A, B, Q, R = tunnel()
    with pytest.raises(ValueError, match="delays of"):
        sampled_regulator(A, B, Q, R, None, 0.1, delay)


@pytest.mark.parametrize("samples", [(1,), (1, -1), (1.5, 0), (0, 0, 0)])
def test_samples_that_are_none(samples):
    A, B, Q, R = tunnel()
    with pytest.raises(ValueError, match="whole numbers"):
        with_input_delay(sampled_regulator(A, B, Q, R, None, 0.1), samples)
