from fractions import Fraction

import numpy as np
import pytest
from scipy.signal import ss2tf

from design.frequency.transfer import markov_parameters, response, transfer
from tests.design.siso_loops import of_transfer

RNG = np.random.default_rng(3)


def exact_transfer(A, b, c):
    """Faddeev and Leverrier in rational numbers."""
    n = len(A)
    A = [[Fraction(float(x)) for x in row] for row in A]
    b, c = [Fraction(float(x)) for x in b], [Fraction(float(x)) for x in c]
    M = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    denominator, numerator = [Fraction(1)], [Fraction(0)]
    for k in range(1, n + 1):
        numerator.append(sum(c[i] * M[i][j] * b[j] for i in range(n) for j in range(n)))
        M = [[sum(A[i][m] * M[m][j] for m in range(n)) for j in range(n)] for i in range(n)]
        denominator.append(-sum(M[i][i] for i in range(n)) / k)
        for i in range(n):
            M[i][i] += denominator[-1]
    return np.array([float(x) for x in numerator]), np.array([float(x) for x in denominator])


def servo_tab_loop(speed):
    """Servo, servo-tab, rate filter and integral, in size and spread like the loops of the product."""
    w, z, f = 250.0, 0.7, 630.0
    A = np.zeros((6, 6))
    A[0, 1], A[1, 0], A[1, 1] = 1.0, -(w**2), -2 * z * w
    A[2, 3], A[3, 2], A[3, 3] = 1.0, -6002.0 * speed**2, -29.2 * speed
    A[3, 0], A[3, 1] = -7186.0 * speed**2, -0.862 * speed
    A[4, 2], A[4, 4], A[5, 2] = f, -f, -1.0
    b = np.array([0.0, w**2, 0.0, 0.0, 0.0, 0.0])
    return A, b, np.array([0.0, 0.0, -6.8, 0.0, 6.3, 5.0])


@pytest.mark.parametrize("speed", [0.4, 1.0, 1.6])
def test_coefficients_equal_exact_ones(speed):
    A, b, c = servo_tab_loop(speed)
    found = transfer(A, b, c)
    numerator, denominator = exact_transfer(A, b, c)
    np.testing.assert_allclose(found.numerator, numerator, rtol=1e-10)
    np.testing.assert_allclose(found.denominator[:-1], denominator[:-1], rtol=1e-11)
    # The integrator stands at the origin within rounding.
    assert denominator[-1] == 0.0
    assert abs(found.denominator[-1] / denominator[-2]) < 1e-14
    assert found.relative_degree == 3


def test_a_spread_of_many_decades_keeps_the_slow_end():
    """A slow integral beside a fast torque loop: powers of A would have lost the slow coefficients altogether."""
    pole = np.array([0.0, -1e-2, -0.3, -80.0, -500.0, -6e3, -1e4, -2e4])
    loop = of_transfer(np.poly([-20.0, -30.0]), np.poly(pole))
    found = transfer(loop.A, loop.b, loop.c)
    np.testing.assert_allclose(found.denominator[:-1], np.poly(pole)[:-1], rtol=1e-9)
    np.testing.assert_allclose(found.numerator[-3:], np.poly([-20.0, -30.0]), rtol=1e-6)


def test_coefficients_equal_those_of_scipy():
    A, b, c = RNG.standard_normal((5, 5)), RNG.standard_normal(5), RNG.standard_normal(5)
    numerator, denominator = ss2tf(A, b[:, None], c[None, :], np.zeros((1, 1)))
    found = transfer(A, b, c)
    np.testing.assert_allclose(found.numerator, numerator[0], rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found.denominator, denominator, rtol=1e-9, atol=1e-11)


def test_noise_is_not_taken_for_coefficients():
    """In other states, missing leading terms are only zero within rounding; integrators too."""
    A, b, c = servo_tab_loop(1.0)
    T = np.eye(6) + 0.3 * RNG.standard_normal((6, 6)) * np.exp(RNG.uniform(-2, 2, 6))
    A, b, c = np.linalg.solve(T, A @ T), np.linalg.solve(T, b), c @ T
    found, straight = transfer(A, b, c), transfer(*servo_tab_loop(1.0))
    assert np.count_nonzero(markov_parameters(A, b, c)[:3]) == 1
    assert found.relative_degree == 3
    np.testing.assert_allclose(found.denominator[:-1], straight.denominator[:-1], rtol=1e-6)
    assert abs(found.denominator[-1]) < 1e-9 * straight.denominator[-2]


def test_hidden_modes_stay():
    A = np.array([[0.0, 1.0, 0.0], [-4.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    b, c = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    found = transfer(A, b, c)
    np.testing.assert_allclose(found.denominator, [1.0, 1.0, 4.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(found.numerator, [0.0, 0.0, 1.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(found.zeros, [0.0, np.nan, np.nan], atol=1e-14)


def test_an_input_that_does_not_reach_the_output():
    found = transfer(np.diag([-1.0, -2.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    np.testing.assert_array_equal(found.numerator, np.zeros(3))
    np.testing.assert_allclose(found.denominator, [1.0, 3.0, 2.0])
    assert found.relative_degree == 3


def test_all_poles_at_the_origin():
    found = transfer(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    np.testing.assert_allclose(found.denominator, [1.0, 0.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(found.numerator, [0.0, 3.0, 2.0], rtol=1e-12)


def test_markov_parameters():
    A, b, c = RNG.standard_normal((4, 4)), RNG.standard_normal(4), RNG.standard_normal(4)
    expected = [c @ np.linalg.matrix_power(A, k) @ b for k in range(5)]
    np.testing.assert_allclose(markov_parameters(A, b, c), expected, rtol=1e-12)


def test_scaled_transfer_is_the_same_function():
    found, scale, s = transfer(*servo_tab_loop(1.0)), np.array(256.0), 3.0 + 40.0j
    scaled = found.scaled(scale)
    value = np.polyval(found.numerator, s) / np.polyval(found.denominator, s)
    np.testing.assert_allclose(
        np.polyval(scaled.numerator, s / scale) / np.polyval(scaled.denominator, s / scale), value, rtol=1e-12
    )


def test_response_and_its_derivatives():
    A, b, c = RNG.standard_normal((5, 5)), RNG.standard_normal(5), RNG.standard_normal(5)
    s, h = np.array([0.3j, 1.0 + 2.0j, 4.0 + 0.0j]), 1e-4
    at = response(A, b, c, s)
    direct = np.array([c @ np.linalg.solve(x * np.eye(5) - A, b) for x in s])
    np.testing.assert_allclose(at.value, direct, rtol=1e-11)
    up, down = response(A, b, c, s + h), response(A, b, c, s - h)
    np.testing.assert_allclose(at.slope, (up.value - down.value) / (2 * h), rtol=1e-5)
    np.testing.assert_allclose(at.curvature, (up.slope - down.slope) / (2 * h), rtol=1e-5)


def test_response_agrees_with_the_polynomials():
    A, b, c = servo_tab_loop(1.0)
    found, s = transfer(A, b, c), 1j * np.geomspace(0.1, 5e3, 30)
    ratio = np.polyval(found.numerator, s) / np.polyval(found.denominator, s)
    np.testing.assert_allclose(response(A, b, c, s).value, ratio, rtol=1e-9)


def test_response_at_a_pole_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        response(np.diag([0.0, -1.0]), np.ones(2), np.ones(2), np.array([0.0j]))


def test_grid_equals_points():
    A, b, c = RNG.standard_normal((2, 3, 4, 4)), RNG.standard_normal((2, 3, 4)), RNG.standard_normal((2, 3, 4))
    s = 1j * RNG.uniform(0.1, 3.0, (2, 3, 6))
    found, at = transfer(A, b, c), response(A, b, c, s)
    for i in np.ndindex(2, 3):
        one, here = transfer(A[i], b[i], c[i]), response(A[i], b[i], c[i], s[i])
        np.testing.assert_allclose(found.take(i).numerator, one.numerator, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(found.take(i).denominator, one.denominator, rtol=1e-10, atol=1e-12)
        for name in ("value", "slope", "curvature"):
            np.testing.assert_allclose(getattr(at.take(i), name), getattr(here, name), rtol=1e-11)
