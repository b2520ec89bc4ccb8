"""The characteristic function as a sum of polynomials and exponentials, against the determinant itself."""

import numpy as np
import pytest

from design.delay.characteristic import characteristic, finite_points
from tests.design.delay.delayed_loops import determinant, loop, random_loops, scalar


@pytest.mark.parametrize("delay", [(0.7,), (0.0, 0.7), (0.3, 0.3), (0.2, 0.9), (0.0, 0.0)])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_value_is_the_determinant(n, delay):
    loops = random_loops(6, n, delay, seed=n)
    f = characteristic(loops, np.ones(6, dtype=bool))
    rng = np.random.default_rng(0)
    for i in range(6):
        s = rng.standard_normal(50) + 1j * rng.standard_normal(50) * 3.0
        ours = f.value(np.full(50, i), s / f.scale[i]) * f.scale[i] ** n
        size = np.linalg.norm(loops.A[i]) ** n + np.abs(s) ** n
        np.testing.assert_allclose(ours / size, determinant(loops.take(i), s) / size, rtol=0.0, atol=1e-13 * np.e**3)


def test_inputs_of_one_delay_share_their_terms():
    points = np.ones(2, dtype=bool)
    assert characteristic(random_loops(2, 3, (0.3, 0.3), 1), points).delays.shape == (2, 3)
    assert characteristic(random_loops(2, 3, (0.3, 0.4), 1), points).delays.shape == (2, 4)
    assert characteristic(random_loops(2, 3, (0.3, 0.0), 1), points).delays.shape == (2, 2)


def test_newtons_step_is_that_of_the_determinant():
    loops = random_loops(1, 4, (0.4, 0.9), seed=3)
    f = characteristic(loops, np.ones(1, dtype=bool))
    s, h = np.array([0.3 + 1.7j, -0.8 + 0.1j, 2.0]), 1e-6
    scale = f.scale[0]
    ours = f.correction(np.zeros(3, dtype=int), s / scale) * scale
    slope = (determinant(loops.take(0), s + h) - determinant(loops.take(0), s - h)) / (2.0 * h)
    np.testing.assert_allclose(ours, determinant(loops.take(0), s) / slope, rtol=1e-7)


def test_cancelled_coefficients_are_exactly_zero():
    """A chain of integrators: p_1 is a constant, in any coordinates."""
    T = np.linalg.qr(np.random.default_rng(1).standard_normal((4, 4)))[0]
    A, b, k = np.diag([1.0, 1.0, 1.0], 1), np.eye(4)[:, 3:], np.array([[1.0, 0.0, 0.0, 0.0]])
    A[3] = [0.0, -6.0, -11.0, -6.0]
    f = characteristic(loop(T.T @ A @ T, T.T @ b, k @ T, (0.1,)), np.array(True))
    assert np.all(f.coefficients[0, 1, :-1] == 0.0)
    assert f.coefficients[0, 1, -1] * f.scale[0] ** 4 == pytest.approx(1.0, rel=1e-12)


def test_a_root_at_the_origin_needs_no_step():
    f = characteristic(loop(np.zeros((1, 1)), np.ones((1, 1)), np.zeros((1, 1)), (1.0,)), np.array(True))
    assert f.correction(np.array([0]), np.array([0j])) == 0.0


def test_points_that_are_not_finite_and_delays_that_cannot_be():
    loops = scalar([1.0, np.nan, np.inf], 0.1)
    np.testing.assert_array_equal(finite_points(loops), [True, False, False])
    for delay in (-0.1, np.inf, np.nan):
        with pytest.raises(ValueError, match="delay of tab"):
            finite_points(scalar(1.0, delay))
