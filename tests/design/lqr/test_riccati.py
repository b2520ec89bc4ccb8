import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr.certificate import MAX_RESIDUAL
from design.lqr.regulator import regulator_problem
from design.lqr.riccati import solve_riccati
from design.lqr.weights import weight_matrices
from tests.design.exact_riccati import exact_solution
from tests.design.lqr_cases import (
    EXAMPLES,
    Problems,
    example,
    hidden_modes,
    tunnel_plant,
    unreached_modes,
    weights_over_twelve_decades,
)

FIELDS = ("X", "K", "residual", "largest_real_part")


def relative(error, value):
    return np.max(np.abs(error), axis=(-2, -1)) / np.max(np.abs(value), axis=(-2, -1))


def augmented(model):
    n = model.A.shape[-1]
    A, B = np.zeros((*model.A.shape[:-2], n + 1, n + 1)), np.zeros((*model.A.shape[:-2], n + 1, 2))
    A[..., :n, :n], B[..., :n, :], A[..., n, 2] = model.A, model.B, -1.0
    return A, B


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_agree_with_scipy_point_by_point(name):
    model, controller = example(name)
    weights = weight_matrices(controller.weights)
    A, B = augmented(model)
    solution = solve_riccati(A, B, weights.Q, weights.R)
    assert solution.certified.all()
    assert set(solution.solver.ravel()) == {"eigenvectors"}
    assert solution.residual.max() <= 1e-12
    for index in np.ndindex(A.shape[:-2]):
        X = scipy.linalg.solve_continuous_are(A[index], B[index], weights.Q, weights.R)
        K = np.linalg.solve(weights.R, B[index].T @ X)
        assert relative(solution.K[index] - K, K) <= 1e-8
        assert relative(solution.X[index] - X, X) <= 1e-8
        poles = np.linalg.eigvals(A[index] - B[index] @ K)
        assert solution.largest_real_part[index] == pytest.approx(poles.real.max(), rel=1e-8)


def test_residual_is_the_residual():
    """In plain units too the Riccati equation holds, with the terms written out as in a textbook."""
    A, B = augmented(example("wind_tunnel")[0])
    weights = weight_matrices(example("wind_tunnel")[1].weights)
    X = solve_riccati(A, B, weights.Q, weights.R).X
    terms = A.mT @ X, X @ A, X @ B @ np.linalg.inv(weights.R) @ B.mT @ X, np.broadcast_to(weights.Q, A.shape)
    error = terms[0] + terms[1] - terms[2] + terms[3]
    assert np.all(np.abs(error) <= 1e-12 * sum(np.abs(t).max(axis=(-2, -1), keepdims=True) for t in terms))


@pytest.mark.parametrize("cross", [False, True])
def test_grid_equals_points(cross):
    problems = weights_over_twelve_decades(12, seed=3)
    shape = (3, 4)
    A, B, Q, R = (m.reshape(*shape, *m.shape[1:]).copy() for m in (problems.A, problems.B, problems.Q, problems.R))
    N = 1e-3 * np.sqrt(np.diagonal(Q, axis1=-2, axis2=-1))[..., :, None] if cross else None
    if N is not None:
        N = N * np.sqrt(np.diagonal(R, axis1=-2, axis2=-1))[..., None, :]
    A[1, 2, 0, 0] = np.nan
    B[2, 0] = 0.0
    grid = solve_riccati(A, B, Q, R, N)
    assert grid.certified.sum() == 10
    for index in np.ndindex(shape):
        point = solve_riccati(A[index], B[index], Q[index], R[index], None if N is None else N[index])
        assert point.certified == grid.certified[index]
        assert point.solver[()] == grid.solver[index]
        for field in FIELDS:
            np.testing.assert_allclose(getattr(grid.take(index), field), getattr(point, field), rtol=1e-13, atol=0)


def test_no_points_and_shared_weights():
    A, B = tunnel_plant()
    empty = solve_riccati(np.zeros((0, 5, 5)), np.zeros((0, 5, 2)), np.eye(5), np.eye(2))
    assert empty.K.shape == (0, 2, 5)
    single = solve_riccati(A, B, np.eye(5), np.eye(2))
    assert single.K.shape == (2, 5)
    stacked = solve_riccati(A[None], B[None], np.eye(5)[None], np.eye(2))
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
    A, B = tunnel_plant()
    with pytest.raises(ValueError, match="has shape"):
        solve_riccati(A, B, Q, R, N)


def test_different_grids_are_refused():
    A, B = tunnel_plant()
    with pytest.raises(ValueError, match="different grids"):
        solve_riccati(A[None], B, np.eye(5), np.eye(2))


def test_cross_term_against_scipy():
    random = np.random.default_rng(8)
    A, B = random.normal(size=(6, 5, 5)), random.normal(size=(6, 5, 2))
    C, D = random.normal(size=(6, 7, 5)), random.normal(size=(6, 7, 2))
    Q, R, N = C.mT @ C, D.mT @ D, C.mT @ D
    solution = solve_riccati(A, B, Q, R, N)
    assert solution.certified.all()
    for i in range(6):
        X = scipy.linalg.solve_continuous_are(A[i], B[i], Q[i], R[i], s=N[i])
        K = np.linalg.solve(R[i], B[i].T @ X + N[i].T)
        assert relative(solution.K[i] - K, K) <= 1e-10


def judge(problems: Problems, gain_tolerance: float, damping_tolerance: float) -> int:
    """Check every certified point against 60 decimal digits; how many there are."""
    solution = solve_riccati(problems.A, problems.B, problems.Q, problems.R)
    for i in np.flatnonzero(solution.certified):
        A, B = problems.A[i], problems.B[i]
        exact = exact_solution(A, B, problems.Q[i], problems.R[i], solution.X[i])
        assert exact.stabilising, i
        # Columns in the units of their states, rows in those of their inputs.
        size = np.sqrt(np.diag(problems.R[i]))[:, None] / np.sqrt(np.abs(np.diag(exact.X)))
        error = np.linalg.norm((solution.K[i] - exact.K) * size) / np.linalg.norm(exact.K * size)
        assert error <= gain_tolerance, i
        unit = size[:1] / size[:1, :1]
        poles = [np.sort(np.linalg.eigvals((A - B @ K) * unit / unit.T).real) for K in (solution.K[i], exact.K)]
        assert np.max(np.abs(poles[0] - poles[1]) / np.abs(poles[1])) <= damping_tolerance, i
        assert np.linalg.eigvalsh(solution.X[i] * np.outer(size[0], size[0]))[0] >= -1e-9
    return int(solution.certified.sum())


def test_weights_over_twelve_decades_are_never_certified_and_wrong():
    problems = weights_over_twelve_decades(200, seed=5)
    # Not one is refused either, though scipy alone has residuals above 1e-10 at several of them.
    assert judge(problems, gain_tolerance=1e-9, damping_tolerance=1e-5) == 200


def test_the_hard_set_leaves_fewer_points_than_scipy():
    """2000 points over twelve decades: uncertified ones against scipy's with a residual above the same limit."""
    problems = weights_over_twelve_decades(2000, seed=1)
    solution = solve_riccati(problems.A, problems.B, problems.Q, problems.R)
    equation = regulator_problem(problems.A, problems.B, problems.Q, problems.R).equation
    A, F, Q = equation.A, equation.F, equation.Q
    missed = 0
    for i in range(0, 2000, 10):
        X = scipy.linalg.solve_continuous_are(problems.A[i], problems.B[i], problems.Q[i], problems.R[i])
        unit = np.ldexp(1.0, equation.state_exponent[i])
        X = X * unit[:, None] * unit
        terms = A[i].T @ X, X @ A[i], -X @ F[i] @ F[i].T @ X, Q[i]
        missed += np.linalg.norm(sum(terms)) > MAX_RESIDUAL * sum(np.linalg.norm(t) for t in terms)
    assert missed >= 3
    assert np.sum(~solution.certified) <= missed
    assert np.max(solution.residual[solution.certified]) <= MAX_RESIDUAL


def test_modes_hidden_from_the_cost_are_never_certified_and_wrong():
    certified = judge(hidden_modes(150, seed=11), gain_tolerance=1e-6, damping_tolerance=1e-3)
    assert 20 <= certified <= 120


def test_modes_out_of_reach_are_never_certified_and_wrong():
    certified = judge(unreached_modes(150, seed=12), gain_tolerance=1e-4, damping_tolerance=1e-2)
    assert 20 <= certified <= 120


def test_states_in_units_decades_apart():
    random = np.random.default_rng(13)
    unit = 10.0 ** random.uniform(-8, 8, (60, 5))
    A = random.normal(size=(60, 5, 5)) * unit[:, :, None] / unit[:, None, :]
    B = random.normal(size=(60, 5, 2)) * unit[:, :, None]
    C = random.normal(size=(60, 3, 5)) / unit[:, None, :]
    R = np.tile(np.diag([1e-6, 1e6]), (60, 1, 1))
    assert judge(Problems(A, B, C.mT @ C, R), 1e-8, 1e-5) >= 58


@pytest.mark.parametrize("power", [-120, -40, 40, 120])
def test_powers_of_ten_in_the_weights_scale_the_solution_only(power):
    """K does not change when Q and R are multiplied by the same number, however large."""
    A, B = tunnel_plant()
    weights = weight_matrices(example("wind_tunnel")[1].weights)
    plain = solve_riccati(A, B, weights.Q, weights.R)
    scaled = solve_riccati(A, B, weights.Q * 10.0**power, weights.R * 10.0**power)
    assert scaled.certified
    np.testing.assert_allclose(scaled.K, plain.K, rtol=1e-10)
    np.testing.assert_allclose(scaled.X, plain.X * 10.0**power, rtol=1e-9)


# Below: the known ways in which solvers fail in silence. Each has to be refused, or right.


def test_scaling_of_1e160():
    """Faster time, small Q: the gain of a first-order plant is known in closed form."""
    for a, b, q, r in [(1e160, 1.0, 1.0, 1.0), (1.0, 1e160, 1.0, 1.0), (1.0, 1.0, 1e160, 1.0), (1.0, 1.0, 1.0, 1e160)]:
        solution = solve_riccati(*(np.array([[v]]) for v in (a, b, q, r)))
        if solution.certified:
            # K = (a + sqrt(a^2 + b^2 q / r)) / b, the root taken without squaring.
            K = (a + np.hypot(a, b * np.sqrt(q / r))) / b
            assert solution.K[0, 0] == pytest.approx(K, rel=1e-12)
            assert solution.largest_real_part < 0
        else:
            assert np.isnan(solution.K).all()
    beyond = solve_riccati(np.eye(1) * 1e300, np.eye(1) * 1e300, np.eye(1) * 1e300, np.eye(1) * 1e-300)
    assert not beyond.certified


@pytest.mark.parametrize("size", [1e-3, 1e-8, 1e-12, 1e-160, 1e-200, 0.0])
def test_tiny_input_matrix(size):
    """An unstable plant with hardly an input: K = 2 a / b is needed whatever the weight."""
    solution = solve_riccati(np.eye(1), np.eye(1) * size, np.eye(1), np.eye(1))
    if size >= 1e-12:
        assert solution.certified
    if solution.certified:
        assert solution.K[0, 0] == pytest.approx((1 + np.hypot(1, size)) / size, rel=1e-12)
    else:
        assert np.isnan(solution.K).all()
        assert solution.solver[()] == "none"
    # A stable plant needs none at all: with no input the gain is zero, and right.
    stable = solve_riccati(-np.eye(1), np.eye(1) * size, np.eye(1), np.eye(1))
    assert stable.certified
    assert stable.K[0, 0] == pytest.approx(size / (1 + np.hypot(1, size)), rel=1e-12)


def test_undetectable_weights_on_the_axis():
    A, B = tunnel_plant()
    Q = weight_matrices(example("wind_tunnel")[1].weights).Q.copy()
    Q[4, 4] = 0.0
    assert not solve_riccati(A, B, Q, np.eye(2)).certified
    # Hidden by a change of coordinates, so that no entry shows it.
    T = np.linalg.qr(np.random.default_rng(4).normal(size=(5, 5)))[0]
    for A_axis in (np.zeros((5, 5)), np.diag([0.0, -1.0, 2.0, -3.0, 1.0])):
        seen = np.diag([0.0, 1.0, 1.0, 1.0, 1.0])
        hidden = T @ A_axis @ T.T, T @ np.ones((5, 1)) + T @ np.eye(5)
        solution = solve_riccati(*hidden, T @ seen @ T.T, np.eye(5))
        assert not solution.certified
        assert np.isnan(solution.K).all()


def test_double_integrator_without_a_weight_on_position():
    solution = solve_riccati(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.diag([0.0, 1.0]), np.eye(1)
    )
    assert not solution.certified


def test_unstable_mode_out_of_sight_is_mirrored():
    """Undetectable but not on the axis: the stabilising solution exists and puts the mode at its mirror image."""
    A, B = np.diag([2.0, -1.0]), np.array([[1.0], [1.0]])
    solution = solve_riccati(A, B, np.diag([0.0, 0.0]), np.eye(1))
    assert solution.certified
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(A - B @ solution.K)), [-2.0, -1.0], rtol=1e-12)


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
    solution = solve_riccati(A, B, np.eye(5), R)
    assert not solution.certified
    assert np.isnan(solution.K).all()
    assert np.isnan(solution.X).all()


def test_bad_points_do_not_touch_their_neighbours():
    A, B = tunnel_plant()
    A, B, Q = np.tile(A, (8, 1, 1)), np.tile(B, (8, 1, 1)), np.tile(np.eye(5), (8, 1, 1))
    R = np.tile(np.eye(2), (8, 1, 1))
    alone = solve_riccati(A[0], B[0], Q[0], R[0])
    A[1, 0, 0], A[2, 3, 1], B[3, 0, 0], Q[4, 0, 0] = np.nan, np.inf, -np.inf, np.nan
    Q[5, 0, 1] = 5.0
    B[6] = 0.0
    solution = solve_riccati(A, B, Q, R)
    assert solution.certified.tolist() == [True, False, False, False, False, False, False, True]
    assert np.isnan(solution.K[1:7]).all()
    for i in (0, 7):
        np.testing.assert_array_equal(solution.K[i], alone.K)


def test_a_singular_invariant_subspace_is_one_point_only():
    """Uncontrollable unstable modes make U1 singular: numpy would raise for the whole batch."""
    A = np.array([np.diag([1.0, -1.0]), np.diag([1.0, -1.0])])
    B = np.array([[[0.0], [1.0]], [[1.0], [1.0]]])
    solution = solve_riccati(A, B, np.eye(2), np.eye(1))
    assert solution.certified.tolist() == [False, True]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 3))
def test_random_problems_satisfy_the_equation_and_are_stable(seed, n, m):
    random = np.random.default_rng(seed)
    A, B = random.normal(size=(3, n, n)), random.normal(size=(3, n, m))
    C, D = random.normal(size=(3, n, n)), random.normal(size=(3, m, m))
    Q, R = C.mT @ C, D.mT @ D + 0.1 * np.eye(m)
    solution = solve_riccati(A, B, Q, R)
    assert solution.certified.all()
    X, K = solution.X, solution.K
    np.testing.assert_allclose(R @ K, B.mT @ X, atol=1e-8 * np.abs(X).max())
    error = A.mT @ X + X @ A - K.mT @ R @ K + Q
    assert np.all(
        np.abs(error) <= 1e-9 * (np.abs(X).max() * np.abs(A).max() + np.abs(K.mT @ R @ K).max() + np.abs(Q).max())
    )
    assert np.all(np.linalg.eigvals(A - B @ K).real < 0)
    assert np.all(np.linalg.eigvalsh(X) > 0)
