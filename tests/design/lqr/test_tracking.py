from dataclasses import replace

import control as ct
import numpy as np
import pytest

from design.lqr.structures import Structure
from design.lqr.tracking import augment_with_integral, feed_forward, holding_torques, steady_state
from model.actuators import Actuator
from tests.design.lqr_cases import EXAMPLES, example

LAGS = (300.0, 180.0)
STRUCTURES = {
    "regulator": Structure("none"),
    "aileron": Structure("aileron"),
    "both": Structure("aileron_and_tab"),
    "lagged": Structure("aileron_and_tab", *(Actuator(torque_loop_bandwidth=w) for w in LAGS)),
    "delayed": Structure(
        "aileron", Actuator(torque_loop_bandwidth=300.0, delay=0.004), Actuator(delay=0.01), delay_states=3
    ),
}


def test_integral_of_the_error_is_one_more_state():
    model, _ = example("wind_tunnel")
    plant = augment_with_integral(model)
    assert plant.states == ("dt", "dt_rate", "da", "da_rate", "int_a")
    assert plant.A.shape == (2, 4, 5, 5)
    np.testing.assert_array_equal(plant.A[..., :4, :4], model.A)
    np.testing.assert_array_equal(plant.B[..., :4, :], model.B)
    np.testing.assert_array_equal(plant.T, plant.B)
    # int_a' = r_a - da
    x, r = np.array([0.1, 0.2, 0.3, 0.4, 0.5]), 0.7
    derivative = plant.A @ x + plant.E[..., 0] * r
    np.testing.assert_allclose(derivative[..., 4], 0.7 - 0.3, rtol=1e-14)
    np.testing.assert_allclose(derivative[..., :4], model.A @ x[:4], rtol=1e-13)


def test_two_integrals_of_two_errors():
    plant = augment_with_integral(example("wind_tunnel")[0], STRUCTURES["both"])
    x, r = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]), np.array([0.7, 0.9])
    derivative = plant.A @ x + plant.E @ r
    np.testing.assert_allclose(derivative[..., 4:], np.broadcast_to([0.7 - 0.3, 0.9 - 0.1], (2, 4, 2)), rtol=1e-14)


def test_a_regulator_is_the_model_alone():
    model, _ = example("wind_tunnel")
    plant = augment_with_integral(model, STRUCTURES["regulator"])
    np.testing.assert_array_equal(plant.A, model.A)
    np.testing.assert_array_equal(plant.B, model.B)
    assert plant.E.shape == (2, 4, 4, 0)


def torque_transfer(drive):
    """From command to torque, by python-control: lag and Pade approximant of one zero less than poles."""
    chain = ct.tf(*ct.pade(drive.delay, drive.delay_states, drive.delay_states - 1)) if drive.delay_states else 1.0
    return chain * (ct.tf([drive.bandwidth], [1.0, drive.bandwidth]) if drive.bandwidth else 1.0)


@pytest.mark.parametrize("structure", [STRUCTURES["lagged"], STRUCTURES["delayed"]], ids=["lagged", "delayed"])
def test_torques_come_about_as_python_control_has_it(structure):
    """Frequency responses from both commands to all states of the model, drives in series with the model."""
    model, _ = example("wind_tunnel")
    plant, index = augment_with_integral(model, structure).take((1, 2)), (1, 2)
    drives = ct.append(*(ct.ss(torque_transfer(drive)) for drive in structure.drives))
    series = ct.ss(model.A[index], model.B[index], np.eye(4), 0) * drives
    ours = ct.ss(plant.A, plant.B, np.eye(len(plant.states))[:4], 0)
    omega = np.geomspace(0.3, 3e3, 40)
    theirs = series(1j * omega)
    assert np.all(np.abs(ours(1j * omega) - theirs) <= 1e-7 * np.abs(theirs).max(axis=1, keepdims=True))
    # A torque beside those of the actuators passes no drive.
    np.testing.assert_array_equal(plant.T[:4], model.B[index])


@pytest.mark.parametrize("name", EXAMPLES)
def test_steady_state_balances_the_hinge_moments(name):
    """By the stiffness of the equation of motion, not by the state matrices: T = -Kk d, with T_a = 0."""
    model, _ = example(name)
    rest = steady_state(model)
    assert rest.attainable.all()
    assert (rest.reasons == None).all()  # noqa: E711, elementwise
    angles = rest.N_x[..., 0:4:2, :]
    torque = -model.stiffness @ angles
    np.testing.assert_allclose(rest.N_x[..., 2, 0], 1.0, rtol=1e-12)
    np.testing.assert_array_equal(rest.N_x[..., 4, 0], 0.0)
    np.testing.assert_allclose(rest.N_x[..., [1, 3], 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(rest.N_x[..., 0, 0], -model.stiffness[..., 1, 1] / model.stiffness[..., 1, 0], rtol=1e-9)
    np.testing.assert_allclose(rest.N_u[..., 0, 0], torque[..., 0, 0], rtol=1e-9)
    np.testing.assert_allclose(rest.N_u[..., 1, 0], 0.0, atol=1e-9 * np.abs(torque).max())


def test_holding_torques_are_the_static_stiffness(unsteady_a):
    """Lag states settle at what resting surfaces are worth, and the torques are those of the static stiffness."""
    states, torques = holding_torques(unsteady_a.model)
    np.testing.assert_allclose(torques, -unsteady_a.model.static_stiffness, rtol=1e-9)
    worth = np.array(unsteady_a.system.circulatory_angles)
    np.testing.assert_allclose(states[..., 4, :], np.broadcast_to(worth, (2, 4, 2)), rtol=1e-9)


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=STRUCTURES)
def test_the_steady_state_stays(structure, unsteady_a):
    """Nothing moves there but what integrates nothing; the angles are the references'."""
    for model in (example("wind_tunnel_23012")[0], unsteady_a.model):
        plant, rest = augment_with_integral(model, structure), steady_state(model, structure=structure)
        p = len(structure.references)
        assert rest.N_x.shape == (2, 4, len(plant.states), p)
        assert rest.N_u.shape == (2, 4, 2, p)
        size = np.abs(plant.A) @ np.abs(rest.N_x) + np.abs(plant.B) @ np.abs(rest.N_u)
        change = plant.A @ rest.N_x + plant.B @ rest.N_u + plant.E
        assert np.all(np.abs(change) <= 1e-12 * size.max(initial=0.0))
        both = rest.N_x[..., [2, 0][:p], :]
        np.testing.assert_allclose(both, np.broadcast_to(np.eye(p), both.shape), rtol=1e-12, atol=1e-15)


def test_data_set_a_floats_at_the_inverse_of_the_servo_tab_gain():
    """Servo-tab DC gain da/dt = -1.197145056 at data set A (seed 2.3.30, corrected sign): dt = da / gain."""
    rest = steady_state(example("wind_tunnel")[0])
    np.testing.assert_allclose(rest.N_x[..., 0, 0], 1.0 / -1.197145056, rtol=1e-9)


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=STRUCTURES)
def test_grid_equals_points(structure):
    model, _ = example("wind_tunnel_23012")
    plant, rest = augment_with_integral(model, structure), steady_state(model, structure=structure)
    K = np.random.default_rng(0).normal(size=(2, 4, 2, len(plant.states)))
    for index in np.ndindex(2, 4):
        point = model.take(index)
        for name in "ABET":
            np.testing.assert_array_equal(
                getattr(plant.take(index), name), getattr(augment_with_integral(point, structure), name)
            )
        alone = steady_state(point, structure=structure)
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
    assert all("no authority" in reason for reason in rest.reasons[~expected])
    np.testing.assert_allclose(rest.N_x[expected], steady_state(model).N_x[expected], rtol=1e-12, atol=1e-14)
    # Both angles given: any tab will do, only numbers must be finite.
    both = steady_state(replace(model, A=A), structure=STRUCTURES["both"])
    assert np.count_nonzero(~both.attainable) == 1


@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=STRUCTURES)
def test_any_gain_meets_the_references_without_its_integrals(structure):
    """Rest of x' = A x + B u with u = -K x + N r is x = N_x r, integrals at zero, for any K."""
    model, _ = example("wind_tunnel")
    plant, rest = augment_with_integral(model, structure), steady_state(model, structure=structure)
    K = np.random.default_rng(3).normal(size=plant.B.mT.shape)
    N = feed_forward(K, rest)
    change = plant.A @ rest.N_x + plant.E + plant.B @ (N - K @ rest.N_x)
    size = np.abs(plant.B) @ np.abs(N) + np.abs(plant.A) @ np.abs(rest.N_x)
    assert np.all(np.abs(change) <= 1e-12 * size.max(initial=0.0))
    # With the integrators switched off the angles end where they are told, if they end.
    kept = [i for i, name in enumerate(plant.states) if name not in structure.integrals]
    A, B, held = plant.A[..., np.ix_(kept, kept)[0], np.ix_(kept, kept)[1]], plant.B[..., kept, :], K[..., kept]
    state = np.linalg.solve(A - B @ held, -B @ N)
    np.testing.assert_allclose(state, rest.N_x[..., kept, :], atol=1e-8)
