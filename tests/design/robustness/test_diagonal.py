import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from design.robustness.diagonal import largest_singular_value, smallest_perturbation, structured_singular_value
from tests.design.robustness.two_input_loops import sampled_mu

SPECIAL = {
    "identity": [[1, 0], [0, 1]],
    "exchange": [[0, 1], [1, 0]],
    "one entry": [[1, 0], [0, 0]],
    "triangular": [[1, 5], [0, 1]],
    "rotation": [[0.6, -0.8], [0.8, 0.6]],
    "no diagonal": [[0, 2j], [3, 0]],
    "singular": [[1, 2], [2, 4]],
    "hardly coupled": [[1.0, 1e-13], [1e-13, 0.5]],
    "equal diagonal, opposite determinant": [[1, 2], [2, -1j]],
}


def matrices(count, seed, decades=3.0):
    rng = np.random.default_rng(seed)
    M = rng.standard_normal((count, 2, 2)) + 1j * rng.standard_normal((count, 2, 2))
    return M * 10.0 ** rng.uniform(-decades, decades, (count, 2, 2))


def test_value_is_the_least_scaled_singular_value():
    M = matrices(150, seed=1, decades=1.0)
    mu = structured_singular_value(M)
    for m, value in zip(M, mu, strict=True):
        least = minimize_scalar(
            lambda t, m=m: np.linalg.norm(m * np.array([[1.0, np.exp(t)], [np.exp(-t), 1.0]]), ord=2),
            bounds=(-12.0, 12.0), method="bounded", options={"xatol": 1e-10},
        )  # fmt: skip
        assert value <= least.fun * (1.0 + 1e-13)
        np.testing.assert_allclose(value, least.fun, rtol=1e-6)


@pytest.mark.parametrize("decades", [0.0, 2.0, 6.0])
def test_the_smallest_perturbation_attains_it(decades):
    """With that, mu is bounded from below; `test_value_is_the_least_...` bounds it from above."""
    M = matrices(3000, seed=2, decades=decades)
    check_perturbation(M, structured_singular_value(M), smallest_perturbation(M))


def check_perturbation(M, mu, delta):
    np.testing.assert_allclose(np.abs(delta).max(axis=-1) * mu, 1.0, rtol=1e-14)
    a, b, c, e = M[:, 0, 0], M[:, 0, 1], M[:, 1, 0], M[:, 1, 1]
    d, f = delta.T
    terms = [np.ones_like(a), -d * a, -f * e, d * f * a * e, -d * f * b * c]
    assert np.all(np.abs(sum(terms)) <= 1e-14 * np.sum(np.abs(terms), axis=0))


@pytest.mark.parametrize("name", SPECIAL)
def test_special_matrices(name):
    M = np.array([SPECIAL[name]], dtype=complex)
    mu = structured_singular_value(M)
    above = sampled_mu(M)
    assert np.all(mu <= above * (1.0 + 1e-14))
    np.testing.assert_allclose(mu, above, rtol=1e-2)
    check_perturbation(M, mu, smallest_perturbation(M))


def test_no_perturbation_where_mu_is_zero():
    M = np.array([np.zeros((2, 2)), [[0.0, 1.0], [0.0, 0.0]]], dtype=complex)
    np.testing.assert_array_equal(structured_singular_value(M), 0.0)
    assert np.isnan(smallest_perturbation(M)).all()


def test_real_matrices_have_real_perturbations():
    M = matrices(200, seed=3).real.astype(complex)
    np.testing.assert_array_equal(smallest_perturbation(M).imag, 0.0)


def test_nothing_smaller_is_singular():
    """All phases of both channels, a thousandth below 1 / mu: the determinant keeps off zero."""
    M = matrices(40, seed=4, decades=0.5)
    turn = np.exp(2j * np.pi * np.arange(200) / 200)
    d, f = np.meshgrid(turn, turn)
    for m, mu in zip(M, structured_singular_value(M), strict=True):
        smallest = []
        for r in (0.0, 0.5, 0.9, 0.999):
            x, y = r / mu * d, r / mu * f
            determinant = (1.0 - x * m[0, 0]) * (1.0 - y * m[1, 1]) - x * y * m[0, 1] * m[1, 0]
            smallest.append(np.abs(determinant).min())
        assert smallest[-1] > 0.0
        assert smallest[-1] < 0.1
        # det is never 0 inside, so by the minimum principle its least modulus falls with the radius.
        assert np.all(np.diff(smallest) < 0.0)


def test_singular_values_are_those_of_lapack():
    M = np.concatenate([matrices(2000, seed=5), np.linalg.svd(matrices(200, seed=6, decades=0.0))[0]])
    np.testing.assert_allclose(largest_singular_value(M), np.linalg.norm(M, ord=2, axis=(1, 2)), rtol=1e-14)


def test_equal_singular_values_lose_no_digits():
    """Where both are nearly the same, the root of the quadratic equation would keep half the digits."""
    M = (np.eye(2) + 1e-9 * matrices(500, seed=7, decades=0.0)).astype(complex)
    exact = np.linalg.norm(M, ord=2, axis=(1, 2))
    np.testing.assert_allclose(largest_singular_value(M), exact, rtol=4e-16 * 4)


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 3.0))
def test_units_of_the_channels_do_not_matter(seed, decade):
    M = matrices(5, seed=seed, decades=1.0)
    scaled = M * np.array([[1.0, 10.0**decade], [10.0**-decade, 1.0]])
    mu = structured_singular_value(M)
    np.testing.assert_allclose(structured_singular_value(scaled), mu, rtol=1e-12)
    np.testing.assert_allclose(structured_singular_value(M.mT), mu, rtol=1e-12)
    assert np.all(mu <= largest_singular_value(M) * (1.0 + 1e-14))
    assert np.all(mu >= np.abs(M[:, [0, 1], [0, 1]]).max(axis=-1) * (1.0 - 1e-14))


def test_batched_is_single():
    M = matrices(12, seed=8).reshape(3, 4, 2, 2)
    for function in (structured_singular_value, largest_singular_value, smallest_perturbation):
        whole = function(M)
        for index in np.ndindex(3, 4):
            np.testing.assert_allclose(whole[index], function(M[index]), rtol=1e-12)
