"""The path to a Lyapunov matrix: what it says of loops is what theory, and a slower programme, say."""

import numpy as np
import pytest

from schedules.proof.barrier import MOST_STEPS, Answer, central
from schedules.proof.decay import decay_rates, slowest
from schedules.proof.semidefinite import best_lyapunov


def stable(rng, n, count, spread):
    centre = rng.standard_normal((n, n))
    loops = centre + spread * rng.standard_normal((count, n, n))
    return loops - (np.max(np.linalg.eigvals(loops).real) + 0.1) * np.eye(n)


@pytest.mark.parametrize("n", [1, 2, 5, 8])
def test_a_stable_loop_has_a_matrix(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        A = stable(rng, n, 1, 0.0)
        found = central(A)
        assert found.answer is Answer.PROVED
        assert np.trace(found.X) == pytest.approx(n)
        assert np.min(decay_rates(A, found.X)) > 0.0


@pytest.mark.parametrize("n", [2, 4, 6])
def test_a_loop_that_grows_has_none(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        A = stable(rng, n, 3, 0.1)
        A[1] += (float(slowest(A)[1]) + 0.05) * np.eye(n)
        found = central(A)
        assert found.answer is Answer.NONE
        assert np.all(np.linalg.eigvalsh(found.X) > 0.0)


def test_the_boundary_of_two_loops_is_where_theory_has_it():
    """Shorten and Narendra: A, B of order 2 share a matrix if and only if all A + t B, A + t B^-1 are stable."""
    ratios = np.geomspace(1e-3, 1e3, 4001)[:, None, None]
    answers = []
    for k in np.linspace(1.05, 1.6, 23):
        A, B = np.array([[[-0.1, 1.0], [-k, -0.1]], [[-0.1, k], [-1.0, -0.1]]])
        pencils = np.concatenate([A + ratios * B, A + ratios * np.linalg.inv(B)])
        distance = float(np.min(slowest(pencils)))
        if abs(distance) > 1e-3:
            answers.append(central(np.stack([A, B])).answer)
            assert answers[-1] is (Answer.PROVED if distance > 0.0 else Answer.NONE)
    assert {Answer.PROVED, Answer.NONE} <= set(answers)


def test_it_says_what_the_programme_says():
    """Eight loops each, near and beyond the spread at which they cease to share a matrix."""
    rng = np.random.default_rng(0)
    told = dict.fromkeys(Answer, 0)
    for spread in np.linspace(0.05, 2.0, 60):
        A = stable(rng, 4, 8, spread)
        found, X = central(A), best_lyapunov(A, 0.0)
        known = X is not None and np.linalg.eigvalsh(X)[0] > 1e-9 and np.min(decay_rates(A, X)) > 0.0
        told[found.answer] += 1
        assert found.steps < MOST_STEPS
        if found.answer is Answer.PROVED:
            assert np.min(decay_rates(A, found.X)) > 0.0
        if found.answer is Answer.NONE:
            assert not known
    assert told[Answer.PROVED] > 10
    assert told[Answer.NONE] > 10
    assert told[Answer.UNCLEAR] <= 1


def test_units_of_time_change_nothing():
    A = stable(np.random.default_rng(3), 5, 8, 0.1)
    for scale in (1e-200, 1e-6, 1e6, 1e200):
        np.testing.assert_allclose(central(A * scale).X, central(A).X, rtol=1e-6, atol=1e-9)


def test_what_arithmetic_cannot_tell_is_unclear_and_no_fault():
    """A loop on the edge of stability: neither answer may be given."""
    A = np.array([[[0.0, 1.0], [-1.0, 0.0]]])
    assert central(A).answer is not Answer.PROVED
    found = central(np.zeros((2, 3, 3)))
    assert found.answer is not Answer.PROVED
    assert np.all(np.isfinite(found.X))
