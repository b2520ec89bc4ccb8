import numpy as np
import pytest

from model import examples
from model.flight import flight_condition
from model.linearise import linearise
from model.nondimensional import aerodynamic_time, nondimensional, servo_time
from model.servo_tab import servo_tab
from model.trim import trim

REQUEST = examples.WIND_TUNNEL_TRIM


def model_of(system, condition):
    return linearise(system, condition, trim(system, condition, REQUEST))


def in_chords(system, condition):
    return nondimensional(
        model_of(system, condition), aerodynamic_time(system, condition), system.hinge_load(condition)
    )


def test_eigenvalues_are_the_old_ones_times_the_time_unit(example, grid):
    model = model_of(example, grid.condition)
    time = np.linspace(0.01, 3.0, 4)
    found = nondimensional(model, time, np.array(2.0))
    expected = np.sort_complex(np.linalg.eigvals(model.A) * time[:, None])
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(found.A)), expected, rtol=1e-9)
    assert found.time_unit.shape == found.torque_unit.shape == grid.shape
    assert (found.states, found.inputs) == (model.states, model.inputs)


def test_equations_are_those_of_the_model_in_other_units(tunnel_condition):
    model = model_of(examples.wind_tunnel(), tunnel_condition)
    time, torque = 0.02, 5.0
    found = nondimensional(model, np.array(time), np.array(torque))
    units = np.array([1.0, time, 1.0, time])
    x, u = np.array([0.1, -2.0, 0.05, 3.0]), np.array([0.2, -0.4])
    physical = model.A @ x + model.B @ u
    np.testing.assert_allclose(found.A @ (units * x) + found.B @ (u / torque), time * units * physical, rtol=1e-12)


@pytest.mark.parametrize("damping", ["thesis", "quasi_steady", "unsteady"])
def test_in_chords_of_air_only_density_is_left(variant, damping):
    system = variant(examples.wind_tunnel(), damping=damping, virtual_inertia=True)
    same_air = in_chords(system, flight_condition(3000.0, "airspeed", np.array([10.0, 50.0, 200.0])))
    np.testing.assert_allclose(same_air.A, np.broadcast_to(same_air.A[0], same_air.A.shape), rtol=1e-11)
    np.testing.assert_allclose(same_air.B, np.broadcast_to(same_air.B[0], same_air.B.shape), rtol=1e-11)
    other_air = in_chords(system, flight_condition(np.array([0.0, 9000.0]), "airspeed", 50.0))
    assert np.max(np.abs(other_air.A[0] - other_air.A[1])) > 0.1 * np.max(np.abs(other_air.A))


def test_in_chords_of_air_the_matrices_are_coefficients_over_mass_ratios(tunnel_condition):
    system = examples.wind_tunnel_23012()
    found = in_chords(system, tunnel_condition)
    mass_ratio = system.inertia_matrix / (0.5 * 1.225 * 0.6**4 * 0.8)
    K = system.aerodynamics.source.gradient[:, 1:]
    np.testing.assert_allclose(found.A[1::2, 0::2], -np.linalg.solve(mass_ratio, K), rtol=1e-10)
    np.testing.assert_allclose(found.B[1::2], np.linalg.inv(mass_ratio), rtol=1e-10)


def test_in_periods_of_the_servo_tab_its_stiffness_is_one_and_its_damping_two_zeta(example, grid):
    model = model_of(example, grid.condition)
    servo = servo_tab(model)
    time = servo_time(servo)
    np.testing.assert_allclose(-(time**2) * servo.F[..., 1, 0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(-time * servo.F[..., 1, 1], 2.0 * servo.damping_ratio, rtol=1e-12)


def test_batched_equals_single(example, grid):
    batch = in_chords(example, grid.condition)
    for index in ((0, 0), (3, 2)):
        single = in_chords(example, grid.condition.take(index))
        np.testing.assert_allclose(batch.A[index], single.A, rtol=1e-12)
        np.testing.assert_allclose(batch.B[index], single.B, rtol=1e-12)
