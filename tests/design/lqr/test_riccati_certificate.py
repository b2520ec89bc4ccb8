"""What the certificates claim, checked on candidates that are wrong on purpose."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr import certificate, discrete_riccati, riccati
from design.lqr.discrete_riccati import solve_discrete_riccati
from design.lqr.doubt import doubt_of
from design.lqr.lyapunov import solve_lyapunov, solve_stein
from design.lqr.regulator import regulator_problem
from design.lqr.riccati import solve_riccati
from tests.design.exact_riccati import exact_discrete_solution, exact_solution
from tests.design.lqr_cases import hidden_discrete_modes, hidden_modes


def random_problem(seed, n, m, discrete):
    random = np.random.default_rng(seed)
    A, B, C = random.normal(size=(1, n, n)), random.normal(size=(1, n, m)), random.normal(size=(1, n, n))
    return regulator_problem(A, B, C @ C.mT, np.eye(m), None, discrete), random


def continuous_doubt(equation, X):
    """Doubt about X without a Newton step, and P."""
    error, _ = riccati._residual(equation, X)
    bound = riccati._residual_bound(equation, X, error)
    _, P = solve_lyapunov(equation.A - equation.G @ X, error, -bound)
    return 4.0 * doubt_of(equation.G, P, bound), P


def discrete_doubt(equation, X):
    loop = discrete_riccati._loop(equation, X)
    error, _ = discrete_riccati._residual(equation, X, loop)
    bound = discrete_riccati._residual_bound(equation, X, loop, error)
    _, P = solve_stein(loop.closed, error, -bound)
    gramian = equation.F @ np.linalg.solve(loop.pivot, equation.F.mT)
    return 8.0 * doubt_of(gramian, P, bound), P


def in_order(equation, X, discrete):
    """Stable and positive semidefinite, as the certificate asks of every candidate besides."""
    F = equation.F
    gain = np.linalg.solve(np.eye(F.shape[-1]) + F.mT @ X @ F, F.mT @ X @ equation.A) if discrete else F.mT @ X
    poles = np.linalg.eigvals(equation.A - F @ gain)
    stable = np.all(np.abs(poles) < 1 if discrete else poles.real < 0, axis=-1)
    return stable & (np.linalg.eigvalsh(X)[:, 0] >= -1e-10 * np.abs(X).max(axis=(1, 2)))


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 2), st.floats(-12.0, 0.0), st.booleans())
def test_where_the_doubt_is_below_one_the_solution_lies_within_2P(seed, n, m, power, discrete):
    """Newton-Kantorovich as claimed, for candidates that are off by anything from rounding to their own size."""
    problem, random = random_problem(seed, n, m, discrete)
    equation = problem.equation
    kind = discrete_riccati._DISCRETE if discrete else riccati._CONTINUOUS
    X = kind.newton(equation, kind.thorough(equation))[0]
    off = random.normal(size=(1, n, n)) * 10.0**power * np.abs(X).max()
    X = X + off + off.mT
    with np.errstate(all="ignore"):
        doubt, P = (discrete_doubt if discrete else continuous_doubt)(equation, X)
    if not (doubt[0] < 1.0 and in_order(equation, X, discrete)[0]):
        return
    A, F, Q = equation.A[0], equation.F[0], equation.Q[0]
    if discrete:
        exact = exact_discrete_solution(A, F, Q, np.eye(m), np.zeros_like(F), X[0])
    else:
        exact = exact_solution(A, F, Q, np.eye(m), X[0])
    assert exact.stabilising
    rounding = 1e-14 * np.abs(exact.X).max()
    for sign in (1.0, -1.0):
        assert np.linalg.eigvalsh(2.0 * P[0] + sign * (exact.X - X[0]))[0] >= -rounding


@pytest.mark.parametrize("discrete", [False, True])
def test_the_doubt_is_about_the_right_size(discrete):
    """It grows with the square of the error, and is near 1 where Newton's method is at its limit, not decades below."""
    problem, random = random_problem(3, 3, 2, discrete)
    equation = problem.equation
    kind = discrete_riccati._DISCRETE if discrete else riccati._CONTINUOUS
    exact = kind.newton(equation, kind.thorough(equation))[0]
    off = random.normal(size=(1, 3, 3)) * np.abs(exact).max()
    off = 0.5 * (off + off.mT)
    about = discrete_doubt if discrete else continuous_doubt
    doubts = [about(equation, exact + size * off)[0][0] for size in (1e-8, 1e-6, 1e-4)]
    assert 10.0 < doubts[1] / doubts[0] < 1e4
    assert 10.0 < doubts[2] / doubts[1] < 1e4
    assert 1e-6 < doubts[2] < 10.0


@pytest.mark.parametrize("discrete", [False, True])
def test_no_proof_of_what_does_not_exist(discrete):
    """A mode on the boundary that nothing sees: candidates split by rounding look stable, and stay in doubt."""
    problems = hidden_discrete_modes(60, 3) if discrete else hidden_modes(60, 3)
    with np.errstate(all="ignore"):
        problem = regulator_problem(problems.A, problems.B, problems.Q, problems.R, None, discrete)
        kind = discrete_riccati._DISCRETE if discrete else riccati._CONTINUOUS
        for X in (kind.quick(problem.equation)[0], kind.thorough(problem.equation)):
            X, _, doubt = kind.newton(problem.equation, X)
            X = np.where(np.isfinite(X).all(axis=(1, 2))[:, None, None], X, -np.eye(5))
            proved = np.flatnonzero((doubt < 1.0) & in_order(problem.equation, X, discrete))
            assert 5 <= len(proved) <= 45
            for i in proved:
                A, F, Q = problem.equation.A[i], problem.equation.F[i], problem.equation.Q[i]
                if discrete:
                    exact = exact_discrete_solution(A, F, Q, np.eye(2), np.zeros_like(F), X[i])
                else:
                    exact = exact_solution(A, F, Q, np.eye(2), X[i])
                assert exact.stabilising, i


def test_defective_closed_loops_get_their_poles_from_elsewhere():
    """A double pole has no two eigenvectors to read it off: eigenvalues are computed, and the digits are there."""
    solution = solve_riccati(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.diag([1.0, 2.0]), np.eye(1)
    )
    assert solution.certified
    assert solution.largest_real_part == pytest.approx(-1.0, abs=3e-8)
    np.testing.assert_allclose(solution.K, [[1.0, 2.0]], rtol=1e-13)


@pytest.mark.parametrize("discrete", [False, True])
def test_the_poles_are_those_of_the_gain_that_is_returned(discrete):
    random = np.random.default_rng(5)
    A, B = random.normal(size=(60, 5, 5)), random.normal(size=(60, 5, 2))
    C = random.normal(size=(60, 5, 5))
    if discrete:
        solution = solve_discrete_riccati(A, B, C @ C.mT, np.eye(2))
        slowest = np.abs(np.linalg.eigvals(A - B @ solution.K)).max(axis=1)
        np.testing.assert_allclose(solution.spectral_radius, slowest, rtol=1e-10)
    else:
        solution = solve_riccati(A, B, C @ C.mT, np.eye(2))
        slowest = np.linalg.eigvals(A - B @ solution.K).real.max(axis=1)
        np.testing.assert_allclose(solution.largest_real_part, slowest, rtol=1e-9)
    assert solution.certified.all()


@pytest.mark.parametrize("discrete", [False, True])
@pytest.mark.parametrize("broken", ["quick", "thorough", "by_scipy", "quick thorough", "quick by_scipy", "all"])
def test_every_algorithm_may_fail(monkeypatch, discrete, broken):
    """Wrong or no candidates from any of the three: certified and right, or not certified."""
    module = discrete_riccati if discrete else riccati
    name = "_DISCRETE" if discrete else "_CONTINUOUS"
    solve = solve_discrete_riccati if discrete else solve_riccati
    random = np.random.default_rng(6)
    A, B, C = random.normal(size=(9, 4, 4)), random.normal(size=(9, 4, 2)), random.normal(size=(9, 4, 4))
    plain = solve(A, B, C @ C.mT, np.eye(2))
    kind = getattr(module, name)

    def nonsense(equation):
        X = np.random.default_rng(1).normal(size=equation.A.shape)
        X = X @ X.mT
        X[::3] = np.nan
        return X

    changed = dict(kind.__dict__)
    for algorithm in ("quick", "thorough", "by_scipy"):
        if algorithm in broken or broken == "all":
            changed[algorithm] = (lambda equation: (nonsense(equation), None)) if algorithm == "quick" else nonsense
    monkeypatch.setattr(module, name, type(kind)(**changed))
    with np.errstate(all="ignore"):
        solution = solve(A, B, C @ C.mT, np.eye(2))
    known = solution.certified
    np.testing.assert_allclose(solution.K[known], plain.K[known], rtol=1e-7, atol=1e-9)
    assert np.isnan(solution.K[~known]).all()
    if broken != "all":
        assert known.all()
    else:
        assert not known[::3].any()


@pytest.mark.parametrize("discrete", [False, True])
def test_large_grids_are_worked_on_in_parts(monkeypatch, discrete):
    """The answer does not depend on how many points are worked on at once, whoever finds it."""
    problems = hidden_discrete_modes(40, 8) if discrete else hidden_modes(40, 8)
    problems.A[::5] *= 0.5
    solve = solve_discrete_riccati if discrete else solve_riccati
    at_once = solve(problems.A, problems.B, problems.Q, np.eye(2))
    monkeypatch.setattr(certificate, "BATCH", 7)
    in_parts = solve(problems.A, problems.B, problems.Q, np.eye(2))
    assert 5 <= at_once.certified.sum() <= 35
    for name in at_once.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(in_parts, name), getattr(at_once, name))


@pytest.mark.parametrize("discrete", [False, True])
def test_scipy_is_not_asked_where_a_rank_is_lost(monkeypatch, discrete):
    """A weight that misses the integral at every point is refused at the price of the batch, not of a loop."""
    module, name = (discrete_riccati, "_DISCRETE") if discrete else (riccati, "_CONTINUOUS")
    kind, asked = getattr(module, name), []

    def counted(equation):
        asked.append(len(equation.A))
        return kind.by_scipy(equation)

    monkeypatch.setattr(module, name, type(kind)(**{**kind.__dict__, "by_scipy": counted}))
    A = np.tile(np.diag([1.0 if discrete else 0.0, 0.5, -0.3]), (30, 1, 1))
    solve = solve_discrete_riccati if discrete else solve_riccati
    assert not solve(A, np.ones((30, 3, 1)), np.diag([0.0, 1.0, 1.0]), np.eye(1)).certified.any()
    assert not asked
