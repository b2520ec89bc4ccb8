"""Linear-quadratic regulators with published gains, in continuous and in discrete time."""

import numpy as np
import pytest

from design.lqr.discrete_riccati import solve_discrete_riccati
from design.lqr.riccati import solve_riccati
from design.lqr.sampled_cost import sampled_regulator

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


def test_mathworks_care():
    """MathWorks, Control System Toolbox reference page of `care`; R package `control` 0.2.5, with more digits."""
    solution = solve([[-3, 2], [1, 1]], [[0], [1]], [[1, -1], [-1, 1]], 3.0)
    np.testing.assert_allclose(solution.K, [[0.6071916, 2.939613]], atol=5.1e-7)
    np.testing.assert_allclose(solution.X, [[0.5895174, 1.8215747], [1.8215747, 8.818840]], atol=5.1e-7)
    assert solution.largest_real_part == pytest.approx(-1.436984, abs=5e-7)


def test_altair_care():
    """Altair Compose reference guide, `care`."""
    C = np.array([[5, -0.5]])
    solution = solve([[-15, 1], [0.5, 5]], [[0], [5]], C.T @ C, 1.5)
    np.testing.assert_allclose(solution.K, [[-0.22552, 2.03752]], atol=5e-6)
    np.testing.assert_allclose(solution.X, [[0.82854, -0.06766], [-0.06766, 0.61126]], atol=5e-6)
    assert solution.largest_real_part == pytest.approx(-5.02446, abs=5e-6)


def pendulum():
    """Inverted pendulum on a cart of the Control Tutorials for MATLAB and Simulink (University of Michigan)."""
    M, m, b, inertia, g, length = 0.5, 0.2, 0.1, 0.006, 9.8, 0.3
    p = inertia * (M + m) + M * m * length**2
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1, 1:3] = -(inertia + m * length**2) * b / p, m**2 * g * length**2 / p
    A[3, 1:3] = -m * length * b / p, m * g * length * (M + m) / p
    return A, np.array([[0.0], [(inertia + m * length**2) / p], [0.0], [m * length / p]])


@pytest.mark.parametrize(
    ("weights", "K"),
    [
        ((1, 1), [[-1.0000, -1.6567, 18.6854, 3.4594]]),
        ((5000, 100), [[-70.7107, -37.8345, 105.5298, 20.9238]]),
    ],
)
def test_pendulum(weights, K):
    """Control Tutorials for MATLAB and Simulink, "Inverted Pendulum: State-Space Methods for Controller Design"."""
    solution = solve(*pendulum(), np.diag([weights[0], 0, weights[1], 0]))
    np.testing.assert_allclose(solution.K, K, atol=5.1e-5)


# In discrete time.


def solve_discrete(A, B, Q, R=1.0):
    matrices = (np.atleast_2d(np.asarray(m, dtype=float)) for m in (A, B, Q, R))
    solution = solve_discrete_riccati(*matrices)
    assert solution.certified
    return solution


@pytest.mark.parametrize(
    ("weights", "K"),
    [
        ((1, 1), [[-0.9384, -1.5656, 18.0351, 3.3368]]),
        ((5000, 100), [[-61.9933, -33.5040, 95.0597, 18.8300]]),
    ],
)
def test_sampled_pendulum(weights, K):
    """Control Tutorials for MATLAB and Simulink, "Inverted Pendulum: Digital Controller Design", 100 Hz."""
    A, B = pendulum()
    s = sampled_regulator(A, B, np.eye(4), np.eye(1), None, 0.01)
    solution = solve_discrete(s.A, s.B, np.diag([weights[0], 0, weights[1], 0]))
    np.testing.assert_allclose(solution.K, K, atol=5.1e-5)


def test_mathworks_idare():
    """MathWorks, Control System Toolbox reference pages of `dare` and `idare`."""
    solution = solve_discrete([[-0.9, -0.3], [0.7, 0.1]], [[1], [1]], np.diag([1, 3]), 0.1)
    np.testing.assert_allclose(solution.K, [[-0.2216, -0.1297]], atol=5e-5)
    np.testing.assert_allclose(solution.X, [[4.7687, 0.9438], [0.9438, 3.2369]], atol=5e-5)
    assert solution.spectral_radius == pytest.approx(0.4460, abs=5e-5)


def test_octave_dare():
    """GNU Octave, control package, the example of `dare` in its test suite."""
    C = np.array([[1, -1]])
    solution = solve_discrete([[0.4, 1.7], [0.9, 3.8]], [[0.8], [2.1]], C.T @ C, 3.0)
    np.testing.assert_allclose(solution.K, [[0.4092, 1.7283]], atol=5e-5)
    np.testing.assert_allclose(solution.X, [[1.5354, 1.2623], [1.2623, 10.5596]], atol=5e-5)
    assert solution.spectral_radius == pytest.approx(0.2454, abs=5e-5)


def test_altair_dare():
    """Altair Compose reference guide, `dare`."""
    C = np.array([[10, -1]])
    solution = solve_discrete([[4.0, 1.7], [0.9, 38]], [[8], [21]], C.T @ C, 3.0)
    np.testing.assert_allclose(solution.K, [[-0.01271, 2.00364]], atol=5e-6)
    X = [[1704.70115, -5616.08147], [-5616.08147, 19597.56409]]
    np.testing.assert_allclose(solution.X, X, atol=5.1e-6)
    assert solution.spectral_radius == pytest.approx(0.02222, abs=5e-6)


def test_altair_dlqr():
    """Altair Compose reference guide, `dlqr`."""
    solution = solve_discrete([[9, 0.2], [0, 8]], [[0], [1]], [[2, 1], [1, 2]])
    np.testing.assert_allclose(solution.K, [[394.61003, 16.76761]], atol=5.1e-6)
    np.testing.assert_allclose(solution.X, [[1.04036e07, 2.34349e05], [2.34349e05, 5.34387e03]], rtol=5e-6)
    assert solution.spectral_radius == pytest.approx(0.12166, abs=5e-6)
