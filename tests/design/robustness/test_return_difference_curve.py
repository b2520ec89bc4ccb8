import numpy as np
import pytest

from design.robustness.level_set import nodes
from design.robustness.return_difference import smallest_return_difference
from design.robustness.simultaneous import as_loop, simultaneous_margins
from tests.design.robustness.two_input_loops import (
    control_return_difference,
    random_loops,
    regulators,
    resonant_loops,
)

OMEGA = np.geomspace(1e-2, 1e2, 100)


def directly(A, B, K, omega, delays=(0.0, 0.0)):
    """From L itself, by LAPACK."""
    pencil = 1j * omega[:, None, None] * np.eye(A.shape[-1]) - A[:, None]
    L = np.exp(-1j * omega[:, None] * np.asarray(delays))[:, :, None] * (
        K[:, None] @ np.linalg.solve(pencil, np.broadcast_to(B[:, None], (*pencil.shape[:2], *B.shape[1:])) + 0j)
    )
    return np.linalg.svd(np.eye(2) + L, compute_uv=False)[..., -1]


@pytest.mark.parametrize(
    ("loops", "tolerance"),
    [
        (random_loops(20, 1, seed=1), 1e-11),
        (random_loops(20, 5, seed=2), 1e-11),
        (random_loops(10, 10, seed=3), 1e-9),
        (regulators(20, 4, seed=4), 1e-10),
        (resonant_loops(20, 6, seed=5, spread=3, damping=1e-3, scale=0), 1e-9),
    ],
)
def test_curve_is_that_of_the_loop_transfer(loops, tolerance):
    np.testing.assert_allclose(smallest_return_difference(*loops, OMEGA), directly(*loops, OMEGA), rtol=tolerance)


def test_curve_is_that_of_python_control():
    loops = regulators(4, 5, seed=6)
    theirs = control_return_difference(*loops, OMEGA)
    np.testing.assert_allclose(smallest_return_difference(*loops, OMEGA), theirs, rtol=1e-9)


def test_poles_in_one_place():
    """No eigenvectors to speak of; a sum over modes would be lost."""
    rng = np.random.default_rng(7)
    closed = np.tile(-np.eye(6) + np.eye(6, k=1), (10, 1, 1))
    B, K = rng.standard_normal((10, 6, 2)), rng.standard_normal((10, 2, 6))
    A = closed + B @ K
    np.testing.assert_allclose(smallest_return_difference(A, B, K, OMEGA), directly(A, B, K, OMEGA), rtol=1e-8)


def test_delays():
    loops, delays = regulators(10, 4, seed=8), (0.2, 0.5)
    found = smallest_return_difference(*loops, OMEGA, delays)
    np.testing.assert_allclose(found, directly(*loops, OMEGA, delays), rtol=1e-10)


def test_unstable_loops_have_a_curve_too():
    A, B, K = random_loops(10, 4, seed=9)
    A = A + 2.0 * np.eye(4)
    assert np.isnan(simultaneous_margins(A, B, K).disk_margin).any()
    np.testing.assert_allclose(smallest_return_difference(A, B, K, OMEGA), directly(A, B, K, OMEGA), rtol=1e-9)


def test_the_curve_touches_the_exact_minimum_and_is_nowhere_below():
    loops = random_loops(30, 4, seed=10)
    found = simultaneous_margins(*loops)
    omega = np.sort(
        np.concatenate([np.tile(OMEGA, (30, 1)), np.minimum(found.return_difference_omega, 1e6)[:, None]], -1)
    )
    curve = smallest_return_difference(*loops, omega)
    assert np.all(curve >= found.return_difference[:, None] * (1.0 - 1e-9))
    np.testing.assert_allclose(curve.min(axis=-1), found.return_difference, rtol=1e-8)


def test_frequencies_that_are_nodes_and_poles_of_the_plant():
    """``k / s``: at 0 the loop transfer is infinite, and the poles' frequencies are where T is computed."""
    A, B, K = np.zeros((2, 2)), np.eye(2), np.diag([1.0, 1.0])
    omega = np.concatenate([[0.0], np.exp(np.linspace(-2.0, 2.0, 9))])
    curve = smallest_return_difference(A, B, K, omega)
    assert curve[0] > 1e12
    np.testing.assert_allclose(curve[1:], np.abs(1.0 + 1.0 / (1j * omega[1:])), rtol=1e-12)
    loop, _ = as_loop(A, B, K, None)
    at = nodes(loop, 1).omega[0]
    np.testing.assert_allclose(smallest_return_difference(A, B, K, at), np.abs(1.0 + 1.0 / (1j * at)), rtol=1e-12)


def test_batched_is_single_and_broken_points_are_nan():
    A, B, K = (v.reshape(3, 4, *v.shape[1:]).copy() for v in random_loops(12, 3, seed=11))
    A[1, 2, 0, 0] = np.nan
    A[2, 0], K[2, 0] = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), 0.0
    omega = np.geomspace(0.1, 10.0, 12).reshape(3, 4, 1) * np.linspace(0.5, 2.0, 7)
    whole = smallest_return_difference(A, B, K, omega)
    assert whole.shape == (3, 4, 7)
    bad = np.zeros((3, 4), dtype=bool)
    bad[1, 2] = bad[2, 0] = True
    np.testing.assert_array_equal(np.isnan(whole).all(axis=-1), bad)
    np.testing.assert_array_equal(np.isnan(whole).any(axis=-1), bad)
    for index in np.ndindex(3, 4):
        one = smallest_return_difference(A[index], B[index], K[index], omega[index])
        np.testing.assert_allclose(one, whole[index], rtol=1e-12)
