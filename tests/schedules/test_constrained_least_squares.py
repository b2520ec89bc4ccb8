"""Least squares under inequalities, against scipy's sequential quadratic programming."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.sparse import csr_array

from schedules.constrained_least_squares import constrained_least_squares

STAY = 1e-3


@pytest.mark.parametrize("seed", range(8))
def test_agrees_with_scipy(seed):
    rng = np.random.default_rng(seed)
    n, k, c = 6, 10, 12
    M, target = rng.normal(size=(k, n)), rng.normal(size=k)
    rows = rng.uniform(-1.0, 1.0, size=(c, n))
    C = np.vstack([rows, np.eye(n)])
    lower = np.concatenate([-rng.uniform(0.0, 0.3, c), np.full(n, -0.2)])
    upper = np.concatenate([np.full(c, np.inf), np.full(n, 0.2)])

    def cost(x):
        return np.sum((M @ x - target) ** 2) + STAY * x @ x

    x = constrained_least_squares(csr_array(M), target, csr_array(C), lower, upper, STAY)
    inside = [
        {"type": "ineq", "fun": lambda x: rows @ x - lower[:c]},
        {"type": "ineq", "fun": lambda x: 0.2 - np.concatenate([x, -x])},
    ]
    expected = minimize(cost, np.zeros(n), constraints=inside, tol=1e-12)
    np.testing.assert_allclose(x, expected.x, atol=1e-4)
    assert np.max(lower - C @ x) < 1e-5
    assert np.max(C @ x - upper) < 1e-5


def test_without_binding_inequalities_it_is_the_normal_equations():
    rng = np.random.default_rng(3)
    M, target = rng.normal(size=(9, 4)), rng.normal(size=9)
    free = np.full(4, np.inf)
    x = constrained_least_squares(csr_array(M), target, csr_array(np.eye(4)), -free, free, STAY)
    np.testing.assert_allclose(x, np.linalg.solve(M.T @ M + STAY * np.eye(4), M.T @ target), atol=1e-6)


def test_bounds_that_contradict_each_other_give_a_finite_compromise():
    C = csr_array(np.array([[1.0], [1.0]]))
    lower, upper = np.array([1.0, -np.inf]), np.array([np.inf, -1.0])
    x = constrained_least_squares(csr_array(np.eye(1)), np.zeros(1), C, lower, upper, STAY)
    assert np.abs(x[0]) < 1.0
