from dataclasses import replace

import control as ct
import numpy as np
import pytest

from design.lqr.cost import cost_of
from design.lqr.output_weights import OutputWeights, output_map
from design.lqr.structures import Structure
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.tracking import augment_with_integral
from design.lqr.weights import ExplicitWeights, WeightsRefused, weight_matrices
from model.actuators import Actuator
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

LAGGED = Actuator(torque_loop_bandwidth=250.0)
STATES = ("dt", "dt_rate", "da", "da_rate", "int_a")


def test_states_and_commands_as_outputs_are_brysons_rule():
    model, controller = example("wind_tunnel")
    given = weight_matrices(WIND_TUNNEL_WEIGHTS)
    weights = OutputWeights(STATES, given.Q, given.R)
    ours, theirs = design_lqr(model, replace(controller, weights=weights)), design_lqr(model, controller)
    np.testing.assert_allclose(ours.K, theirs.K, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ours.return_difference_min, theirs.return_difference_min, rtol=1e-9)
    # The error weighs as the angle does, and a command as its own weight.
    outputs = ("dt", "dt_rate", "da_error", "da_rate", "int_a", "T_t_command", "T_a")
    whole = np.zeros((7, 7))
    whole[:5, :5], whole[5:, 5:] = given.Q, 0.25 * given.R
    again = design_lqr(model, replace(controller, weights=OutputWeights(outputs, whole, 0.75 * given.R)))
    np.testing.assert_allclose(again.K, theirs.K, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("tab", [Actuator(), LAGGED], ids=["ideal", "lagged"])
def test_accelerations_bring_a_cross_term_and_python_control_agrees(tab):
    """Weighing da'' and dt'' makes Q, R and N differ from point to point; ct.lqr takes them as they are."""
    model, controller = example("wind_tunnel_23012")
    outputs = (*STATES, "da_acceleration", "dt_acceleration", "T_t")
    random = np.random.default_rng(5)
    W_y = np.diag(1.0 / np.array([0.17, 7.0, 0.035, 3.5, 0.0017, 4e3, 2e4, 3.0])) ** 2
    mix = np.eye(8) + 0.1 * random.normal(size=(8, 8))
    W_y, W_u = mix.T @ W_y @ mix, np.array([[4.0, 0.1], [0.1, 0.3]])
    design = design_lqr(model, replace(controller, weights=OutputWeights(outputs, W_y, W_u)), tab=tab)
    assert design.outcomes.ok.all()
    plant = augment_with_integral(model, design.structure)
    for index in np.ndindex(2, 4):
        A, B = plant.A[index], plant.B[index]
        n = len(A)
        C, D = np.zeros((8, n)), np.zeros((8, 2))
        C[:5, :5] = np.eye(5)
        C[5:7], D[5:7] = A[[3, 1]], B[[3, 1]]
        if tab is LAGGED:
            C[7, 5] = 1.0
        else:
            D[7, 0] = 1.0
        Q, R, N = C.T @ W_y @ C, W_u + D.T @ W_y @ D, C.T @ W_y @ D
        K, _, _ = ct.lqr(A, B, 0.5 * (Q + Q.T), 0.5 * (R + R.T), N, method="scipy")
        np.testing.assert_allclose(design.K[index], K, rtol=1e-6, atol=1e-6 * np.abs(K).max())
    # Reported, not imposed: with a cross term Kalman's inequality need not hold.
    assert np.isfinite(design.return_difference_min).all()


def test_the_return_difference_does_not_depend_on_how_weights_are_written():
    """R with the grid's axes and R without them give the same smallest singular value."""
    model, controller = example("wind_tunnel")
    given = weight_matrices(WIND_TUNNEL_WEIGHTS)
    R = np.array([[5.0, 0.6], [0.6, 0.3]])
    plain = design_lqr(model, replace(controller, weights=ExplicitWeights(given.Q, R)))
    by_outputs = design_lqr(model, replace(controller, weights=OutputWeights(STATES, given.Q, R)))
    np.testing.assert_allclose(by_outputs.return_difference_min, plain.return_difference_min, rtol=1e-9)


def test_the_torque_behind_what_lags_it():
    model, _ = example("wind_tunnel")
    tab, aileron = Actuator(torque_loop_bandwidth=250.0, delay=0.004), Actuator(delay=0.006)
    plant = augment_with_integral(model, Structure("none", tab, aileron, delay_states=4))
    seen = output_map(("T_t", "T_a", "T_t_command", "dt_rate"), plant)
    x = np.random.default_rng(0).normal(size=len(plant.states))
    at = plant.states.index
    # What drives the surfaces is the torque, whatever comes before it.
    drive = plant.A @ x - plant.A[..., :4] @ x[:4]
    torque = (seen.C @ x)[..., :2]
    np.testing.assert_allclose(
        drive[..., [1, 3]], np.einsum("...ij,...j->...i", model.B[..., [1, 3], :], torque), rtol=1e-9
    )
    np.testing.assert_array_equal(seen.D[..., :2, :], 0.0)
    np.testing.assert_array_equal(seen.C[..., 2, :], 0.0)
    np.testing.assert_array_equal(seen.D[0, 0, 2], [1.0, 0.0])
    assert seen.C[0, 0, 3, at("dt_rate")] == 1.0


@pytest.mark.parametrize(
    ("outputs", "W_y", "W_u", "matrix", "eigenvalue", "words"),
    [
        (("da", "lift"), np.eye(2), np.eye(2), "W_y", None, "no output 'lift' .* T_t_command"),
        (("da", "dt_error"), np.eye(2), np.eye(2), "W_y", None, "no output 'dt_error'"),
        (("da", "dt"), np.eye(3), np.eye(2), "W_y", None, r"expected \(2, 2\), over the outputs da dt"),
        (("da", "dt"), np.diag([1.0, -2.0]), np.eye(2), "W_y", -2.0, "W_y is not positive semidefinite"),
        (("da", "dt"), np.eye(2) + np.eye(2, k=1), np.eye(2), "W_y", None, "W_y is not symmetric"),
        (("da", "dt"), np.diag([1.0, np.nan]), np.eye(2), "W_y", None, "not finite"),
        (("da", "dt"), np.eye(2), np.diag([1.0, 0.0]), "W_u", 0.0, "W_u is not positive definite"),
        (("da", "dt"), np.eye(2), np.eye(3), "W_u", None, "W_u has shape"),
        (("da", "dt"), np.eye(2), np.eye(2), "Q", 0.0, "does not see the mode at 0 1/s"),
    ],
)
def test_output_weights_that_cannot_work_are_refused(outputs, W_y, W_u, matrix, eigenvalue, words):
    model, _ = example("wind_tunnel")
    with pytest.raises(WeightsRefused, match=words) as refused:
        design_lqr(model, LqrController("bad", OutputWeights(outputs, W_y, W_u)))
    assert refused.value.matrix == matrix
    if eigenvalue is None:
        assert refused.value.eigenvalue is None
    else:
        assert refused.value.eigenvalue == pytest.approx(eigenvalue, abs=1e-9)


def test_a_point_without_numbers_does_not_touch_the_weights_of_the_others():
    model, controller = example("wind_tunnel")
    weights = OutputWeights((*STATES, "da_acceleration"), np.diag([30.0, 0.02, 800.0, 0.08, 3e5, 1e-7]), np.eye(2))
    A = model.A.copy()
    A[1, 1] = np.nan
    asked = replace(controller, weights=weights)
    whole, damaged = design_lqr(model, asked), design_lqr(replace(model, A=A), asked)
    assert damaged.outcomes.ok.sum() == 7
    np.testing.assert_array_equal(damaged.K[0], whole.K[0])
    cost = cost_of(weights, augment_with_integral(model))
    assert cost.Q.shape == (2, 4, 5, 5)
    single = design_lqr(model.take((0, 3)), asked)
    np.testing.assert_allclose(single.K, whole.K[0, 3], rtol=1e-12)
