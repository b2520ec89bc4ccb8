"""Linear-quadratic regulators with published gains or a solution in closed form."""

import numpy as np
import pytest

from design.lqr.riccati import solve_riccati

# Every matrix below is A, B, Q, R; expected numbers to half a unit of their last printed digit.


def solve(A, B, Q, R=1.0):
    matrices = (np.atleast_2d(np.asarray(m, dtype=float)) for m in (A, B, Q, R))
    solution = solve_riccati(*matrices)
    assert solution.certified
    return solution


@pytest.mark.parametrize(("position", "rate"), [(1.0, 0.0), (1.0, 1.0), (1e4, 1e-4), (1e-6, 1e6)])
def test_double_integrator(position, rate):
    """x'' = u: K = [sqrt(q1), sqrt(q2 + 2 sqrt(q1))]; Athans & Falb, Optimal Control (1966), for q = (1, 0)."""
    solution = solve([[0, 1], [0, 0]], [[0], [1]], np.diag([position, rate]))
    k1, k2 = np.sqrt(position), np.sqrt(rate + 2.0 * np.sqrt(position))
    np.testing.assert_allclose(solution.K, [[k1, k2]], rtol=1e-12)
    np.testing.assert_allclose(solution.X, [[k1 * k2, k1], [k1, k2]], rtol=1e-12)


def test_mathworks_inverted_pendulum():
    """MathWorks, Control System Toolbox reference page of `lqr`: inverted pendulum on a cart."""
    A = [[0, 1, 0, 0], [0, -0.1, 3, 0], [0, 0, 0, 1], [0, -0.5, 30, 0]]
    solution = solve(A, [[0], [2], [0], [5]], np.diag([1, 0, 1, 0]))
    np.testing.assert_allclose(solution.K, [[-1.0000, -1.7559, 16.9145, 3.2274]], atol=5e-5)
    S = [
        [1.5346, 1.2127, -3.2274, -0.6851],
        [1.2127, 1.5321, -4.5626, -0.9640],
        [-3.2274, -4.5626, 26.5487, 5.2079],
        [-0.6851, -0.9640, 5.2079, 1.0311],
    ]
    np.testing.assert_allclose(solution.X, S, atol=5.1e-5)
    # Closed-loop poles -0.8684 +- 0.8523i and -5.4941 +- 0.4564i.
    assert solution.largest_real_part == pytest.approx(-0.8684, abs=5e-5)


@pytest.mark.parametrize(
    ("p", "K", "digit"),
    [
        (2.0, [[-0.50335, 52.86451, 1.41421]], 5e-6),
        (50.0, [[-0.6435, 169.6950, 7.0711]], 5.1e-5),
    ],
)
def test_aircraft_pitch(p, K, digit):
    """Pitch of an aircraft, Q = p C'C.

    p = 2: Altair Compose reference guide, `lqr`. p = 50: Control Tutorials for MATLAB and Simulink, "Aircraft
    Pitch: State-Space Methods for Controller Design".
    """
    A = [[-0.313, 56.7, 0], [-0.0139, -0.426, 0], [0, 56.7, 0]]
    solution = solve(A, [[0.232], [0.0203], [0]], np.diag([0, 0, p]))
    np.testing.assert_allclose(solution.K, K, atol=digit)
    if p == 2.0:
        X = [[1.41413, -40.95711, -1.66409], [-40.95711, 3072.24438, 88.68382], [-1.66409, 88.68382, 3.64894]]
        np.testing.assert_allclose(solution.X, X, atol=5.1e-6)


def test_altair_second_order():
    """Altair Compose reference guide, `lqr`, first example: the gain on one state is zero."""
    solution = solve([[0.8, 0], [0.8, 1]], [[0.6], [0.6]], np.diag([0, 1]))
    np.testing.assert_allclose(solution.K, [[0.0, 6.16228]], atol=5e-6)
    np.testing.assert_allclose(solution.X, [[8.21637, -8.21637], [-8.21637, 18.48683]], atol=5e-6)
    assert solution.largest_real_part == pytest.approx(-0.63246, abs=5e-6)


# Benner, Laub, Mehrmann, "A collection of benchmark examples for the numerical solution of algebraic Riccati
# equations I: continuous-time case", TU Chemnitz-Zwickau, SPC 95-22 (1995): examples 1, 2, 7, 9 and 10.


def test_carex_1():
    solution = solve([[0, 1], [0, 0]], [[0], [1]], np.diag([1, 2]))
    np.testing.assert_allclose(solution.X, [[2, 1], [1, 2]], rtol=1e-13)


def test_carex_2_has_a_singular_solution():
    """One mode is stable and unobserved: X is singular, and right."""
    solution = solve([[4, 3], [-4.5, -3.5]], [[1], [-1]], [[9, 6], [6, 4]])
    np.testing.assert_allclose(solution.X, (1 + np.sqrt(2)) * np.array([[9, 6], [6, 4]]), rtol=1e-12)
    assert solution.largest_real_part == pytest.approx(-0.5, rel=1e-12)


@pytest.mark.parametrize("eps", [1.0, 1e-3, 1e-6])
def test_carex_7_an_unstable_mode_hardly_reached(eps):
    solution = solve(np.diag([1, -2]), [[eps], [0]], np.ones((2, 2)))
    root = np.sqrt(1 + eps**2)
    x11, x12 = (1 + root) / eps**2, 1 / (2 + root)
    x22 = 0.25 * (1 - eps**2 * x12**2)
    np.testing.assert_allclose(solution.X, [[x11, x12], [x12, x22]], rtol=1e-9)


@pytest.mark.parametrize("eps", [1e-6, 1e-2, 1.0, 1e2, 1e6])
def test_carex_9_states_decades_apart(eps):
    solution = solve([[0, eps], [0, 0]], [[0], [1]], np.eye(2))
    root = np.sqrt(1 + 2 * eps)
    np.testing.assert_allclose(solution.X, [[root / eps, 1], [1, root]], rtol=1e-10)


@pytest.mark.parametrize("eps", [1.0, 1e-3, 1e-5])
def test_carex_10_poles_of_the_hamiltonian_near_the_axis(eps):
    e = eps + 1
    solution = solve([[e, 1], [1, e]], np.eye(2), eps**2 * np.eye(2), np.eye(2))
    x11 = 0.5 * (2 * e + np.sqrt(2 * e**2 + 2) + np.sqrt(2) * eps)
    x12 = x11 / (x11 - e)
    np.testing.assert_allclose(solution.X, [[x11, x12], [x12, x11]], rtol=1e-9)
