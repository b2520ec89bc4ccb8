from dataclasses import replace

import numpy as np
import pytest

from design.lqr.tracking import augment_with_integral, feed_forward, steady_state
from tests.design.lqr_cases import EXAMPLES, example


def test_integral_of_the_error_is_one_more_state():
    model, _ = example("wind_tunnel")
    plant = augment_with_integral(model)
    assert plant.states == ("dt", "dt_rate", "da", "da_rate", "int_a")
    assert plant.A.shape == (2, 4, 5, 5)
    np.testing.assert_array_equal(plant.A[..., :4, :4], model.A)
    np.testing.assert_array_equal(plant.B[..., :4, :], model.B)
    # int_a' = r_a - da
    x, r = np.array([0.1, 0.2, 0.3, 0.4, 0.5]), 0.7
    derivative = plant.A @ x + plant.E[..., 0] * r
    np.testing.assert_allclose(derivative[..., 4], 0.7 - 0.3, rtol=1e-14)
    np.testing.assert_allclose(derivative[..., :4], model.A @ x[:4], rtol=1e-13)


@pytest.mark.parametrize("name", EXAMPLES)
def test_steady_state_balances_the_hinge_moments(name):
    """By the stiffness of the equation of motion, not by the state matrices: T = -Kk d, with T_a = 0."""
    model, _ = example(name)
    rest = steady_state(model)
    assert rest.attainable.all()
    angles = rest.N_x[..., 0::2, :]
    torque = -model.stiffness @ angles
    np.testing.assert_allclose(rest.N_x[..., 2, 0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(rest.N_x[..., 1::2, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(rest.N_x[..., 0, 0], -model.stiffness[..., 1, 1] / model.stiffness[..., 1, 0], rtol=1e-9)
    np.testing.assert_allclose(rest.N_u[..., 0, 0], torque[..., 0, 0], rtol=1e-9)
    np.testing.assert_allclose(rest.N_u[..., 1, 0], 0.0, atol=1e-9 * np.abs(torque).max())


def test_data_set_a_floats_at_the_inverse_of_the_servo_tab_gain():
    """Servo-tab DC gain da/dt = -1.197145056 at data set A (seed 2.3.30, corrected sign): dt = da / gain."""
    rest = steady_state(example("wind_tunnel")[0])
    np.testing.assert_allclose(rest.N_x[..., 0, 0], 1.0 / -1.197145056, rtol=1e-9)


def test_grid_equals_points():
    model, _ = example("wind_tunnel_23012")
    plant, rest = augment_with_integral(model), steady_state(model)
    K = np.random.default_rng(0).normal(size=(2, 4, 2, 5))
    for index in np.ndindex(2, 4):
        point = model.take(index)
        np.testing.assert_array_equal(plant.take(index).A, augment_with_integral(point).A)
        np.testing.assert_array_equal(plant.take(index).E, augment_with_integral(point).E)
        alone = steady_state(point)
        np.testing.assert_allclose(rest.take(index).N_x, alone.N_x, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(rest.take(index).N_u, alone.N_u, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(feed_forward(K, rest)[index], feed_forward(K[index], alone), rtol=1e-12)


def test_tab_without_authority_is_flagged_at_its_own_point():
    model, _ = example("wind_tunnel")
    A = model.A.copy()
    # The tab's column of the stiffness, seen through the inverse inertia, has to vanish in the aileron's row.
    stiffness = model.stiffness.copy()
    stiffness[0, 1, 1, 0] = 0.0
    stiffness[1, 2, 1, 0] *= 1e-9
    A[..., 1::2, 0::2] = np.linalg.solve(model.inertia, stiffness)
    A[0, 3] = np.nan
    rest = steady_state(replace(model, A=A, stiffness=stiffness))
    expected = np.ones((2, 4), dtype=bool)
    expected[0, 1] = expected[1, 2] = expected[0, 3] = False
    np.testing.assert_array_equal(rest.attainable, expected)
    assert np.isnan(rest.N_x[~expected]).all()
    np.testing.assert_allclose(rest.N_x[expected], steady_state(model).N_x[expected], rtol=1e-12, atol=1e-14)


def test_any_stabilising_gain_meets_the_reference_without_its_integral():
    """Rest of x' = A x + B u with u = -K [x; int] + N r is x = N_x r and int = 0, for any K."""
    model, _ = example("wind_tunnel")
    plant, rest = augment_with_integral(model), steady_state(model)
    K = np.random.default_rng(3).normal(size=(2, 4, 2, 5)) * [1.0, 0.1, 30.0, 0.5, 100.0]
    closed = plant.A - plant.B @ K
    state = np.linalg.solve(closed, -(plant.E + plant.B @ feed_forward(K, rest)))
    np.testing.assert_allclose(state[..., :4, :], rest.N_x, atol=1e-9)
    np.testing.assert_allclose(state[..., 4, 0], 0.0, atol=1e-9)


def test_unknown_allocation():
    with pytest.raises(ValueError, match="least_power"):
        steady_state(example("wind_tunnel")[0], "least_power")
