import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr.riccati import solve_riccati
from design.lqr.solvability import solvability
from design.lqr.weights import weight_matrices
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, hidden_modes, tunnel_plant, unreached_modes


def test_the_example_has_a_solution():
    A, B = tunnel_plant()
    weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
    result = solvability(A, B, weights.Q, weights.R)
    assert result.stabilisable
    assert result.observable_on_axis
    assert result.reasons[()] is None


def test_integrator_without_a_weight_is_named():
    A, B = tunnel_plant()
    Q = np.diag([1.0, 1.0, 1.0, 1.0, 0.0])
    result = solvability(A, B, Q, np.eye(2))
    assert result.stabilisable
    assert not result.observable_on_axis
    assert abs(result.unobserved) < 1e-9
    assert result.reasons[()].startswith("Q does not see the mode at 0 1/s")


def test_undamped_pair_without_a_weight_is_named_by_its_frequency():
    A = np.zeros((4, 4))
    A[0, 1], A[1, 0], A[2, 2], A[3, 3] = 300.0, -300.0, 5.0, -1.0
    T = np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0]
    result = solvability(T @ A @ T.T, T @ np.ones((4, 1)), T @ np.diag([0, 0, 1.0, 0]) @ T.T, np.eye(1))
    assert result.stabilisable
    assert not result.observable_on_axis
    assert abs(result.unobserved) == pytest.approx(300.0, rel=1e-9)
    assert "300j" in result.reasons[()]


def test_unstable_mode_out_of_reach_is_named():
    A, B = np.diag([3.0, -1.0, 0.5]), np.array([[0.0], [1.0], [1.0]])
    result = solvability(A, B, np.eye(3), np.eye(1))
    assert not result.stabilisable
    assert result.uncontrolled == pytest.approx(3.0)
    assert "(A, B) is not stabilisable: no input reaches the mode at 3 1/s" in result.reasons[()]
    # A stable mode out of reach is nobody's concern.
    assert solvability(np.diag([-3.0, -1.0, 0.5]), B, np.eye(3), np.eye(1)).reasons[()] is None


def test_unobserved_unstable_mode_is_mirrored_not_refused():
    result = solvability(np.diag([2.0, -1.0]), np.ones((2, 1)), np.diag([0.0, 1.0]), np.eye(1))
    assert result.reasons[()] is None


def test_the_cross_term_moves_the_mode_that_has_to_be_seen():
    """With A - B R^-1 N' the integrator is no longer on the axis, or comes onto it."""
    A, B, R = np.zeros((1, 1)), np.ones((1, 1)), np.eye(1)
    assert not solvability(A, B, np.zeros((1, 1)), R).observable_on_axis
    assert solvability(A, B, np.eye(1), R, np.eye(1)).observable_on_axis
    result = solvability(np.eye(1), B, np.eye(1), R, np.eye(1))
    assert not result.observable_on_axis
    assert result.reasons[()].startswith("Q - N R^-1 N' does not see")


def test_how_strong_an_input_or_a_weight_is_does_not_matter():
    A, B = tunnel_plant()
    for strength in (1e-150, 1e-9, 1.0, 1e9, 1e150):
        assert solvability(A, B * strength, np.eye(5), np.eye(2)).reasons[()] is None
        assert solvability(A, B, np.eye(5) * strength, np.eye(2)).reasons[()] is None
    assert not solvability(A, 0.0 * B, np.eye(5), np.eye(2)).stabilisable


def test_data_that_define_no_problem():
    A, B = tunnel_plant()
    assert "R is not positive definite" in solvability(A, B, np.eye(5), -np.eye(2)).reasons[()]
    assert "not finite" in solvability(A * np.nan, B, np.eye(5), np.eye(2)).reasons[()]


def test_grid_equals_points():
    A, B = tunnel_plant()
    A, B, Q = np.tile(A, (2, 3, 1, 1)), np.tile(B, (2, 3, 1, 1)), np.tile(np.eye(5), (2, 3, 1, 1))
    Q[0, 1, 4, 4], B[1, 2], A[1, 0, 0, 0] = 0.0, 0.0, np.nan
    grid = solvability(A, B, Q, np.eye(2))
    assert [reason is None for reason in grid.reasons.ravel()] == [True, False, True, False, True, False]
    for index in np.ndindex(2, 3):
        point = solvability(A[index], B[index], Q[index], np.eye(2))
        for field in ("control_distance", "observation_distance", "uncontrolled", "unobserved", "reasons"):
            np.testing.assert_array_equal(getattr(grid.take(index), field), getattr(point, field))


@pytest.mark.parametrize("problems", [hidden_modes(300, 21), unreached_modes(300, 22)], ids=["hidden", "unreached"])
def test_no_certified_solution_where_there_is_none(problems):
    lost = solvability(problems.A, problems.B, problems.Q, problems.R).reasons.astype(bool)
    certified = solve_riccati(problems.A, problems.B, problems.Q, problems.R).certified
    assert 20 <= lost.sum() <= 280
    assert not np.any(lost & certified)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_rank_tests_agree_with_grammians_of_the_mode(seed):
    """In modal coordinates the answer can be read off: a zero row of B, a zero column of the weight."""
    random = np.random.default_rng(seed)
    poles = np.array([random.uniform(0.5, 2.0), 0.0, -1.0, random.uniform(-3, -2)])
    B, C = random.uniform(0.5, 1.5, (4, 2)), random.uniform(0.5, 1.5, (2, 4)) + np.eye(2, 4)
    out_of_reach, out_of_sight = random.random(4) < 0.4, random.random(4) < 0.4
    B[out_of_reach], C[:, out_of_sight] = 0.0, 0.0
    T = np.linalg.qr(random.normal(size=(4, 4)))[0]
    Q = T @ C.T @ C @ T.T
    result = solvability(T @ np.diag(poles) @ T.T, T @ B, 0.5 * (Q + Q.T), np.eye(2))
    assert bool(result.stabilisable) == (not out_of_reach[:2].any())
    assert bool(result.observable_on_axis) == (not out_of_sight[1])
