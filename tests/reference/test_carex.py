"""The benchmark collection CAREX of continuous Riccati equations, against closed forms and 60-digit solutions.

Abels and Benner, "CAREX - A Collection of Benchmark Examples for Continuous-Time Algebraic Riccati Equations
(Version 2.0)", SLICOT Working Note 1999-14 (1999), whose numbers are used here; before that Benner, Laub and
Mehrmann, "A Collection of Benchmark Examples for the Numerical Solution of Algebraic Riccati Equations I:
Continuous-Time Case", Technical Report SPC 95_22, TU Chemnitz-Zwickau (1995). Left out: 2.9 and 4.4, of 55 and 421
states and tables of thousands of entries.
"""

from decimal import Decimal, getcontext, localcontext
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from design.lqr.riccati import solve_riccati
from tests.design.exact_riccati import exact_solution

#: Relative error that scipy is always granted: it may hit a small integer exactly.
GRANTED = 2e-14


def solve(A, B, Q, R):
    A, B, Q, R = (np.atleast_2d(np.asarray(m, dtype=float)) for m in (A, B, Q, R))
    return A, B, Q, R, solve_riccati(A, B, Q, R)


def error(X, exact):
    return np.linalg.norm(X - exact) / np.linalg.norm(exact)


def scipy_error(A, B, Q, R, exact):
    try:
        return error(scipy.linalg.solve_continuous_are(A, B, Q, R), exact)
    except np.linalg.LinAlgError:
        return np.inf


def check(A, B, Q, R, exact=None):
    """Certified, and within ten times scipy's error; `exact` from 60 digits where there is no closed form."""
    A, B, Q, R, solution = solve(A, B, Q, R)
    assert solution.certified
    if exact is None:
        found = exact_solution(A, B, Q, R, solution.X)
        assert found.stabilising
        exact = found.X
    assert error(solution.X, exact) <= 10.0 * max(scipy_error(A, B, Q, R, exact), GRANTED)
    return solution


def test_1_1():
    """Laub 1979, example 1."""
    check([[0, 1], [0, 0]], [[0], [1]], np.diag([1, 2]), 1, np.array([[2, 1], [1, 2]]))


def test_1_2():
    """Laub 1979, example 2: a mode neither controllable nor observable, X of rank one."""
    X = (1 + np.sqrt(2)) * np.array([[9, 6], [6, 4]])
    check([[4, 3], [-4.5, -3.5]], [[1], [-1]], [[9, 6], [6, 4]], 1, X)


def test_1_3():
    """Beale and Shafai 1989: L-1011 aircraft. Q has an eigenvalue of -3e-6: not semidefinite, but it has a solution."""
    A = [[0, 1, 0, 0], [0, -1.89, 0.39, -5.53], [0, -0.034, -2.98, 2.43], [0.034, -0.0011, -0.99, -0.21]]
    B = [[0, 0], [0.36, -1.6], [-0.95, -0.032], [0.03, 0]]
    Q = [
        [2.313, 2.727, 0.688, 0.023],
        [2.727, 4.271, 1.148, 0.323],
        [0.688, 1.148, 0.313, 0.102],
        [0.023, 0.323, 0.102, 0.083],
    ]
    check(A, B, Q, np.eye(2))


def test_1_4():
    """Bhattacharyya et al. 1983: binary distillation column. Q is not semidefinite, nor is the solution: refused."""
    A = (
        np.diag([-0.991, -1.051, -1.118, -1.548, -1.640, -1.721, -1.823, -1.943])
        + np.diag([0.529, 0.596, 0.596, 0.718, 0.799, 0.901, 1.021], 1)
        + np.diag([0.522, 0.522, 0.522, 0.922, 0.922, 0.922, 0.922], -1)
    )
    B = 1e-3 * np.array(
        [[3.84, 4.0, 37.6, 3.08, 2.36, 2.88, 3.08, 3.0], [-2.88, -3.04, -2.8, -2.32, -3.32, -3.82, -4.12, -3.96]]
    )
    Q = np.diag([1, 1, 1, 1, 0.1, 0.1, 0.1, 0.1])
    for i, j, value in ((0, 4, 0.5), (0, 7, 0.1), (1, 4, 0.1), (2, 5, 0.5)):
        Q[i, j] = Q[j, i] = value
    assert np.linalg.eigvalsh(Q)[0] < -0.1
    A, B, Q, R, solution = solve(A, B.T, Q, np.eye(2))
    assert np.linalg.eigvalsh(scipy.linalg.solve_continuous_are(A, B, Q, R))[0] < -0.02
    assert not solution.certified
    # The same plant with a weight that there is.
    check(A, B, Q + 0.2 * np.eye(8), R)


def test_1_5():
    """Patnaik et al. 1980: tubular ammonia reactor."""
    A = [
        [-4.019, 5.12, 0, 0, -2.082, 0, 0, 0, 0.87],
        [-0.346, 0.986, 0, 0, -2.34, 0, 0, 0, 0.97],
        [-7.909, 15.407, -4.069, 0, -6.45, 0, 0, 0, 2.68],
        [-21.816, 35.606, -0.339, -3.87, -17.8, 0, 0, 0, 7.39],
        [-60.196, 98.188, -7.907, 0.34, -53.008, 0, 0, 0, 20.4],
        [0, 0, 0, 0, 94, -147.2, 0, 53.2, 0],
        [0, 0, 0, 0, 0, 94, -147.2, 0, 0],
        [0, 0, 0, 0, 0, 12.8, 0, -31.6, 0],
        [0, 0, 0, 0, 12.8, 0, 0, 18.8, -31.6],
    ]
    B = np.zeros((9, 3))
    B[:5] = [
        [0.01, -0.011, -0.151], [0.003, -0.021, 0], [0.009, -0.059, 0], [0.024, -0.162, 0], [0.068, -0.445, 0]
    ]  # fmt: skip
    check(A, B, np.eye(9), np.eye(3))


def test_1_6():
    """Davison and Gesing 1978: J-100 jet engine, 30 states, from the tables that come with scipy's tests."""
    tables = Path(scipy.linalg.__file__).parent / "tests" / "data" / "carex_6_data.npz"
    if not tables.exists():
        pytest.skip("this scipy comes without its tests")
    with np.load(tables) as file:
        compare_residuals(*(file[name] for name in "ABQR"))


@pytest.mark.parametrize("eps", [1.0, 1e-2, 1e-4, 1e-6, 1e-8])
def test_2_1(eps):
    """Arnold and Laub 1984, example 1: an unstable mode that the input hardly reaches."""
    root = np.hypot(1, eps)
    x12 = 1 / (2 + root)
    X = np.array([[(1 + root) / eps / eps, x12], [x12, (1 - eps * x12) * (1 + eps * x12) / 4]])
    check(np.diag([1, -2]), [[eps], [0]], np.ones((2, 2)), 1, X)


@pytest.mark.parametrize("eps", [1.0, 1e-3, 1e-6, 1e-8])
def test_2_2(eps):
    """Arnold and Laub 1984, example 3: R singular for eps = 0."""
    R = np.ones((2, 2)) + np.diag([eps, 0])
    check(np.diag([-0.1, -0.02]), [[0.1, 0], [0.001, 0.01]], [[100, 1000], [1000, 10000]], R)


@pytest.mark.parametrize("eps", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_2_3(eps):
    """Kenney, Laub and Wette 1989, example 2: states decades apart."""
    root = np.sqrt(1 + 2 * eps)
    check([[0, eps], [0, 0]], [[0], [1]], np.eye(2), 1, np.array([[root / eps, 1], [1, root]]))


@pytest.mark.parametrize("eps", [1.0, 1e-2, 1e-4, 1e-6, 1e-7])
def test_2_4(eps):
    """Bai and Qian 1994: a Hamiltonian with eigenvalues near the axis."""
    A = np.array([[1 + eps, 1], [1, 1 + eps]])
    a = A[0, 0]
    x11 = 0.5 * (2 * a + np.sqrt(2) * (np.sqrt(a**2 + 1) + eps))
    x12 = x11 / (x11 - a)
    A, B, Q, R, solution = solve(A, np.eye(2), eps**2 * np.eye(2), np.eye(2))
    if eps >= 1e-4:
        assert solution.certified
    if solution.certified:
        exact = np.array([[x11, x12], [x12, x11]])
        assert error(solution.X, exact) <= 10.0 * max(scipy_error(A, B, Q, R, exact), GRANTED)


@pytest.mark.parametrize("eps", [1.0, 1e-1, 1e-2, 1e-3, 0.0])
def test_2_5(eps):
    """Laub 1992: an H-infinity problem, Q not semidefinite, closed-loop poles ``-eps +- i``; no solution at 0."""
    A, B, Q, R, solution = solve(
        [[3 - eps, 1], [4, 2 - eps]], [[1], [1]], [[4 * eps - 11, 2 * eps - 5], [2 * eps - 5, 2 * eps - 2]], 1
    )
    assert solution.certified == (eps > 0)
    if eps > 0:
        exact = np.array([[2.0, 1.0], [1.0, 1.0]])
        assert error(solution.X, exact) <= 10.0 * max(scipy_error(A, B, Q, R, exact), GRANTED)


@pytest.mark.parametrize("eps", [1.0, 1e1, 1e2, 1e4, 1e6])
def test_2_6(eps):
    """Petkov et al. 1987: badly scaled, and turned so that no entry shows it."""
    V = np.eye(3) - 2 / 3 * np.ones((3, 3))
    x = [
        eps**2 + np.sqrt(eps**4 + 1), 2 * eps**2 + np.sqrt(4 * eps**4 + eps), 3 * eps**2 + eps * np.sqrt(9 * eps**2 + 1)
    ]  # fmt: skip
    A, B, Q, R, solution = solve(
        V @ np.diag([eps, 2 * eps, 3 * eps]) @ V, np.eye(3), V @ np.diag([1 / eps, 1, eps]) @ V, eps * np.eye(3)
    )
    exact = V @ np.diag(x) @ V
    assert solution.certified
    assert error(solution.X, exact) <= 10.0 * max(scipy_error(A, B, Q, R, exact), GRANTED)


@pytest.mark.parametrize("eps", [1.0, 1e-3, 1e-6])
def test_2_7(eps):
    """Chow and Kokotovic 1976: magnetic tape control, slow and fast modes."""
    A = np.zeros((4, 4))
    A[0, 1], A[1, 2], A[3, 3] = 0.4, 0.345, -1 / eps
    A[2, 1:] = -0.524 / eps, -0.465 / eps, 0.262 / eps
    check(A, [[0], [0], [0], [1 / eps]], np.diag([1, 0, 1, 0]), 1)


@pytest.mark.parametrize("eps", [1.0, 1e-2, 1e-4, 1e-6])
def test_2_8(eps):
    """Arnold and Laub 1984, example 2: closed-loop eigenvalues close to each other and to the axis."""
    A = np.array([[-eps, 1, 0, 0], [-1, -eps, 0, 0], [0, 0, eps, 1], [0, 0, -1, eps]])
    if eps >= 1e-4:
        check(A, np.ones((4, 1)), np.ones((4, 4)), 1)
    else:
        # The closed loop has a damping of 5e-13: no digit of it is certain.
        assert not solve(A, np.ones((4, 1)), np.ones((4, 4)), 1)[-1].certified


@pytest.mark.parametrize("vehicles", [3, 5, 20])
def test_3_1(vehicles):
    """Laub 1979, example 4: a string of high-speed vehicles, 39 states at the default."""
    n = 2 * vehicles - 1
    A, B, Q = np.zeros((n, n)), np.zeros((n, vehicles)), np.zeros((n, n))
    for i in range(n):
        if i % 2 == 0:
            A[i, i], B[i, i // 2] = -1, 1
        else:
            A[i, i - 1], A[i, i + 1], Q[i, i] = 1, -1, 10
    if n < 10:
        check(A, B, Q, np.eye(vehicles))
    else:
        compare_residuals(A, B, Q, np.eye(vehicles))


@pytest.mark.parametrize("n", [8, 64])
def test_3_2(n):
    """Laub 1979, example 5: circulant matrices, so X is circulant and its spectrum solves scalar equations."""
    A = -2 * np.eye(n) + np.roll(np.eye(n), 1, axis=1) + np.roll(np.eye(n), -1, axis=1)
    a = -2 + 2 * np.cos(2 * np.pi * np.arange(n) / n)
    column = np.fft.ifft(a + np.sqrt(a**2 + 1)).real
    exact = column[(np.arange(n)[:, None] - np.arange(n)) % n]
    check(A, np.eye(n), np.eye(n), np.eye(n), exact)


def integrators(n):
    """Solution of n integrators in series, Q and R one: K is Butterworth's polynomial, and X follows from K."""
    with localcontext() as context:
        context.prec = 80
        # Butterworth: a_k = a_(k-1) cos((k - 1) t) / sin(k t), t = pi / 2n; sines and cosines by the addition theorem.
        t = _pi() / (2 * n)
        s, c = _sine_cosine(t)
        sines, cosines = [Decimal(0)], [Decimal(1)]
        for _ in range(n):
            sines.append(sines[-1] * c + cosines[-1] * s)
            cosines.append(cosines[-1] * c - sines[-2] * s)
        K = [Decimal(1)]
        for k in range(1, n):
            K.append(K[-1] * cosines[k - 1] / sines[k])
        X = [[Decimal(0)] * n for _ in range(n)]
        X[n - 1] = K
        for i in range(n - 1, 0, -1):
            for j in range(n):
                # (A'X + XA - K'K + Q)_ij = 0
                left = X[i][j - 1] if j else Decimal(0)
                X[i - 1][j] = K[i] * K[j] - left
        return np.array(X, dtype=object).astype(float)


def _pi():
    """Machin's formula."""

    def arctan_inverse(x):
        total, power, k = Decimal(0), Decimal(1) / x, 0
        while abs(power) > Decimal(10) ** -getcontext().prec:
            total += power / (2 * k + 1) * (-1) ** k
            power, k = power / (x * x), k + 1
        return total

    return 4 * (4 * arctan_inverse(5) - arctan_inverse(239))


def _sine_cosine(t):
    sine, cosine, term, k = Decimal(0), Decimal(0), Decimal(1), 0
    while abs(term) > Decimal(10) ** -getcontext().prec:
        if k % 2:
            sine += term * (-1) ** (k // 2)
        else:
            cosine += term * (-1) ** (k // 2)
        k += 1
        term = term * t / k
    return sine, cosine


@pytest.mark.parametrize("n", [2, 5, 10, 15, 21])
def test_4_1(n):
    """Laub 1979, example 6: integrators in series, increasingly ill-conditioned; 21 at the default."""
    exact = integrators(n)
    A, B, Q, R, solution = solve(np.eye(n, k=1), np.eye(n)[:, -1:], np.diag(np.eye(n)[0]), 1)
    if n <= 10:
        assert solution.certified
    if solution.certified:
        assert error(solution.X, exact) <= 10.0 * max(scipy_error(A, B, Q, R, exact), GRANTED)


@pytest.mark.parametrize("n", [6, 30])
def test_4_2(n):
    """Rosen and Wang 1992: heat flow in a rod by finite elements, controlled and observed on a part of it."""
    a, b, c, beta, gamma = 0.01, 1.0, 1.0, (0.2, 0.3), (0.2, 0.3)
    x = np.linspace(0, 1, n + 2)
    gramian = (4 * np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1)) / (6 * (n + 1))
    stiffness = -a * (n + 1) * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))

    def integral(low, high):
        """Of each hat function over [low, high], from its antiderivative."""

        def rising(t, start):
            t = np.clip(t, start, start + 1 / (n + 1))
            return (n + 1) * (t - start) ** 2 / 2

        def falling(t, start):
            t = np.clip(t, start, start + 1 / (n + 1))
            return (t - start) - (n + 1) * (t - start) ** 2 / 2

        return sum(f(high, s) - f(low, s) for f, s in ((rising, x[:-2]), (falling, x[1:-1])))

    A = np.linalg.solve(gramian, stiffness)
    B = np.linalg.solve(gramian, b * integral(*beta))[:, None]
    C = c * integral(*gamma)[None]
    (check if n < 10 else compare_residuals)(A, B, C.T @ C, np.eye(1))


@pytest.mark.parametrize("masses", [3, 30])
def test_4_3(masses):
    """Hench et al. 1995: coupled springs, dashpots and masses, 60 states at the default."""
    mu, delta, kappa = 1.0, 4.0, 1.0
    K = 2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    K[0, 0] = K[-1, -1] = 1
    A = np.block([[np.zeros((masses, masses)), np.eye(masses)], [-kappa / mu * K, -delta / mu * np.eye(masses)]])
    B = np.zeros((2 * masses, 2))
    B[masses, 0], B[-1, 1] = 1 / mu, -1 / mu
    (check if masses < 5 else compare_residuals)(A, B, np.eye(2 * masses), np.eye(2))


def compare_residuals(A, B, Q, R):
    """Certified, and a residual within ten times scipy's, both in extended precision."""
    A, B, Q, R, solution = solve(A, B, Q, R)
    assert solution.certified
    ours, theirs = (residual(A, B, Q, R, X) for X in (solution.X, scipy.linalg.solve_continuous_are(A, B, Q, R)))
    assert ours <= 10.0 * max(theirs, GRANTED)


def residual(A, B, Q, R, X):
    A, G, Q, X = (m.astype(np.longdouble) for m in (A, B @ np.linalg.solve(R, B.T), Q, X))
    terms = A.T @ X, X @ A, -X @ G @ X, Q
    return float(np.sqrt((sum(terms) ** 2).sum()) / sum(np.sqrt((t**2).sum()) for t in terms))
