import numpy as np
import pytest

from design.lqr.discrete_riccati import solve_discrete_riccati
from design.lqr.sampled_cost import sampled_regulator
from design.lqr.solvability import solvability
from design.lqr.weights import weight_matrices
from tests.design.lqr_cases import (
    WIND_TUNNEL_WEIGHTS,
    hidden_discrete_modes,
    tunnel_plant,
    unreached_discrete_modes,
)


def sampled_tunnel(Q=None, delay=None):
    A, B = tunnel_plant()
    weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
    return sampled_regulator(A, B, weights.Q if Q is None else Q, weights.R, None, 5e-3, delay)


@pytest.mark.parametrize("delay", [None, (5e-3, 1e-2)])
def test_the_example_has_a_solution(delay):
    s = sampled_tunnel(delay=delay)
    result = solvability(s.A, s.B, s.Q, s.R, s.N, discrete=True)
    assert result.stabilisable
    assert result.observable_on_axis
    assert result.reasons[()] is None


def test_integrator_without_a_weight_is_named():
    s = sampled_tunnel(np.diag([1.0, 1.0, 1.0, 1.0, 0.0]))
    result = solvability(s.A, s.B, s.Q, s.R, s.N, discrete=True)
    assert not result.observable_on_axis
    assert "does not see the mode at z = 1 on the unit circle" in result.reasons[()]


@pytest.mark.parametrize("angle", [0.0, np.pi, 1.0])
def test_a_mode_on_the_circle_without_a_weight_is_named(angle):
    A = np.zeros((4, 4))
    A[:2, :2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    A[2, 2], A[3, 3] = 1.7, 0.4
    T = np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0]
    B = np.eye(4, 2) + 0.5
    Q = T @ np.diag([0.0, 0.0, 1.0, 0.0]) @ T.T
    result = solvability(T @ A @ T.T, T @ B, 0.5 * (Q + Q.T), np.eye(2), discrete=True)
    assert not result.observable_on_axis
    assert abs(result.unobserved) == pytest.approx(1.0, rel=1e-9)
    assert abs(np.angle(result.unobserved)) == pytest.approx(angle, abs=1e-7)
    assert "on the unit circle" in result.reasons[()]


def test_unstable_mode_out_of_reach_is_named():
    A, B = np.diag([3.0, 0.5, 0.9]), np.array([[0.0], [1.0], [1.0]])
    result = solvability(A, B, np.eye(3), np.eye(1), discrete=True)
    assert not result.stabilisable
    assert result.uncontrolled == pytest.approx(3.0)
    assert "(A, B) is not stabilisable: no input reaches the mode at z = 3" in result.reasons[()]
    # Inside the circle, on the left of the axis or not, nobody needs to reach it.
    assert solvability(np.diag([0.3, 0.5, 1.9]), B, np.eye(3), np.eye(1), discrete=True).reasons[()] is None
    # A mode at -3 is no more stable for being on the left of the axis.
    assert not solvability(np.diag([-3.0, 0.5, 0.9]), B, np.eye(3), np.eye(1), discrete=True).stabilisable


def test_unobserved_unstable_mode_is_mirrored_not_refused():
    A, B = np.diag([2.0, -0.5]), np.ones((2, 1))
    assert solvability(A, B, np.diag([0.0, 1.0]), np.eye(1), discrete=True).reasons[()] is None


def test_data_that_define_no_problem():
    A, B = np.diag([0.9, 0.5]), np.ones((2, 1))
    for Q, R, N in (
        (np.eye(2), -np.eye(1), None),
        (-np.eye(2), np.eye(1), None),
        (np.eye(2), np.eye(1), np.array([[2.0], [0.0]])),
        (np.nan * np.eye(2), np.eye(1), None),
    ):
        reason = solvability(A, B, Q, R, N, discrete=True).reasons[()]
        assert reason is not None
        assert "positive" in reason
    assert "Q - N R^-1 N' is not positive semidefinite" in reason or N is None


@pytest.mark.parametrize(
    "problems", [hidden_discrete_modes(300, 21), unreached_discrete_modes(300, 22)], ids=["hidden", "unreached"]
)
def test_no_certified_solution_where_there_is_none(problems):
    lost = solvability(problems.A, problems.B, problems.Q, problems.R, discrete=True).reasons.astype(bool)
    certified = solve_discrete_riccati(problems.A, problems.B, problems.Q, problems.R).certified
    assert 20 <= lost.sum() <= 280
    assert not np.any(lost & certified)


def test_grid_equals_points():
    s = sampled_tunnel()
    A, B, Q = (np.tile(m, (2, 3, 1, 1)) for m in (s.A, s.B, s.Q))
    Q[0, 1], B[1, 2], A[1, 0, 0, 0] = 0.0, 0.0, np.nan
    grid = solvability(A, B, Q, s.R, discrete=True)
    assert [reason is None for reason in grid.reasons.ravel()] == [True, False, True, False, True, False]
    for index in np.ndindex(2, 3):
        point = solvability(A[index], B[index], Q[index], s.R, discrete=True)
        for field in ("control_distance", "observation_distance", "uncontrolled", "unobserved", "reasons"):
            np.testing.assert_array_equal(getattr(grid.take(index), field), getattr(point, field))
