import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr.return_difference import return_difference
from design.lqr.riccati import solve_riccati
from design.lqr.tracking import augment_with_integral
from design.lqr.weights import weight_matrices
from tests.design.lqr_cases import EXAMPLES, example


def brute_force(A, B, K, R, omega):
    """sigma_min of R^1/2 (I + L) R^-1/2 by singular values at each frequency, from the open loop."""
    values, vectors = np.linalg.eigh(R)
    root = vectors * np.sqrt(values) @ vectors.T
    L = K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(len(A)) - A, B.astype(complex))
    return np.linalg.svd(root @ (np.eye(len(R)) + L) @ np.linalg.inv(root), compute_uv=False)[:, -1]


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_against_brute_force(name):
    model, controller = example(name)
    plant, weights = augment_with_integral(model), weight_matrices(controller.weights)
    K = solve_riccati(plant.A, plant.B, weights.Q, weights.R).K
    found = return_difference(plant.A, plant.B, K, weights.R)
    assert np.all(found.smallest >= 1.0 - 1e-6)
    omega = np.geomspace(1e-2, 1e6, 4000)
    for index in np.ndindex(K.shape[:-2]):
        dense = brute_force(plant.A[index], plant.B[index], K[index], weights.R, omega)
        assert dense.min() >= 1.0 - 1e-6
        assert found.smallest[index] == pytest.approx(dense.min(), abs=1e-4)
        poles = np.linalg.eigvals(plant.A[index] - plant.B[index] @ K[index])
        np.testing.assert_allclose(np.sort_complex(found.poles[index]), np.sort_complex(poles), rtol=1e-9)


def test_a_gain_that_is_not_optimal_is_found_out():
    """Half the optimal gain still stabilises, and breaks Kalman's inequality by what brute force says."""
    A = np.diag([1.0, -2.0, 0.5]) + np.triu(np.ones((3, 3)), 1)
    B, R = np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]), np.array([[2.0, 0.3], [0.3, 0.5]])
    K = 0.75 * solve_riccati(A, B, 0.01 * np.eye(3), R).K
    assert np.linalg.eigvals(A - B @ K).real.max() < 0
    found = return_difference(A, B, K, R)
    dense = brute_force(A, B, K, R, np.geomspace(1e-4, 1e4, 20000))
    assert dense.min() < 0.9
    assert dense.min() - 1e-12 <= found.smallest <= dense.min() + 5e-3


def test_defective_closed_loop_is_computed_without_eigenvectors():
    """A triple pole has no basis of eigenvectors; the answer is that of the linear solves."""
    A, B = np.diag(np.ones(2), 1), np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    K = np.array([[1.0, 3.0, 3.0], [0.0, 0.0, 0.0]])
    found = return_difference(A, B, K, np.eye(2))
    dense = brute_force(A, B, K, np.eye(2), np.geomspace(1e-3, 1e3, 20000))
    assert found.smallest == pytest.approx(dense.min(), abs=2e-3)
    assert found.smallest >= dense.min() - 1e-9


def test_grid_equals_points():
    model, controller = example("airliner_aileron")
    plant, weights = augment_with_integral(model), weight_matrices(controller.weights)
    K = solve_riccati(plant.A, plant.B, weights.Q, weights.R).K
    grid = return_difference(plant.A, plant.B, K, weights.R)
    for index in [(0, 0), (2, 3), (3, 6)]:
        point = return_difference(plant.A[index], plant.B[index], K[index], weights.R)
        np.testing.assert_allclose(grid.take(index).smallest, point.smallest, rtol=1e-13)
        np.testing.assert_allclose(grid.take(index).poles, point.poles, rtol=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6))
def test_kalmans_inequality(seed, n):
    """Every optimal gain without a cross term keeps (I + L)* R (I + L) >= R (Kalman 1964)."""
    random = np.random.default_rng(seed)
    A, B = random.normal(size=(2, n, n)), random.normal(size=(2, n, 2))
    C, D = random.normal(size=(2, n, n)), random.normal(size=(2, 2))
    Q, R = C.mT @ C, D.T @ D + 0.1 * np.eye(2)
    K = solve_riccati(A, B, Q, R).K
    found = return_difference(A, B, K, R)
    assert np.all(found.smallest >= 1.0 - 1e-6)
    omega = np.geomspace(1e-4, 1e4, 200)
    for i in range(2):
        L = K[i] @ np.linalg.solve(1j * omega[:, None, None] * np.eye(n) - A[i], B[i].astype(complex))
        F = np.eye(2) + L
        excess = np.linalg.eigvalsh(F.conj().mT @ R @ F - R)
        assert np.all(excess[:, 0] >= -1e-6 * np.abs(excess[:, 1]))
