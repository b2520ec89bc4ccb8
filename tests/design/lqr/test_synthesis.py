from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

import design.lqr.synthesis
from design.lqr.return_difference import ReturnDifference
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.tracking import augment_with_integral, feed_forward, steady_state
from design.lqr.weights import BrysonWeights, ExplicitWeights, WeightsRefused, weight_matrices
from design.outcome import Outcome, Outcomes
from tests.design.lqr_cases import EXAMPLES, WIND_TUNNEL_WEIGHTS, example

NUMBERS = ("K", "N", "X", "residual", "largest_real_part", "return_difference_min")


def assert_only_ok_points_carry_numbers(design):
    ok = design.outcomes.ok
    for field in NUMBERS:
        values = getattr(design, field)
        flat = values.reshape(*ok.shape, -1)
        assert np.isfinite(flat[ok]).all()
        assert np.isnan(flat[~ok]).all()
    assert all(
        (reason is None) == good for reason, good in zip(design.outcomes.reasons.ravel(), ok.ravel(), strict=True)
    )


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples(name):
    model, controller = example(name)
    design = design_lqr(model, controller)
    plant, weights = augment_with_integral(model), weight_matrices(controller.weights)
    assert design.outcomes.ok.all()
    assert design.K.shape == (*model.A.shape[:-2], 2, 5)
    assert design.residual.max() <= 1e-12
    assert design.return_difference_min.min() >= 1.0 - 1e-6
    # The wind-tunnel sections are unstable in open loop at every point.
    assert np.all((np.linalg.eigvals(model.A).real.max(axis=-1) > 0) == name.startswith("wind_tunnel"))
    for index in np.ndindex(model.A.shape[:-2]):
        A, B = plant.A[index], plant.B[index]
        X = scipy.linalg.solve_continuous_are(A, B, weights.Q, weights.R)
        K = np.linalg.solve(weights.R, B.T @ X)
        assert np.max(np.abs(design.K[index] - K)) <= 1e-8 * np.max(np.abs(K))
        poles = np.linalg.eigvals(A - B @ design.K[index])
        assert design.largest_real_part[index] == pytest.approx(poles.real.max(), rel=1e-9)
        assert poles.real.max() < 0
    np.testing.assert_array_equal(design.N, feed_forward(design.K, steady_state(model)))
    assert design.states == plant.states
    assert design.retuning is None
    assert_only_ok_points_carry_numbers(design)


def test_controller_says_what_it_is():
    controller = LqrController("lqr", WIND_TUNNEL_WEIGHTS)
    assert controller.kind == "lqr"
    assert (controller.tab_allocation, controller.reference) == ("zero_aileron_torque", "aileron")


def test_grid_equals_points():
    model, controller = example("wind_tunnel")
    A = model.A.copy()
    A[0, 2] = np.nan
    model = replace(model, A=A)
    outcomes = Outcomes.all_ok((2, 4)).failing(
        np.eye(2, 4, dtype=bool), Outcome.OUTSIDE_MODEL, lambda index: "too fast"
    )
    grid = design_lqr(model, controller, outcomes)
    assert grid.outcomes.ok.tolist() == [[False, True, False, True], [True, False, True, True]]
    for index in np.ndindex(2, 4):
        before = Outcomes(*(np.array(a[index], dtype=object) for a in (outcomes.codes, outcomes.reasons)))
        point = design_lqr(model.take(index), controller, before)
        assert point.outcomes.codes[()] == grid.outcomes.codes[index]
        assert point.outcomes.reasons[()] == grid.outcomes.reasons[index]
        for field in NUMBERS:
            np.testing.assert_allclose(getattr(grid.take(index), field), getattr(point, field), rtol=1e-13, atol=0)


def test_earlier_outcomes_are_kept_and_carry_no_gain():
    model, controller = example("wind_tunnel")
    where = np.zeros((2, 4), dtype=bool)
    where[1, 1:3] = True
    design = design_lqr(model, controller, Outcomes.all_ok((2, 4)).failing(where, Outcome.EXCLUDED, lambda i: "mine"))
    assert (design.outcomes.codes[where] == Outcome.EXCLUDED).all()
    assert design.outcomes.reasons[1, 2] == "mine"
    assert_only_ok_points_carry_numbers(design)
    nothing = design_lqr(
        model, controller, Outcomes.all_ok((2, 4)).failing(~np.zeros_like(where), Outcome.EXCLUDED, lambda i: "all")
    )
    assert not nothing.outcomes.ok.any()
    assert_only_ok_points_carry_numbers(nothing)


def test_explicit_weights_are_brysons_when_they_are_the_same_numbers():
    model, controller = example("wind_tunnel")
    explicit = replace(controller, weights=weight_matrices(WIND_TUNNEL_WEIGHTS))
    np.testing.assert_array_equal(design_lqr(model, explicit).K, design_lqr(model, controller).K)


def test_cross_term_of_net_work_against_scipy():
    """Pricing T_t dt' + T_a da' (seed 5.2): N couples each torque with its own rate."""
    model, _ = example("wind_tunnel_23012")
    weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
    N = np.zeros((5, 2))
    N[1, 0] = N[3, 1] = 0.02
    design = design_lqr(model, LqrController("work", ExplicitWeights(weights.Q, weights.R, N)))
    assert design.outcomes.ok.all()
    plant = augment_with_integral(model)
    for index in np.ndindex(2, 4):
        X = scipy.linalg.solve_continuous_are(plant.A[index], plant.B[index], weights.Q, weights.R, s=N)
        K = np.linalg.solve(weights.R, plant.B[index].T @ X + N.T)
        assert np.max(np.abs(design.K[index] - K)) <= 1e-8 * np.max(np.abs(K))


def test_gain_is_optimal():
    """The cost x0'Xx0 from simulation of the closed loop, and no other gain is cheaper."""
    model, controller = example("wind_tunnel")
    model = model.take((0, 2))
    design, plant = design_lqr(model, controller), augment_with_integral(model)
    weights = weight_matrices(controller.weights)

    def cost(K):
        closed = plant.A - plant.B @ K
        return scipy.linalg.solve_continuous_lyapunov(closed.T, -(weights.Q + K.T @ weights.R @ K))

    best = cost(design.K)
    np.testing.assert_allclose(best, design.X, rtol=1e-7, atol=1e-9 * np.abs(design.X).max())
    random = np.random.default_rng(6)
    for _ in range(20):
        other = design.K * (1 + 0.05 * random.normal(size=design.K.shape))
        assert np.trace(cost(other)) > np.trace(best)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=7, max_size=7))
def test_any_sensible_bryson_weights_keep_the_return_difference(powers):
    """Kalman's inequality and stability over four decades of each weight, at every point of the example."""
    model, _ = example("wind_tunnel")
    values = np.array([0.035, 3.5, 0.17, 7.0, 0.0017, 0.5, 2.0]) * 10.0 ** np.array(powers)
    design = design_lqr(model, LqrController("any", BrysonWeights(*values.tolist())))
    assert design.outcomes.ok.all()
    assert np.all(design.return_difference_min >= 1.0 - 1e-6)
    assert np.all(design.largest_real_part < 0)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_scaling_with_airspeed(scale):
    """With time counted in 1/V and torques in V^2, A is the same at every speed, so K only scales.

    For x' = A x + B u with A_ii in V^2 (angles) and V (rates): scaling the rates by V, the integral by 1/V, the
    torques by V^2 maps one speed on another; Q and R follow.
    """
    model, controller = example("wind_tunnel")
    model = model.take((0, 2))
    weights = weight_matrices(controller.weights)
    unit = np.array([1.0, scale, 1.0, scale, 1.0 / scale])
    A = scale * model.A * unit[:4, None] / unit[:4]
    B = model.B.copy()
    faster = replace(model, A=A, B=B)
    scaled = ExplicitWeights(weights.Q / np.outer(unit, unit), weights.R / scale**4)
    one, other = design_lqr(model, controller), design_lqr(faster, LqrController("s", scaled))
    np.testing.assert_allclose(other.K, scale**2 * one.K / unit, rtol=1e-9)
    np.testing.assert_allclose(other.N, scale**2 * one.N, rtol=1e-9)
    np.testing.assert_allclose(other.largest_real_part, scale * one.largest_real_part, rtol=1e-9)


@pytest.mark.parametrize(
    ("matrix", "Q", "R", "N", "words"),
    [
        ("R", np.eye(5), np.diag([1.0, 0.0]), None, "R is not positive definite"),
        ("Q", np.diag([1.0, 1, -1, 1, 1]), np.eye(2), None, "Q is not positive semidefinite"),
        ("Q", np.eye(4), np.eye(2), None, "dt dt_rate da da_rate int_a"),
        ("R", np.eye(5), np.eye(3), None, "T_t T_a"),
        ("N", np.eye(5), np.eye(2), np.full((5, 2), 3.0), "Q - N R^-1 N'"),
        ("N", np.eye(5), np.eye(2), np.zeros((2, 5)), "expected"),
        ("Q", np.diag([1.0, 1, 1, 1, 0]), np.eye(2), None, "does not see the mode at 0 1/s"),
        ("N", np.diag([1.0, 1, 1, 1, 0]), np.eye(2), 0.1 * np.eye(5, 2), "does not see the mode at 0 1/s"),
    ],
)
def test_weights_that_cannot_work_are_refused(matrix, Q, R, N, words):
    model, _ = example("wind_tunnel")
    with pytest.raises(WeightsRefused) as refused:
        design_lqr(model, LqrController("bad", ExplicitWeights(Q, R, N)))
    assert refused.value.matrix == matrix
    assert words in refused.value.reason
    if "mode" in words:
        assert abs(refused.value.eigenvalue) < 1e-9


def test_a_point_that_no_input_reaches_is_infeasible_and_says_why():
    model, controller = example("wind_tunnel")
    B = model.B.copy()
    B[0, 1] = 0.0
    design = design_lqr(replace(model, B=B), controller)
    expected = np.ones((2, 4), dtype=bool)
    expected[0, 1] = False
    np.testing.assert_array_equal(design.outcomes.ok, expected)
    assert design.outcomes.codes[0, 1] == Outcome.INFEASIBLE
    # No input, no steady state either; which of the two is said first does not matter.
    assert "authority" in design.outcomes.reasons[0, 1] or "stabilisable" in design.outcomes.reasons[0, 1]
    assert_only_ok_points_carry_numbers(design)


def test_an_unseen_mode_at_one_point_is_infeasible_there():
    """One point has an undamped mode, and the weights look exactly past its shape; the others are designed."""
    model, _ = example("wind_tunnel")
    A = model.A.copy()
    A[1, 3] = [[0, 1, 0, 0], [-900, 0, -200, 0], [0, 0, 0, 1], [-5000, 0, -6000, 0]]
    values, shapes = np.linalg.eig(augment_with_integral(replace(model, A=A)).A[1, 3])
    k = int(np.argmax(values.imag))
    shape = np.stack([shapes[:, k].real, shapes[:, k].imag], axis=1)
    blind = np.eye(5) - shape @ np.linalg.pinv(shape)
    weights = ExplicitWeights(0.5 * (blind + blind.T), np.eye(2))
    design = design_lqr(replace(model, A=A), LqrController("lqr", weights))
    assert design.outcomes.ok.sum() == 7
    assert design.outcomes.codes[1, 3] == Outcome.INFEASIBLE
    assert design.outcomes.reasons[1, 3].startswith("Q does not see the mode at ")
    assert f"{values[k].imag:.4f}"[:6] in design.outcomes.reasons[1, 3]
    assert_only_ok_points_carry_numbers(design)
    # The same weights are refused as a request when that point is all there is.
    with pytest.raises(WeightsRefused) as refused:
        design_lqr(replace(model, A=A).take(np.s_[1:, 3:]), LqrController("lqr", weights))
    assert abs(refused.value.eigenvalue) == pytest.approx(values[k].imag, rel=1e-9)


def test_a_tab_without_authority_is_infeasible():
    model, controller = example("wind_tunnel")
    A = model.A.copy()
    stiffness = model.stiffness.copy()
    stiffness[1, 0, 1, 0] = 0.0
    A[..., 1::2, 0::2] = np.linalg.solve(model.inertia, stiffness)
    design = design_lqr(replace(model, A=A), controller)
    assert design.outcomes.codes[1, 0] == Outcome.INFEASIBLE
    assert "no authority" in design.outcomes.reasons[1, 0]
    assert design.outcomes.ok.sum() == 7
    assert_only_ok_points_carry_numbers(design)


def test_numbers_that_are_not_finite_stay_at_their_point():
    model, controller = example("wind_tunnel")
    A, B = model.A.copy(), model.B.copy()
    A[0, 0, 1, 1], A[0, 1], B[1, 3, 1, 0] = np.nan, np.inf, -np.inf
    design = design_lqr(replace(model, A=A, B=B), controller)
    assert design.outcomes.ok.tolist() == [[False, False, True, True], [True, True, True, False]]
    assert (design.outcomes.codes[~design.outcomes.ok] == Outcome.NOT_CERTIFIED).all()
    np.testing.assert_array_equal(design.K[0, 2], design_lqr(model, controller).K[0, 2])
    assert_only_ok_points_carry_numbers(design)


def test_weights_beyond_the_arithmetic_are_not_certified_with_their_numbers():
    """An integral weight 1e30 below the others: solvable in theory, and the slowest pole is lost in rounding."""
    model, controller = example("wind_tunnel")
    weights = replace(WIND_TUNNEL_WEIGHTS, aileron_integral=1e14)
    design = design_lqr(model, replace(controller, weights=weights))
    assert (design.outcomes.codes == Outcome.NOT_CERTIFIED).all()
    assert "relative residual" in design.outcomes.reasons[0, 0]
    assert "largest real part" in design.outcomes.reasons[0, 0]
    assert_only_ok_points_carry_numbers(design)


@pytest.mark.parametrize(
    ("smallest", "pole", "words"), [(0.9, -1.0, "return difference falls to 0.9"), (1.0, 0.1, "real part 0.1")]
)
def test_the_second_look_withdraws_a_gain(monkeypatch, smallest, pole, words):
    """The check after the solve is a real one: what it finds decides, and is said."""

    def found(A, B, K, R, tolerance):
        values, poles = np.ones(len(A)), -np.ones((len(A), 5), dtype=complex)
        values[3], poles[3, 2] = smallest, pole
        return ReturnDifference(values, poles)

    monkeypatch.setattr(design.lqr.synthesis, "return_difference", found)
    model, controller = example("wind_tunnel")
    result = design_lqr(model, controller)
    assert result.outcomes.codes[0, 3] == Outcome.NOT_CERTIFIED
    assert words in result.outcomes.reasons[0, 3]
    assert result.outcomes.ok.sum() == 7
    assert_only_ok_points_carry_numbers(result)
    if smallest < 1.0:
        # With a cross term Kalman's inequality need not hold, and is only reported.
        weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
        crossed = ExplicitWeights(weights.Q, weights.R, np.zeros((5, 2)))
        assert design_lqr(model, LqrController("n", crossed)).outcomes.ok.all()
