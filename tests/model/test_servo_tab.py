from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import TrimRequest, trim

REQUEST = TrimRequest(0.08, aileron=0.1, tab=-0.05)


def model_of(system, condition):
    return linearise(system, condition, trim(system, condition, REQUEST))


def test_transfer_function_is_that_of_the_state_space(example, grid):
    servo = servo_tab(model_of(example, grid.condition))
    for s in (0.3j, 40j, -3 + 7j):
        # Seed 2.3.24 to 2.3.28: H (sI - F)^-1 (G1 + s G2).
        input_column = servo.G[..., 0] + s * servo.G[..., 1]
        expected = np.linalg.solve(s * np.eye(2) - servo.F, input_column[..., None])[..., 0, 0]
        top = servo.numerator[..., 0] * s + servo.numerator[..., 1]
        bottom = s**2 + servo.denominator[..., 1] * s + servo.denominator[..., 2]
        np.testing.assert_allclose(top / bottom, expected, rtol=1e-11)


def test_transfer_function_written_out_in_the_seeds_symbols(tunnel_condition):
    # Seed 2.3.29 with the span and both minus signs; 2.3.30 with its sign; 2.3.32 with the span.
    system = examples.wind_tunnel_23012()
    servo = servo_tab(model_of(system, tunnel_condition))
    _, by_tab, by_aileron = system.aerodynamics.source.gradient[1]
    load, V, ca, ct = 0.5 * 1.225 * 2500 * 0.36 * 0.8, 50.0, 0.18, 0.072
    I_at = system.inertia_matrix[1, 1]
    np.testing.assert_allclose(servo.numerator, [-load / I_at * ct / (4 * V) * by_tab, -load / I_at * by_tab])
    damping = load / I_at * (np.cos(-0.05) * ca / V * by_tab + ca / (4 * V) * by_aileron)
    np.testing.assert_allclose(servo.denominator, [1.0, damping, load / I_at * by_aileron])
    assert float(servo.dc_gain) == pytest.approx(-by_tab / by_aileron, rel=1e-13)
    assert float(servo.zero) == pytest.approx(-4 * V / ct, rel=1e-13)
    omega = V * 0.6 * np.sqrt(1.225 * 0.8 * by_aileron / (2 * I_at))
    assert float(servo.natural_frequency) == pytest.approx(omega, rel=1e-13)
    zeta = 0.6 * ca / 2 * np.sqrt(1.225 * 0.8 / (2 * I_at * by_aileron))
    zeta *= np.cos(-0.05) * by_tab + by_aileron / 4
    assert float(servo.damping_ratio) == pytest.approx(zeta, rel=1e-13)


def test_aileron_is_the_coupled_one_with_the_tab_held(example, grid):
    # With the tab at rest the reduction is exact but for the neglected tab acceleration: the aileron's own
    # row of J d'' = B d' + K d.
    model = model_of(example, grid.condition)
    servo = servo_tab(model)
    J = model.inertia[..., 1, 1]
    np.testing.assert_allclose(J * servo.F[..., 1, 0], model.stiffness[..., 1, 1], rtol=1e-13)
    np.testing.assert_allclose(J * servo.F[..., 1, 1], model.damping[..., 1, 1], rtol=1e-13)
    np.testing.assert_array_equal(servo.F[..., 0, :], np.broadcast_to([0.0, 1.0], (*grid.shape, 2)))
    np.testing.assert_array_equal(servo.G[..., 0, :], 0.0)


def test_servo_tab_is_stable_and_reverses(example, grid):
    servo = servo_tab(model_of(example, grid.condition))
    assert np.all(servo.dc_gain < 0)
    assert np.all(servo.damping_ratio > 0)
    assert np.all(servo.natural_frequency > 0)


def test_damping_ratio_follows_the_root_of_density_not_airspeed(grid):
    servo = servo_tab(model_of(examples.wind_tunnel(), grid.condition))
    zeta, density = servo.damping_ratio, grid.condition.air.density
    np.testing.assert_allclose(zeta / np.sqrt(density), zeta[0, 0] / np.sqrt(density[0, 0]), rtol=1e-12)


def test_what_does_not_exist_is_nan(tunnel_condition):
    model = model_of(examples.wind_tunnel(), tunnel_condition)
    damping, stiffness = model.damping.copy(), model.stiffness.copy()
    damping[1, 0] = 0.0
    stiffness[1, 1] = 0.0
    servo = servo_tab(replace(model, damping=damping, stiffness=stiffness))
    assert np.isnan(servo.zero)
    assert np.isnan(servo.dc_gain)
    assert np.isnan(servo.natural_frequency)
    assert np.isnan(servo.damping_ratio)
    stiffness[1, 1] = 5.0
    unstable = servo_tab(replace(model, stiffness=stiffness))
    assert np.isnan(unstable.natural_frequency)
    assert np.isfinite(unstable.dc_gain)


def test_batched_equals_single(example, grid):
    model = model_of(example, grid.condition)
    servo = servo_tab(model)
    names = ("F", "G", "numerator", "denominator", "dc_gain", "zero", "natural_frequency", "damping_ratio")
    for index in np.ndindex(grid.shape):
        single = servo_tab(model.take(index))
        for name in names:
            np.testing.assert_array_equal(getattr(servo.take(index), name), getattr(single, name))
