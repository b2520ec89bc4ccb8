import numpy as np
import pytest

from design.lqr.balance import balance_exponents
from design.lqr.hamiltonian import eigenvectors_or_nan, solve_or_nan, stabilising_candidate
from design.lqr.regulator import inverse_root, regulator_problem, scaled_equation, symmetric
from tests.design.lqr_cases import weights_over_twelve_decades


def badly_scaled(points, seed):
    random = np.random.default_rng(seed)
    unit = 10.0 ** random.uniform(-9, 9, (points, 4))
    A = random.normal(size=(points, 4, 4)) * unit[:, :, None] / unit[:, None, :]
    F = random.normal(size=(points, 4, 2)) * unit[:, :, None] * 1e3
    C = random.normal(size=(points, 4, 4)) / unit[:, None, :]
    return A, F, C.mT @ C


def hamiltonian(A, F, Q):
    return np.concatenate([np.concatenate([A, -F @ F.mT], 2), np.concatenate([-Q, -A.mT], 2)], 1)


def test_balanced_hamiltonian_has_rows_and_columns_of_like_size():
    A, F, Q = badly_scaled(40, 1)
    equation = scaled_equation(A, F, Q)
    H = np.abs(hamiltonian(equation.A, equation.F, equation.Q))
    off = H * ~np.eye(8, dtype=bool)
    ratio = np.log2(off.max(axis=2) / off.max(axis=1))
    assert np.abs(ratio).max() <= 6.0
    assert (
        np.abs(np.log2(np.abs(hamiltonian(A, F, Q)).max(axis=2) / np.abs(hamiltonian(A, F, Q)).max(axis=1))).max() > 40
    )
    assert np.all((H.max(axis=(1, 2)) <= 4.0) & (H.max(axis=(1, 2)) >= 0.1))


def test_scaling_is_exact_and_undone_exactly():
    A, F, Q = badly_scaled(10, 2)
    equation = scaled_equation(A, F, Q)
    original = equation.unscaled()
    np.testing.assert_array_equal(original.A, A)
    np.testing.assert_array_equal(original.F, F)
    np.testing.assert_array_equal(original.Q, Q)
    # The eigenvalues of the Hamiltonian only change with the unit of time.
    k = equation.time_exponent[:, None]
    scaled = np.linalg.eigvals(hamiltonian(equation.A, equation.F, equation.Q)) * 2.0**k
    found = np.sort(scaled.real, axis=1)
    np.testing.assert_allclose(found, -found[:, ::-1], rtol=1e-6)
    np.testing.assert_allclose(
        np.linalg.eigvals(equation.in_scale(A)).sum(1).real * 2.0 ** k[:, 0], np.trace(A, axis1=1, axis2=2), rtol=1e-8
    )


def test_balance_of_one_point_does_not_depend_on_its_neighbours():
    A, F, Q = badly_scaled(12, 3)
    together = balance_exponents(A, F, Q)
    for i in range(12):
        np.testing.assert_array_equal(balance_exponents(A[i : i + 1], F[i : i + 1], Q[i : i + 1])[0], together[i])


def test_balance_without_overflow():
    equation = scaled_equation(np.eye(2)[None], np.full((1, 2, 1), 1e200), np.full((1, 2, 2), 1e250))
    for matrix in (equation.A, equation.F, equation.G, equation.Q):
        assert np.isfinite(matrix).all()
    zero = np.zeros((1, 2, 2))
    np.testing.assert_array_equal(balance_exponents(zero, zero, zero), 0)


def test_inverse_root():
    random = np.random.default_rng(4)
    D = random.normal(size=(6, 3, 3))
    R = D @ D.mT * np.outer([1e-8, 1.0, 1e8], [1e-8, 1.0, 1e8])
    R[2], R[4, 0, 0] = np.diag([1.0, 1.0, 0.0]), np.nan
    S, definite = inverse_root(R)
    assert definite.tolist() == [True, True, False, True, False, True]
    unit = np.array([1e-8, 1.0, 1e8])
    for i in np.flatnonzero(definite):
        np.testing.assert_allclose((S[i] @ S[i].T @ R[i]) * unit[:, None] / unit, np.eye(3), atol=1e-7)
    assert not S[~definite].any()


def test_symmetric():
    matrices = np.array([np.eye(2), [[1.0, 2.0], [2.0 + 1e-12, 1.0]], [[1.0, 2.0], [1.9, 1.0]], [[np.inf, 0], [0, 1]]])
    assert symmetric(matrices).tolist() == [True, True, False, False]


def test_cross_term_is_removed_by_completing_the_square():
    """x'Qx + u'Ru + 2x'Nu = x'(Q - N R^-1 N')x + v'Rv with u = v - R^-1 N'x."""
    random = np.random.default_rng(5)
    A, B = random.normal(size=(3, 3)), random.normal(size=(3, 2))
    C, D = random.normal(size=(6, 3)), random.normal(size=(6, 2))
    Q, R, N = C.T @ C, D.T @ D, C.T @ D
    problem = regulator_problem(A, B, Q, R, N)
    equation = problem.equation.unscaled()
    cross = np.linalg.solve(R, N.T)
    np.testing.assert_allclose(problem.cross[0], cross, rtol=1e-10)
    np.testing.assert_allclose(equation.A[0], A - B @ cross, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(equation.Q[0], Q - N @ cross, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(equation.G[0], B @ np.linalg.inv(R) @ B.T, rtol=1e-9)


def test_candidate_solves_the_scaled_equation():
    problems = weights_over_twelve_decades(20, 6)
    equation = regulator_problem(problems.A, problems.B, problems.Q, problems.R).equation
    X = stabilising_candidate(equation)
    error = equation.A.mT @ X + X @ equation.A - X @ equation.G @ X + equation.Q
    assert np.all(np.linalg.norm(error, axis=(1, 2)) <= 1e-5 * np.linalg.norm(X @ equation.G @ X, axis=(1, 2)))
    np.testing.assert_allclose(X, X.mT, rtol=0, atol=0)


def test_candidate_without_a_stable_subspace_is_nan():
    A = np.array([np.eye(1), np.zeros((1, 1))])
    equation = scaled_equation(A, np.ones((2, 1, 1)), np.array([np.eye(1), np.zeros((1, 1))]))
    X = stabilising_candidate(equation)
    assert np.isfinite(X[0]).all()
    assert np.isnan(X[1]).all()


def test_singular_matrices_in_a_batch():
    matrix = np.array([np.eye(2), np.zeros((2, 2)), 2.0 * np.eye(2), np.full((2, 2), np.nan)])
    solution = solve_or_nan(matrix, np.ones((4, 2, 1)))
    np.testing.assert_array_equal(solution[[0, 2], :, 0], [[1.0, 1.0], [0.5, 0.5]])
    assert np.isnan(solution[[1, 3]]).all()


def test_eigenvectors_that_do_not_converge_are_one_point_only(monkeypatch):
    real = np.linalg.eig

    def refuses(matrices):
        if np.any(matrices[:, 0, 0] == 7.0):
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return real(matrices)

    matrices = np.random.default_rng(7).normal(size=(9, 3, 3))
    values, vectors = eigenvectors_or_nan(matrices)
    matrices[4, 0, 0] = 7.0
    monkeypatch.setattr(np.linalg, "eig", refuses)
    found, basis = eigenvectors_or_nan(matrices)
    others = np.arange(9) != 4
    np.testing.assert_array_equal(found[others], values[others])
    np.testing.assert_array_equal(basis[others], vectors[others])
    assert np.isnan(found[4]).all()


@pytest.mark.parametrize("size", [1, 3])
def test_real_eigenvalues_are_complex_numbers_too(size):
    values, vectors = eigenvectors_or_nan(np.tile(np.diag(np.arange(1.0, size + 1)), (2, 1, 1)))
    assert values.dtype == vectors.dtype == complex
