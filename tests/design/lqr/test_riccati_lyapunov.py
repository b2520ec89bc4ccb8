import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr import lyapunov
from design.lqr.lyapunov import lyapunov_operator, solve_lyapunov, solve_stein, stein_operator, symmetric_packing


def problem(seed, points, n):
    random = np.random.default_rng(seed)
    Ac, full = random.normal(size=(points, n, n)), random.normal(size=(points, n, n))
    return Ac, full + full.mT, random.normal(size=(points, n))


@pytest.mark.parametrize("n", [1, 2, 5, 9])
def test_packing_goes_forth_and_back(n):
    packing = symmetric_packing(n)
    matrix = problem(1, 1, n)[1][0]
    vector = matrix.ravel()[packing.upper]
    np.testing.assert_array_equal(vector[packing.whole].reshape(n, n), matrix)
    np.testing.assert_array_equal(vector[packing.diagonal], np.diag(matrix))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_operators_are_those_of_the_equations(seed, n):
    Ac, D, _ = problem(seed, 3, n)
    upper = symmetric_packing(n).upper
    for operator, image in (
        (lyapunov_operator(Ac), Ac.mT @ D + D @ Ac),
        (stein_operator(Ac), Ac.mT @ D @ Ac - D),
    ):
        vector = (operator @ D.reshape(3, -1)[:, upper, None])[:, :, 0]
        np.testing.assert_allclose(vector, image.reshape(3, -1)[:, upper], atol=1e-12 * np.abs(image).max())


@pytest.mark.parametrize("n", [1, 4, 7])
def test_against_scipy(n):
    Ac, full, diagonal = problem(2, 6, n)
    for ours, theirs in (
        (solve_lyapunov, lambda a, q: scipy.linalg.solve_continuous_lyapunov(a.T, q)),
        (solve_stein, lambda a, q: scipy.linalg.solve_discrete_lyapunov(a.T, -q)),
    ):
        D, P = ours(Ac, full, diagonal)
        for i in range(6):
            for found, right in ((D[i], full[i]), (P[i], np.diag(diagonal[i]))):
                np.testing.assert_array_equal(found, found.T)
                exact = theirs(Ac[i], right)
                np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


def test_many_points_are_solved_in_turn(monkeypatch):
    Ac, full, diagonal = problem(3, 50, 4)
    for solve in (solve_lyapunov, solve_stein):
        at_once = solve(Ac, full, diagonal)
        with monkeypatch.context() as patch:
            patch.setattr(lyapunov, "CHUNK", 7 * 100)
            in_turn = solve(Ac, full, diagonal)
            patch.setattr(lyapunov, "CHUNK", 1)
            one_by_one = solve(Ac, full, diagonal)
        for a, b, c in zip(at_once, in_turn, one_by_one, strict=True):
            np.testing.assert_array_equal(a, b)
            np.testing.assert_array_equal(a, c)


def test_singular_points_are_nan_and_alone():
    Ac, full, diagonal = problem(4, 3, 2)
    Ac[1] = np.diag([1.0, -1.0])
    D, P = solve_lyapunov(Ac, full, diagonal)
    assert np.isnan(D[1]).all()
    assert np.isnan(P[1]).all()
    assert np.isfinite(D[[0, 2]]).all()
    Ac[1] = np.eye(2)
    assert np.isnan(solve_stein(Ac, full, diagonal)[0][1]).all()


def test_no_points():
    D, P = solve_lyapunov(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    assert D.shape == P.shape == (0, 3, 3)
