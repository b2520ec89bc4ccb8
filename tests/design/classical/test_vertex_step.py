"""Against scipy's linear programming, which solves the same problem by another road."""

import numpy as np
import pytest
from scipy.optimize import linprog

from design.classical.vertex_step import best_vertex


def _problem(rng, k, m, j, feasible):
    slope = rng.standard_normal((k, j))
    gradient = rng.standard_normal((k, m, j))
    value = -rng.uniform(0.0 if feasible else -1.0, 1.0, (k, m))
    low, high = -rng.uniform(0.1, 1.0, (k, j)), rng.uniform(0.1, 1.0, (k, j))
    return slope, value, gradient, low, high


@pytest.mark.parametrize("j", [2, 3])
def test_feasible_programmes_reach_the_optimum_of_linprog(j):
    rng = np.random.default_rng(j)
    slope, value, gradient, low, high = _problem(rng, 40, 7, j, feasible=True)
    d = best_vertex(slope, value, gradient, low, high)
    assert np.all(value + np.einsum("kmj,kj->km", gradient, d) <= 1e-8)
    for i in range(40):
        best = linprog(-slope[i], gradient[i], -value[i], bounds=list(zip(low[i], high[i], strict=True)))
        assert slope[i] @ d[i] == pytest.approx(-best.fun, abs=1e-8)


@pytest.mark.parametrize("j", [2, 3])
def test_where_nothing_is_feasible_the_violation_does_not_rise(j):
    rng = np.random.default_rng(10 + j)
    slope, value, gradient, low, high = _problem(rng, 200, 7, j, feasible=False)
    d = best_vertex(slope, value, gradient, low, high)
    before = np.maximum(value, 0.0).max(axis=-1)
    after = np.maximum(value + np.einsum("kmj,kj->km", gradient, d), 0.0).max(axis=-1)
    assert np.all(after <= before + 1e-9)
    assert np.mean(after[before > 0] < 0.999 * before[before > 0]) > 0.5


def test_without_constraints_the_corner_of_the_box():
    d = best_vertex(np.array([[1.0, -2.0]]), np.zeros((1, 0)), np.zeros((1, 0, 2)), -np.ones((1, 2)), np.ones((1, 2)))
    assert d.tolist() == [[1.0, -1.0]]
