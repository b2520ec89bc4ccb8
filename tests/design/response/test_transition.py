"""Batched matrix exponentials against scipy, closed forms and extended precision."""

import numpy as np
import pytest
from scipy.linalg import expm

from design.response.transition import transition
from tests.design.step_loops import data_set_a, random_stable


def extended(A):
    """exp(A) in extended precision, by a long Taylor series of A / 2^24."""
    small = A.astype(np.longdouble) / np.longdouble(2) ** 24
    total = term = np.eye(len(A), dtype=np.longdouble)
    for k in range(1, 12):
        term = term @ small / k
        total = total + term
    for _ in range(24):
        total = total @ total
    return total.astype(float)


@pytest.mark.parametrize("step", [1e-4, 2e-3, 0.1])
@pytest.mark.parametrize("loops", [data_set_a(np.array([20.0, 50.0])), random_stable(9, 3)])
def test_transition_is_the_matrix_exponential(loops, step):
    found = transition(loops.closed, step)
    for i in range(len(found)):
        np.testing.assert_allclose(found[i], extended(loops.closed[i] * step), rtol=1e-9, atol=1e-13)
        np.testing.assert_allclose(
            found[i], expm(loops.closed[i] * step), rtol=0.0, atol=1e-11 * np.max(np.abs(found[i]))
        )
        np.testing.assert_allclose(transition(loops.closed[i], step), found[i], rtol=1e-9, atol=1e-14)


def test_closed_forms():
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(transition(turn, np.pi / 3.0), [[0.5, np.sqrt(0.75)], [-np.sqrt(0.75), 0.5]], rtol=1e-13)
    np.testing.assert_allclose(transition(turn, 2000.0 * np.pi), np.eye(2), atol=1e-10)
    chain = np.eye(4, k=1)
    np.testing.assert_allclose(transition(chain, 2.0)[0], [1.0, 2.0, 2.0, 8.0 / 6.0], rtol=1e-14)
    np.testing.assert_array_equal(transition(np.zeros((2, 3, 3)), 5.0), np.broadcast_to(np.eye(3), (2, 3, 3)))


def test_no_matrices_and_matrices_beyond_doubles():
    assert transition(np.zeros((0, 3, 3)), 1.0).shape == (0, 3, 3)
    assert transition(np.array([[-1e300]]), 1.0)[0, 0] == 0.0
    assert not np.isfinite(transition(np.array([[1e6]]), 1.0)[0, 0])
