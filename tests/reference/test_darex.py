"""The benchmark collection DAREX of discrete Riccati equations, against closed forms and 60-digit solutions.

Abels and Benner, "DAREX - A Collection of Benchmark Examples for Discrete-Time Algebraic Riccati Equations
(Version 2.0)", SLICOT Working Note 1999-16 (1999), whose numbers are used here; before that Benner, Laub and
Mehrmann, "A Collection of Benchmark Examples for the Numerical Solution of Algebraic Riccati Equations II:
Discrete-Time Case", Technical Report SPC 95_23, TU Chemnitz-Zwickau (1995). Left out: 1.12 and 1.13.
"""

import numpy as np
import pytest
import scipy.linalg

from design.lqr.discrete_riccati import solve_discrete_riccati
from tests.design.exact_riccati import exact_discrete_solution

#: Relative error that scipy is always granted: it may hit a small integer exactly.
GRANTED = 2e-14


def solve(A, B, Q, R, N=None):
    A, B, Q, R = (np.atleast_2d(np.asarray(m, dtype=float)) for m in (A, B, Q, R))
    N = np.zeros_like(B) if N is None else np.asarray(N, dtype=float)
    return A, B, Q, R, N, solve_discrete_riccati(A, B, Q, R, N)


def check(A, B, Q, R, N=None, exact=None):
    """Certified, and within ten times scipy's error; `exact` from 60 digits where there is no closed form."""
    A, B, Q, R, N, solution = solve(A, B, Q, R, N)
    assert solution.certified
    if exact is None:
        found = exact_discrete_solution(A, B, Q, R, N, solution.X)
        assert found.stabilising
        exact = found.X
    theirs = scipy.linalg.solve_discrete_are(A, B, Q, R, s=N)
    errors = [np.linalg.norm(X - exact) / np.linalg.norm(exact) for X in (solution.X, theirs)]
    assert errors[0] <= 10.0 * max(errors[1], GRANTED)
    return solution


def test_1_1_1_2_1_4_have_a_singular_r():
    """Van Dooren 1981, example II; Ionescu and Weiss 1992; Sun 1998. No regulators in our sense: refused."""
    for A, B, Q, R, N in (
        ([[2, -1], [1, 0]], [[1], [0]], np.diag([0, 1]), 0, None),
        ([[0, 1], [0, -1]], [[1, 0], [2, 1]], np.array([[-4, -4], [-4, 7]]) / 11, [[9, 3], [3, 1]], [[3, 1], [-1, 7]]),
        (np.diag([0.1, 0.01], 1), np.eye(3)[:, [0, 2]], np.diag([1e5, 1e3, -10]), np.diag([0, 1]), None),
    ):
        assert not solve(A, B, Q, R, N)[-1].certified


def test_1_3():
    """Jonckheere 1981: (A, B) controllable, no solution with X <= 0."""
    X = np.array([[1, 2], [2, 2 + np.sqrt(5)]])
    check([[0, 1], [0, 0]], [[0], [1]], [[1, 2], [2, 4]], 1, exact=X)


def test_1_5():
    """Ackerson and Fu 1970: satellite control."""
    A = scipy.linalg.block_diag([[0.998, 0.067], [-0.067, 0.998]], [[0.998, 0.153], [-0.153, 0.998]])
    B = [[0.0033, 0.02], [0.1, -0.0007], [0.04, 0.0073], [-0.0028, 0.1]]
    Q = [[1.87, 0, 0, -0.244], [0, 0.744, 0.205, 0], [0, 0.205, 0.589, 0], [-0.244, 0, 0, 1.048]]
    check(A, B, Q, np.eye(2))


def test_1_6():
    """Litkouhi 1983: a system with slow and fast modes."""
    A = [
        [0.98475, -0.079903, 0.0009054, -0.0010765],
        [0.041588, 0.99899, -0.035855, 0.012684],
        [-0.54662, 0.044916, -0.32991, 0.19318],
        [2.6624, -0.10045, -0.92455, -0.26325],
    ]
    B = [[0.0037112, 0.0007361], [-0.087051, 9.3411e-6], [-1.19844, -4.1378e-4], [-3.1927, 9.2535e-4]]
    check(A, B, 0.01 * np.eye(4), np.eye(2))


def test_1_7():
    """Lu and Lin 1993, example 4.3."""
    A = [[-0.6, -2.2, -3.6, -5.400018], [1, 0.6, 0.8, 3.399982], [0, 1, 1.8, 3.799982], [0, 0, 0, -0.999982]]
    B = [[1, -1, -1, -1], [0, 1, -1, -1], [0, 0, 1, -1], [0, 0, 0, 1]]
    C = np.array([[1, 1, 2, 4], [0, 1, 1, 2], [0, 0, 1, 1], [0, 0, 0, 1]])
    weight = np.zeros((4, 4))
    weight[:3, :3] = 2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    check(A, B, C.T @ weight @ C, np.eye(4))


def test_1_8():
    """Gajic and Shen 1993, section 2.7.4: chemical plant."""
    A = 0.01 * np.array(
        [
            [95.407, 1.9643, 0.3597, 0.0673, 0.019],
            [40.849, 41.317, 16.084, 4.4679, 1.1971],
            [12.217, 26.326, 36.149, 15.93, 12.383],
            [4.1118, 12.858, 27.209, 21.442, 40.976],
            [0.1305, 0.5808, 1.875, 3.6162, 94.28],
        ]
    )
    B = 0.01 * np.array([[0.0434, -0.0122], [2.6606, -1.0453], [3.753, -5.51], [3.6076, -6.6], [0.4617, -0.9148]])
    check(A, B, np.eye(5), np.eye(2))


def test_1_9():
    """Davison and Wang 1974: nilpotent A, with a cross term."""
    C = np.array([[1, 1, 0, 0, 0, 0], [0, 0, 0, 1, -1, 0]])
    N = np.zeros((6, 2))
    N[[0, 1, 3, 4], 0] = 1, 1, 1, -1
    A, B = np.kron(np.eye(2), np.eye(3, k=1)), np.kron(np.eye(2), np.eye(3)[:, -1:])
    check(A, B, C.T @ C, np.diag([3, 1]), N)


def test_1_10():
    """Patnaik et al. 1980: tubular ammonia reactor."""
    A = 1e-3 * np.array(
        [
            [870.1, 135.0, 11.59, 0.5014, -37.22, 0.3484, 0, 4.242, 7.249],
            [76.55, 897.4, 12.72, 0.5504, -40.16, 0.3743, 0, 4.53, 7.499],
            [-127.2, 357.5, 817, 1.455, -102.8, 0.987, 0, 11.85, 18.72],
            [-363.5, 633.9, 74.91, 796.6, -273.5, 2.653, 0, 31.72, 48.82],
            [-960, 1645.9, -128.9, -5.597, 71.42, 7.108, 0, 84.52, 125.9],
            [-664.4, 112.96, -88.89, -3.854, 84.47, 13.6, 0, 144.3, 101.6],
            [-410.2, 693, -54.71, -2.371, 66.49, 12.49, 0.1063, 99.97, 69.67],
            [-179.9, 301.7, -23.93, -1.035, 60.59, 22.16, 0, 213.9, 35.54],
            [-345.1, 580.4, -45.96, -1.989, 105.6, 19.86, 0, 219.1, 215.2],
        ]
    )
    B = 1e-3 * np.array(
        [
            [4.76, -0.05701, -8.368], [0.0879, -0.4773, -0.273], [0.1482, -1.312, 0.8876], [0.3892, -3.513, 2.48],
            [1.034, -9.275, 6.68], [0.7203, -6.159, 3.834], [0.4454, -3.683, 2.029], [0.1971, -1.554, 0.6937],
            [0.3773, -3.028, 1.469],
        ]
    )  # fmt: skip
    check(A, B, np.diag([50, 0, 0, 0, 50, 0, 0, 0, 0]), np.eye(3))


def test_1_11():
    """Sima 1996, section 1.2.2: paper machine, model error integrators and a dead time."""
    A, B, C = np.zeros((11, 11)), np.zeros((11, 2)), np.zeros((4, 11))
    A[range(1, 5), range(4)] = 1
    A[5, 4:6], A[6, [4, 6]], A[7, 7:9], A[8, 7] = (0.222, 0.778), (0.4, 0.6), (1.372, -0.47), 1
    A[9, 5], A[10, 6:9], A[9, 9], A[10, 10] = -15, (-7, 5.357, 3.943), 1, 1
    B[0, 0], B[7, 1] = 1, 0.098
    C[0, 5], C[1, 6:9], C[2, 9], C[3, 10] = 15, (7, -5.357, -3.943), 1, 1
    check(A, B, C.T @ np.diag([0.5, 5, 0.5, 5]) @ C, np.diag([400, 700]))


@pytest.mark.parametrize("r", [1.0, 1e3, 1e6])
def test_2_1(r):
    """Laub 1979, example 2: X of rank one; poor conditioning for a large R."""
    X = (1 + np.sqrt(1 + 4 * r)) / 2 * np.array([[9, 6], [6, 4]])
    check([[4, 3], [-4.5, -3.5]], [[1], [-1]], [[9, 6], [6, 4]], r, exact=X)


@pytest.mark.parametrize("eps", [1.0, 1e3, 1e6])
def test_2_2(eps):
    """Laub 1979, example 3: an R that is increasingly ill-conditioned."""
    B = [[4.877, 4.877], [-1.1895, 3.569]]
    check(np.diag([0.9512, 0.9048]), B, np.diag([0.005, 0.02]), np.diag([1 / (3 * eps), 3 * eps]))


@pytest.mark.parametrize("eps", [1.0, 1e3, 1e6])
def test_2_3(eps):
    """Increasingly badly scaled states, ``X = diag(1, 1 + eps^2)``."""
    check([[0, eps], [0, 0]], [[0], [1]], np.eye(2), 1, exact=np.diag([1, 1 + eps**2]))


@pytest.mark.parametrize("eps", [1.0, 1e3, 1e6])
def test_2_4(eps):
    """Petkov et al. 1989: turned so that no entry shows the modes."""
    V = np.eye(3) - 2 / 3 * np.ones((3, 3))
    X = eps * V @ np.diag([1, (1 + np.sqrt(5)) / 2, (9 + np.sqrt(85)) / 2]) @ V
    check(V @ np.diag([0, 1, 3]) @ V, np.eye(3), eps * np.eye(3), eps * np.eye(3), exact=X)


@pytest.mark.parametrize("tau", [1e2, 1e4, 1e8])
def test_2_5(tau):
    """Pappas et al. 1980: process control of a paper machine, a pole at 1 - 1/tau and three samples of dead time."""
    r, alpha, beta = 0.25, 1 - 1 / tau, 1 / tau
    A = np.diag([1.0, 1.0, 1.0], -1)
    A[0, 0] = alpha
    half = r * (alpha + 1) * (alpha - 1) + beta**2
    X = np.diag([(half + np.sqrt(half**2 + 4 * beta**2 * r)) / (2 * beta**2), 1, 1, 1])
    A, B, Q, R, _, solution = solve(A, beta * np.eye(4)[:, :1], np.diag([0, 0, 0, 1]), r)
    if tau < 1e8:
        assert solution.certified
    if solution.certified:
        theirs = scipy.linalg.solve_discrete_are(A, B, Q, R)
        errors = [np.linalg.norm(found - X) / np.linalg.norm(X) for found in (solution.X, theirs)]
        assert errors[0] <= 10.0 * max(errors[1], GRANTED)


@pytest.mark.parametrize("n", [4, 20])
def test_4_1(n):
    """Pappas et al. 1980, example 3: a delay line, ``X = diag(1, 2, .. n)``; all closed-loop poles at zero."""
    check(np.eye(n, k=1), np.eye(n)[:, -1:], np.eye(n), 1, exact=np.diag(np.arange(1.0, n + 1.0)))
