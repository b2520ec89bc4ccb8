import control as ct
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr import discrete_riccati
from design.lqr.discrete_riccati import solve_discrete_riccati
from design.lqr.sampled_cost import sampled_regulator
from design.lqr.weights import weight_matrices
from tests.design.exact_riccati import exact_discrete_solution
from tests.design.lqr_cases import (
    EXAMPLES,
    Problems,
    example,
    hidden_discrete_modes,
    tunnel_plant,
    unreached_discrete_modes,
    weights_over_twelve_decades,
)

FIELDS = ("X", "K", "residual", "spectral_radius")


def relative(error, value):
    return np.max(np.abs(error), axis=(-2, -1)) / np.max(np.abs(value), axis=(-2, -1))


def sampled_example(name, sample_time, delay=None):
    model, controller = example(name)
    n = model.A.shape[-1]
    A, B = np.zeros((*model.A.shape[:-2], n + 1, n + 1)), np.zeros((*model.A.shape[:-2], n + 1, 2))
    A[..., :n, :n], B[..., :n, :], A[..., n, 2] = model.A, model.B, -1.0
    weights = weight_matrices(controller.weights)
    return sampled_regulator(A, B, weights.Q, weights.R, weights.N, sample_time, delay)


def sampled_tunnel(points, sample_time=2e-3, seed=5):
    problems = weights_over_twelve_decades(points, seed)
    return sampled_regulator(problems.A, problems.B, problems.Q, problems.R, None, sample_time)


@pytest.mark.parametrize("sample_time", [1e-3, 1e-2])
@pytest.mark.parametrize("name", EXAMPLES)
def test_sampled_examples_agree_with_scipy_and_control(name, sample_time):
    s = sampled_example(name, sample_time)
    solution = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    assert solution.certified.all()
    assert set(solution.solver.ravel()) == {"doubling"}
    assert solution.residual.max() <= 1e-14
    for index in np.ndindex(s.A.shape[:-2]):
        A, B, Q, R, N = (m[index] for m in (s.A, s.B, s.Q, s.R, s.N))
        X = scipy.linalg.solve_discrete_are(A, B, Q, R, s=N)
        K = np.linalg.solve(R + B.T @ X @ B, B.T @ X @ A + N.T)
        assert relative(solution.X[index] - X, X) <= 1e-9
        assert relative(solution.K[index] - K, K) <= 1e-9
        radius = np.abs(np.linalg.eigvals(A - B @ K)).max()
        assert solution.spectral_radius[index] == pytest.approx(radius, rel=1e-9)
    K = ct.dlqr(A, B, Q, R, N, method="scipy")[0]
    assert relative(solution.K[index] - K, K) <= 1e-9


def test_residual_is_the_residual():
    """The equation holds with the terms written out as in a textbook."""
    s = sampled_example("wind_tunnel", 5e-3)
    X = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N).X
    half = s.A.mT @ X @ s.B + s.N
    terms = s.A.mT @ X @ s.A, X, half @ np.linalg.inv(s.R + s.B.mT @ X @ s.B) @ half.mT, s.Q
    error = terms[0] - terms[1] - terms[2] + terms[3]
    assert np.all(np.abs(error) <= 1e-13 * sum(np.abs(t).max(axis=(-2, -1), keepdims=True) for t in terms))


@pytest.mark.parametrize("cross", [False, True])
def test_grid_equals_points(cross):
    s = sampled_tunnel(12)
    A, B, Q, R, N = (m.reshape(3, 4, *m.shape[1:]).copy() for m in (s.A, s.B, s.Q, s.R, s.N))
    A[1, 2, 0, 0], B[2, 0] = np.nan, 0.0
    N = N if cross else None
    if N is not None:
        N[2, 0] = 0.0
    grid = solve_discrete_riccati(A, B, Q, R, N)
    assert grid.certified.sum() == 10
    for index in np.ndindex(3, 4):
        point = solve_discrete_riccati(A[index], B[index], Q[index], R[index], None if N is None else N[index])
        assert point.certified == grid.certified[index]
        assert point.solver[()] == grid.solver[index]
        for field in FIELDS:
            np.testing.assert_allclose(getattr(grid.take(index), field), getattr(point, field), rtol=1e-13, atol=0)


def test_no_points_and_shared_weights():
    empty = solve_discrete_riccati(np.zeros((0, 5, 5)), np.zeros((0, 5, 2)), np.eye(5), np.eye(2))
    assert empty.K.shape == (0, 2, 5)
    A, B = 0.5 * np.eye(5), np.ones((5, 2))
    single = solve_discrete_riccati(A, B, np.eye(5), np.eye(2))
    stacked = solve_discrete_riccati(A[None], B[None], np.eye(5)[None], np.eye(2))
    np.testing.assert_array_equal(stacked.K[0], single.K)


@pytest.mark.parametrize(
    ("Q", "R", "N"),
    [
        (np.eye(4), np.eye(2), None),
        (np.eye(5), np.eye(3), None),
        (np.eye(5), np.eye(2), np.zeros((2, 5))),
        (np.tile(np.eye(5), (7, 1, 1)), np.eye(2), None),
    ],
)
def test_wrong_shapes_are_refused(Q, R, N):
    with pytest.raises(ValueError, match="has shape"):
        solve_discrete_riccati(np.eye(5), np.ones((5, 2)), Q, R, N)


def test_scalar_problem_in_closed_form():
    """``b^2 x^2 + (r - a^2 r - b^2 q) x - q r = 0``, over many decades."""
    random = np.random.default_rng(2)
    a = random.uniform(-3, 3, 400)
    b, q, r = (10.0 ** random.uniform(-4, 4, 400) for _ in range(3))
    solution = solve_discrete_riccati(*(m[:, None, None] for m in (a, b, q, r)))
    half = 0.5 * (r - a * a * r - b * b * q)
    root = np.sqrt(half**2 + b * b * q * r)
    x = np.where(half > 0, q * r / (half + root), (root - half) / (b * b))
    assert solution.certified.mean() >= 0.99
    known = solution.certified
    np.testing.assert_allclose(solution.X[known, 0, 0], x[known], rtol=1e-9)
    K = a * b * x / (r + b * b * x)
    np.testing.assert_allclose(solution.K[known, 0, 0], K[known], rtol=1e-9)


@pytest.mark.parametrize("delays", [(1, 1), (3, 3), (2, 0), (0, 4)])
def test_delayed_inputs_make_a_singular(delays):
    s = sampled_example("wind_tunnel", 2e-3, [2e-3 * d for d in delays])
    assert np.all(np.abs(np.linalg.det(s.A)) < 1e-12)
    solution = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    assert solution.certified.all()
    assert set(solution.solver.ravel()) == {"doubling"}
    index = (1, 2)
    X = scipy.linalg.solve_discrete_are(*(m[index] for m in (s.A, s.B, s.Q, s.R)), s=s.N[index])
    K = np.linalg.solve(s.R[index] + s.B[index].T @ X @ s.B[index], s.B[index].T @ X @ s.A[index] + s.N[index].T)
    assert relative(solution.K[index] - K, K) <= 1e-9


def test_nilpotent_and_zero_plants():
    """Nothing to do: the state is gone by itself, X is what it costs on its way."""
    A = np.diag([1.0, 1.0], 1)
    solution = solve_discrete_riccati(np.stack([A, 0 * A]), np.zeros((2, 3, 1)), np.eye(3), np.eye(1))
    assert solution.certified.all()
    np.testing.assert_allclose(solution.X[0], np.diag([1.0, 2.0, 3.0]), rtol=1e-13)
    np.testing.assert_allclose(solution.X[1], np.eye(3), rtol=1e-13)
    assert not solution.K.any()


def judge(problems: Problems, N, gain_tolerance: float, damping_tolerance: float) -> int:
    """Check every certified point against 60 decimal digits; how many there are."""
    solution = solve_discrete_riccati(problems.A, problems.B, problems.Q, problems.R, N)
    for i in np.flatnonzero(solution.certified):
        A, B, R = problems.A[i], problems.B[i], problems.R[i]
        exact = exact_discrete_solution(A, B, problems.Q[i], R, np.zeros_like(B) if N is None else N[i], solution.X[i])
        assert exact.stabilising, i
        size = np.sqrt(np.diag(R))[:, None] / np.sqrt(np.abs(np.diag(exact.X)))
        error = np.linalg.norm((solution.K[i] - exact.K) * size) / np.linalg.norm(exact.K * size)
        assert error <= gain_tolerance, i
        damping = [1.0 - np.abs(np.linalg.eigvals(A - B @ K)).max() for K in (solution.K[i], exact.K)]
        assert abs(damping[0] - damping[1]) <= damping_tolerance * damping[1] + 1e-14, i
    return int(solution.certified.sum())


def test_weights_over_twelve_decades_are_never_certified_and_wrong():
    s = sampled_tunnel(60, seed=5)
    assert judge(s, s.N, gain_tolerance=1e-9, damping_tolerance=1e-5) >= 58


def test_modes_hidden_from_the_cost_are_never_certified_and_wrong():
    certified = judge(hidden_discrete_modes(120, seed=11), None, gain_tolerance=1e-6, damping_tolerance=1e-2)
    assert 20 <= certified <= 90


def test_modes_out_of_reach_are_never_certified_and_wrong():
    certified = judge(unreached_discrete_modes(80, seed=12), None, gain_tolerance=1e-4, damping_tolerance=1e-2)
    assert 15 <= certified <= 65


# Below: the known ways in which solvers fail in silence. Each has to be refused, or right.


@pytest.mark.parametrize("power", [-120, -40, 40, 120])
def test_powers_of_ten_in_the_weights_scale_the_solution_only(power):
    s = sampled_example("wind_tunnel", 5e-3)
    plain = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    scaled = solve_discrete_riccati(s.A, s.B, *(m * 10.0**power for m in (s.Q, s.R, s.N)))
    assert scaled.certified.all()
    np.testing.assert_allclose(scaled.K, plain.K, rtol=1e-10)
    np.testing.assert_allclose(scaled.X, plain.X * 10.0**power, rtol=1e-9)


def test_scaling_of_1e160():
    """With the input worth nothing the unstable mode is mirrored, with everything it is gone at once."""
    for b, q, r in [(1e160, 1.0, 1.0), (1.0, 1e160, 1.0), (1.0, 1.0, 1e160), (1e-160, 1.0, 1.0)]:
        solution = solve_discrete_riccati(*(np.array([[v]]) for v in (2.0, b, q, r)))
        if solution.certified:
            free = r > 1.0 or b < 1.0
            assert solution.K[0, 0] * b == pytest.approx(1.5 if free else 2.0, rel=1e-12)
            assert solution.spectral_radius < 1.0
        else:
            assert np.isnan(solution.K).all()
    beyond = solve_discrete_riccati(*(np.array([[v]]) for v in (1e300, 1e300, 1e300, 1e-300)))
    assert not beyond.certified


def test_states_in_units_decades_apart():
    random = np.random.default_rng(13)
    unit = 10.0 ** random.uniform(-8, 8, (40, 5))
    A = 0.7 * random.normal(size=(40, 5, 5))
    B, C = random.normal(size=(40, 5, 2)), random.normal(size=(40, 3, 5))
    R = np.eye(2)
    plain = solve_discrete_riccati(A, B, C.mT @ C, R)
    A, B, C = A * unit[:, :, None] / unit[:, None, :], B * unit[:, :, None], C / unit[:, None, :]
    force = np.array([1e-6, 1e6])
    scaled = solve_discrete_riccati(A, B * force, C.mT @ C, R * force * force[:, None])
    assert scaled.certified.all()
    expected = plain.K / unit[:, None, :] / force[:, None]
    np.testing.assert_allclose(scaled.K, expected, rtol=1e-7, atol=0)


@pytest.mark.parametrize("size", [1e-3, 1e-8, 1e-12, 1e-160, 1e-200, 0.0])
def test_tiny_input_matrix(size):
    """An unstable plant with hardly an input: 2 becomes 1/2, whatever the weight."""
    solution = solve_discrete_riccati(2.0 * np.eye(1), np.eye(1) * size, np.eye(1), np.eye(1))
    if size >= 1e-12:
        assert solution.certified
    if solution.certified:
        # x = 3 r / b^2 (1 + small)
        tolerance = 1e-12 + 2.0 * size**2
        assert solution.K[0, 0] * size == pytest.approx(1.5, rel=tolerance)
    else:
        assert np.isnan(solution.K).all()
        assert solution.solver[()] == "none"
    stable = solve_discrete_riccati(0.5 * np.eye(1), np.eye(1) * size, np.eye(1), np.eye(1))
    assert stable.certified
    assert abs(stable.K[0, 0]) <= size


@pytest.mark.parametrize("pole", [1.0, -1.0, np.exp(0.3j), 1j])
def test_undetectable_weights_on_the_unit_circle(pole):
    """A mode on the circle without a weight: no stabilising solution, in any coordinates."""
    block = np.array([[pole.real, -pole.imag], [pole.imag, pole.real]]) if np.imag(pole) else np.array([[pole]])
    k = len(block)
    A = scipy.linalg.block_diag(block, [[0.5, 0.2], [0.0, 1.4]])
    Q = np.diag([0.0] * k + [1.0, 1.0])
    for T in (np.eye(k + 2), np.linalg.qr(np.random.default_rng(4).normal(size=(k + 2, k + 2)))[0]):
        solution = solve_discrete_riccati(T @ A @ T.T, T @ np.ones((k + 2, 1)), T @ Q @ T.T, np.eye(1))
        assert not solution.certified
        assert np.isnan(solution.K).all()
        assert np.isnan(solution.X).all()


def test_integrator_of_the_product_without_a_weight():
    A, B = tunnel_plant()
    Q = np.diag([1.0, 1.0, 1.0, 1.0, 0.0])
    s = sampled_regulator(A, B, Q, np.eye(2), None, 5e-3)
    assert not solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N).certified


def test_unstable_mode_out_of_sight_is_mirrored():
    A, B = np.diag([2.0, -0.5]), np.array([[1.0], [1.0]])
    solution = solve_discrete_riccati(A, B, np.zeros((2, 2)), np.eye(1))
    assert solution.certified
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(A - B @ solution.K)), [-0.5, 0.5], rtol=1e-12)


@pytest.mark.parametrize(
    "R",
    [
        np.diag([1.0, 0.0]),
        np.diag([1.0, -1.0]),
        np.zeros((2, 2)),
        np.array([[1.0, 2.0], [2.0, 1.0]]),
        np.array([[1.0, 1.0], [1.0, 1.0]]),
        np.array([[1.0, 0.5], [-0.5, 1.0]]),
        np.diag([1.0, np.nan]),
        np.diag([1.0, np.inf]),
    ],
)
def test_weights_on_the_inputs_that_are_not_positive_definite(R):
    A, B = tunnel_plant()
    solution = solve_discrete_riccati(0.01 * A, B, np.eye(5), R)
    assert not solution.certified
    assert np.isnan(solution.K).all()
    assert np.isnan(solution.X).all()


@pytest.mark.parametrize("Q", [-np.eye(2), np.diag([1.0, -1e-6]), np.array([[0.0, 1.0], [1.0, 0.0]])])
def test_weights_on_the_states_that_are_not_semidefinite(Q):
    A, B = np.array([[0.9, 0.1], [0.0, 0.8]]), np.array([[0.0], [1.0]])
    assert not solve_discrete_riccati(A, B, Q, np.eye(1)).certified
    # The same by a cross term that prices more than there is.
    assert not solve_discrete_riccati(A, B, np.eye(2), np.eye(1), np.array([[2.0], [0.0]])).certified


def test_bad_points_do_not_touch_their_neighbours():
    A, B = 0.9 * np.eye(3) + np.diag([0.3, 0.3], 1), np.array([[0.0], [0.0], [1.0]])
    alone = solve_discrete_riccati(A, B, np.eye(3), np.eye(1))
    A, B = np.tile(A, (9, 1, 1)), np.tile(B, (9, 1, 1))
    Q, R = np.tile(np.eye(3), (9, 1, 1)), np.tile(np.eye(1), (9, 1, 1))
    A[1, 0, 0], A[2, 2, 1], B[3, 0, 0], Q[4, 0, 0], R[5, 0, 0] = np.nan, np.inf, -np.inf, np.nan, -1.0
    Q[6, 0, 1] = 5.0
    A[7], B[7] = 2.0 * np.eye(3), 0.0
    solution = solve_discrete_riccati(A, B, Q, R)
    assert solution.certified.tolist() == [True] + 7 * [False] + [True]
    assert np.isnan(solution.K[1:8]).all()
    for i in (0, 8):
        np.testing.assert_array_equal(solution.K[i], alone.K)


def test_scipy_is_asked_where_both_batched_algorithms_fail(monkeypatch):
    """And only then: the answer is the same, and says who found it."""
    s = sampled_example("wind_tunnel", 5e-3)
    plain = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)

    def fails(equation):
        return np.full_like(equation.A, np.nan)

    kind = discrete_riccati._DISCRETE
    without_doubling = {**kind.__dict__, "quick": lambda equation: (fails(equation), None)}
    monkeypatch.setattr(discrete_riccati, "_DISCRETE", type(kind)(**without_doubling))
    second = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    assert second.certified.all()
    monkeypatch.setattr(discrete_riccati, "_DISCRETE", type(kind)(**{**without_doubling, "thorough": fails}))
    third = solve_discrete_riccati(s.A, s.B, s.Q, s.R, s.N)
    assert set(third.solver.ravel()) == {"scipy"}
    for other in (second, third):
        np.testing.assert_allclose(other.K, plain.K, rtol=1e-10)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 3))
def test_random_problems_satisfy_the_equation_and_are_stable(seed, n, m):
    random = np.random.default_rng(seed)
    A, B = random.normal(size=(3, n, n)), random.normal(size=(3, n, m))
    C, D = random.normal(size=(3, n, n)), random.normal(size=(3, m, m))
    Q, R = C.mT @ C, D.mT @ D + 0.1 * np.eye(m)
    solution = solve_discrete_riccati(A, B, Q, R)
    assert solution.certified.all()
    X, K = solution.X, solution.K
    np.testing.assert_allclose((R + B.mT @ X @ B) @ K, B.mT @ X @ A, atol=1e-9 * np.abs(X).max() * np.abs(A).max())
    error = A.mT @ X @ (A - B @ K) - X + Q
    assert np.all(np.abs(error) <= 1e-9 * np.abs(X).max() * max(1.0, np.abs(A).max() ** 2))
    assert np.all(np.abs(np.linalg.eigvals(A - B @ K)) < 1)
    assert np.all(np.linalg.eigvalsh(X) > 0)
