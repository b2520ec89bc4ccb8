"""The search for a Lyapunov matrix, and the verdict on one: against closed forms, scipy and longer arithmetic."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from schedules.proof.decay import SAFETY, decay_rates, rounding, slowest
from schedules.proof.search import lyapunov
from schedules.proof.semidefinite import best_lyapunov


def stable(rng, n, count=1):
    loops = rng.standard_normal((count, n, n))
    return loops - (np.max(np.linalg.eigvals(loops).real, axis=-1)[:, None, None] + 1.0) * np.eye(n)


@pytest.mark.parametrize("n", [1, 2, 5, 9])
def test_one_loop_is_proved_at_its_slowest_mode(n):
    A = stable(np.random.default_rng(n), n)
    P = lyapunov(A, largest=True)
    assert float(decay_rates(A, P)[0]) == pytest.approx(1.0, rel=0.03)
    assert float(decay_rates(A, P)[0]) <= 1.0 + 1e-9


def test_what_it_says_of_decay_is_what_the_lyapunov_equation_says():
    rng = np.random.default_rng(0)
    for _ in range(20):
        A = stable(rng, 4)[0]
        P = solve_continuous_lyapunov(A.T, -np.eye(4))
        rate = float(decay_rates(A, P))
        form = A.T @ P + P @ A
        assert np.max(np.linalg.eigvalsh(form + 2.0 * (rate - 1e-9) * P)) <= 1e-12 * np.max(np.abs(form))
        assert np.max(np.linalg.eigvalsh(form + 2.0 * (rate + 1e-6) * P)) > 0.0


def switched(k):
    """Two oscillators, stable each, that some switching between them drives away once k is large."""
    return np.array([[[-0.1, 1.0], [-k, -0.1]], [[-0.1, k], [-1.0, -0.1]]])


def test_loops_that_switching_makes_unstable_are_never_proved():
    """Found by following the worst switching law: where the state grows over a turn there is no common matrix."""
    assert lyapunov(switched(1.1)) is not None
    for k in (2.0, 5.0, 40.0):
        assert np.all(slowest(switched(k)) > 0.0)
        assert lyapunov(switched(k)) is None


def test_the_boundary_of_two_loops_is_where_theory_has_it():
    """Shorten and Narendra: A, B of order 2 share a matrix if and only if all A + t B, A + t B^-1 are stable."""
    ratios = np.geomspace(1e-3, 1e3, 4001)[:, None, None]
    for k in np.linspace(1.05, 1.6, 12):
        A, B = switched(k)
        pencils = np.concatenate([A + ratios * B, A + ratios * np.linalg.inv(B)])
        distance = float(np.min(slowest(pencils)))
        if abs(distance) > 1e-3:
            assert (lyapunov(switched(k)) is not None) == (distance > 0.0)


def test_badly_scaled_loops_are_proved_as_well_as_balanced_ones():
    rng = np.random.default_rng(4)
    A = stable(rng, 5) + 0.02 * rng.standard_normal((8, 5, 5))
    size = 10.0 ** np.array([-6.0, 3.0, 0.0, 5.0, -2.0])
    scaled = A / size[:, None] * size
    plain, turned = (float(np.min(decay_rates(x, lyapunov(x, largest=True)))) for x in (A, scaled))
    assert turned == pytest.approx(plain, rel=0.05)


def test_many_loops_are_proved_by_those_that_bind():
    rng = np.random.default_rng(5)
    A = stable(rng, 4) + 0.1 * rng.standard_normal((400, 4, 4))
    P = lyapunov(A, largest=True)
    few = lyapunov(A[np.argsort(decay_rates(A, P))[:40]], largest=True)
    assert np.min(decay_rates(A, P)) > 0.0
    assert np.min(decay_rates(A, P)) == pytest.approx(np.min(decay_rates(A, few)), rel=0.05)


def test_the_programme_has_the_answer_of_one_by_hand():
    """Of A = -I the best X is the identity itself."""
    np.testing.assert_allclose(best_lyapunov(-np.eye(3)[None], 0.0), np.eye(3), atol=1e-4)


@pytest.mark.parametrize("n", [2, 5, 9])
def test_the_margin_is_above_the_arithmetics_own_error(n):
    """The same product in 64 bits of mantissa differs by less than a part of the margin."""
    rng = np.random.default_rng(n)
    for spread in (0.0, 3.0, 6.0):
        size = 10.0 ** rng.uniform(-spread, spread, n)
        A = stable(rng, n)[0] / size[:, None] * size
        root = rng.standard_normal((n, n)) + 2.0 * np.eye(n)
        P = (root @ root.T) / size[:, None] / size
        P = 0.5 * (P + P.T)
        L = np.linalg.cholesky(P)
        long = L.astype(np.longdouble)
        inverse = np.zeros((n, n), dtype=np.longdouble)
        for column in range(n):
            for row in range(n):
                rest = np.longdouble(row == column) - long[row, :row] @ inverse[:row, column]
                inverse[row, column] = rest / long[row, row]
        exact = long.T @ A.astype(np.longdouble) @ inverse.T
        here = L.T @ A @ np.linalg.inv(L).T
        off = float(np.linalg.norm((exact - here).astype(float)))
        assert off <= float(rounding(np.abs(A), P, 1)) / SAFETY


def test_a_matrix_that_is_not_positive_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        decay_rates(-np.eye(2), np.diag([1.0, -1.0]))


def test_batched_is_point_by_point():
    rng = np.random.default_rng(8)
    A, roots = stable(rng, 5, 12).reshape(3, 4, 5, 5), rng.standard_normal((3, 4, 5, 5))
    P = roots @ np.swapaxes(roots, -1, -2) + np.eye(5)
    rates, margins = decay_rates(A, P), rounding(np.abs(A), P, 3)
    for i in np.ndindex(3, 4):
        assert decay_rates(A[i], P[i]) == pytest.approx(rates[i], rel=1e-12)
        assert rounding(np.abs(A[i]), P[i], 3) == pytest.approx(margins[i], rel=1e-12)
