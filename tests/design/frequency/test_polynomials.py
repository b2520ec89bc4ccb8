import numpy as np
import pytest

from design.frequency.polynomials import (
    evaluate,
    imaginary_cross,
    leading_zeros,
    magnitude_bound,
    nearby_power_of_two,
    powers,
    product,
    real_cross,
    roots,
    squared_magnitude,
    with_derivatives,
    with_roots,
)

RNG = np.random.default_rng(7)


@pytest.mark.parametrize("length", [2, 3, 6, 7])
def test_values_on_the_axis(length):
    p, q = RNG.standard_normal((2, 4, length))
    w = RNG.uniform(0.1, 2.0, (4, 5))
    P, Q = evaluate(p, 1j * w), evaluate(q, 1j * w)
    np.testing.assert_allclose(P, [[np.polyval(a, 1j * x) for x in b] for a, b in zip(p, w, strict=True)], rtol=1e-12)
    np.testing.assert_allclose(evaluate(squared_magnitude(p), w**2), np.abs(P) ** 2, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(evaluate(real_cross(p, q), w**2), (P * np.conj(Q)).real, rtol=1e-9, atol=1e-10)
    imaginary = evaluate(imaginary_cross(p, q), w**2) * w
    np.testing.assert_allclose(imaginary, (P * np.conj(Q)).imag, rtol=1e-9, atol=1e-10)


def test_product_and_derivatives():
    p, q = RNG.standard_normal((2, 5, 6))
    np.testing.assert_allclose(product(p, q), [np.polymul(a, b) for a, b in zip(p, q, strict=True)], rtol=1e-12)
    taylor = with_derivatives(p)
    for i in (0, 1, 2):
        np.testing.assert_allclose(taylor[:, i, i:], [np.polyder(a, i) for a in p], rtol=1e-12)
        assert not np.any(taylor[:, i, :i])


def test_powers_evaluate():
    p, x = RNG.standard_normal((3, 5)), np.array([-2.0, 0.0, 1.5])
    np.testing.assert_allclose((p.T * powers(x, 5)).sum(axis=0), evaluate(p, x[:, None])[:, 0], rtol=1e-13)


def test_magnitude_bound_is_no_less_than_the_value():
    p, s = RNG.standard_normal((4, 6)), RNG.standard_normal((4, 3)) + 1j * RNG.standard_normal((4, 3))
    assert np.all(np.abs(evaluate(p, s)) <= magnitude_bound(p, s) * (1 + 1e-14))


def test_roots_of_mixed_degrees():
    p = np.array(
        [
            np.poly([-1.0, -2.0, 3.0, 4.0]),
            np.concatenate([[0.0, 0.0], 5.0 * np.poly([-0.5, 2.0])]),
            np.concatenate([[0.0], np.poly([-3.0, 7.0]), [0.0]]),
            [0.0, 0.0, 0.0, 0.0, 2.0],
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    found = np.sort(roots(p).real, axis=-1)
    nan = np.nan
    expected = [[-2, -1, 3, 4], [-0.5, 2, nan, nan], [-3, 0, 7, nan], [nan] * 4, [nan] * 4, [0, 0, 0, 0]]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert leading_zeros(p).tolist() == [0, 2, 1, 4, 5, 0]


def test_roots_of_a_wide_spread_keep_their_digits():
    wanted = np.array([-1e-4, -1.0, -30.0, -2e3, -1e6])
    found = np.sort(roots(np.poly(wanted)).real)
    np.testing.assert_allclose(found, np.sort(wanted), rtol=1e-9)


def test_roots_of_a_grid_equal_those_of_its_points():
    p = RNG.standard_normal((2, 3, 6))
    p[0, 1, :2] = 0.0
    p[1, 2, -1] = 0.0
    found = roots(p)
    for i in np.ndindex(2, 3):
        np.testing.assert_allclose(found[i], roots(p[i]), rtol=1e-10)


def test_nearby_power_of_two():
    assert nearby_power_of_two(np.array([700.0, 1.0, 0.0, 0.3])).tolist() == [512.0, 1.0, 1.0, 0.25]


def test_polynomial_of_its_roots():
    wanted = np.array([[-1.0, -2.0 + 3.0j, -2.0 - 3.0j, 4.0], [0.0, 0.0, 1e3j, -1e3j]])
    np.testing.assert_allclose(with_roots(wanted), [np.poly(r).real for r in wanted], rtol=1e-13)
