import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr import hamiltonian
from design.lqr.hamiltonian import (
    eigenvectors_or_nan,
    isotropic_krylov_basis,
    stabilising_candidate,
    subspace,
    subspace_by_square,
)
from design.lqr.regulator import regulator_problem
from tests.design.lqr_cases import weights_over_twelve_decades


def random_hamiltonian(points, n, seed):
    random = np.random.default_rng(seed)
    A, B, C = random.normal(size=(points, n, n)), random.normal(size=(points, n, 2)), random.normal(size=(points, n, n))
    return hamiltonian.hamiltonian(A, B @ B.mT, C @ C.mT)


def swapped(V):
    """``J V``."""
    n = V.shape[-2] // 2
    return np.concatenate([V[:, n:], -V[:, :n]], axis=1)


@pytest.mark.parametrize("n", [1, 2, 5, 7, 10])
def test_the_basis_is_orthonormal_isotropic_and_invariant_under_the_square(n):
    H = random_hamiltonian(40, n, 1)
    V = isotropic_krylov_basis(H)
    assert np.abs(V.mT @ V - np.eye(n)).max() <= 1e-13
    assert np.abs(V.mT @ swapped(V)).max() <= 1e-13
    image = H @ (H @ V)
    left = np.linalg.norm(image - V @ (V.mT @ image), axis=(1, 2)) / np.linalg.norm(H @ H, axis=(1, 2))
    assert left.max() <= 1e-9


def test_the_basis_where_the_krylov_sequence_ends_early():
    """Two equal decoupled plants: H^2 v, H^4 v .. span half of the space only; the rest starts afresh."""
    one = random_hamiltonian(6, 2, 2)
    H = np.zeros((6, 8, 8))
    for i in (0, 1):
        for j in (0, 1):
            block = one[:, 2 * i : 2 * i + 2, 2 * j : 2 * j + 2]
            H[:, 4 * i : 4 * i + 2, 4 * j : 4 * j + 2] = H[:, 4 * i + 2 : 4 * i + 4, 4 * j + 2 : 4 * j + 4] = block
    V = isotropic_krylov_basis(H)
    assert np.abs(V.mT @ V - np.eye(4)).max() <= 1e-13
    assert np.abs(V.mT @ swapped(V)).max() <= 1e-13
    X, alone = subspace_by_square(H).X, subspace(one).X
    expected = np.zeros((6, 4, 4))
    expected[:, :2, :2] = expected[:, 2:, 2:] = alone
    np.testing.assert_allclose(X, expected, atol=1e-9 * np.abs(alone).max())


@pytest.mark.parametrize("n", [1, 3, 5, 7])
def test_both_ways_find_the_same_subspace(n):
    H = random_hamiltonian(100, n, 3)
    quick, thorough = subspace_by_square(H), subspace(H)
    size = np.abs(thorough.X).max(axis=(1, 2), keepdims=True)
    assert np.max(np.abs(quick.X - thorough.X) / size) <= 1e-8
    np.testing.assert_array_equal(quick.X, quick.X.mT)
    # The modes are eigenvectors of A - GX with eigenvalues on the left.
    closed = H[:, :n, :n] + H[:, :n, n:] @ quick.X
    poles = np.diagonal(quick.inverse @ closed @ quick.modes, axis1=-2, axis2=-1)
    rest = quick.inverse @ closed @ quick.modes - poles[:, :, None] * np.eye(n)
    assert np.all(poles.real < 0)
    condition = np.linalg.norm(quick.modes, axis=(1, 2)) * np.linalg.norm(quick.inverse, axis=(1, 2))
    assert np.all(np.abs(rest).max(axis=(1, 2)) <= 1e-8 * condition * np.abs(poles).max(axis=1))


def test_weights_decades_apart_cost_the_quick_way_digits_but_not_the_other():
    """Why there are two: over twelve decades the square loses what the eigenvectors of H keep."""
    problems = weights_over_twelve_decades(100, 6)
    equation = regulator_problem(problems.A, problems.B, problems.Q, problems.R).equation
    H = hamiltonian.hamiltonian(equation.A, equation.G, equation.Q)

    def residual(X):
        error = equation.A.mT @ X + X @ equation.A - X @ equation.G @ X + equation.Q
        return np.linalg.norm(error, axis=(1, 2)) / np.linalg.norm(X @ equation.G @ X, axis=(1, 2))

    assert np.median(residual(subspace_by_square(H).X)) > 1e3 * np.median(residual(subspace(H).X))
    np.testing.assert_array_equal(stabilising_candidate(equation), subspace(H).X)


def test_hamiltonians_without_a_stable_subspace_touch_no_neighbour():
    H = random_hamiltonian(6, 3, 4)
    alone = subspace_by_square(H)
    broken = H.copy()
    broken[1], broken[2, 0, 0], broken[3, :, :] = 0.0, np.nan, np.eye(6)
    for way in (subspace_by_square, subspace):
        with np.errstate(all="ignore"):
            X = way(broken).X
        assert np.isfinite(X[[0, 4, 5]]).all()
        assert not np.isfinite(X[2]).any()
    np.testing.assert_array_equal(subspace_by_square(broken[[0, 4, 5]]).X, alone.X[[0, 4, 5]])
    with np.errstate(all="ignore"):
        assert np.isnan(subspace(broken).X[1]).all()


def test_eigenvectors_of_a_batch_with_numbers_that_are_not_finite(monkeypatch):
    """Those points are left out at once, not found by halving the batch again and again."""
    real, calls = np.linalg.eig, []

    def counted(matrices):
        calls.append(len(matrices))
        return real(matrices)

    monkeypatch.setattr(np.linalg, "eig", counted)
    matrices = np.random.default_rng(7).normal(size=(64, 3, 3))
    matrices[[3, 40], 1, 1] = np.nan, np.inf
    values, vectors = eigenvectors_or_nan(matrices)
    assert calls == [64, 62]
    assert np.flatnonzero(np.isnan(values).any(axis=1)).tolist() == [3, 40]
    others = np.ones(64, dtype=bool)
    others[[3, 40]] = False
    np.testing.assert_allclose(
        matrices[others] @ vectors[others], vectors[others] * values[others][:, None], atol=1e-12
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_a_grid_equals_its_points_bit_for_bit(seed, n):
    H = random_hamiltonian(4, n, seed)
    together = subspace_by_square(H)
    for i in range(4):
        alone = subspace_by_square(H[i : i + 1])
        np.testing.assert_array_equal(alone.X[0], together.X[i])
        np.testing.assert_array_equal(alone.modes[0], together.modes[i])
