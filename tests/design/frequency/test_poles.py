import numpy as np

from design.frequency.poles import (
    damping_ratio,
    largest_real_part,
    least_damping_ratio,
    natural_frequency,
    pole_order,
    poles,
)


def test_poles_are_the_roots_of_the_characteristic_polynomial_in_order():
    A = np.array([[0.0, 1.0, 0.0], [-25.0, -6.0, 0.0], [0.0, 0.0, -7.0]])
    np.testing.assert_allclose(poles(A), [-7.0, -3.0 - 4.0j, -3.0 + 4.0j], atol=1e-13)


def test_order_keeps_pairs_together_when_real_parts_are_equal():
    values = np.array([2.0j, -1.0j, 1.0j, -2.0j, -3.0])
    np.testing.assert_array_equal(pole_order(values), [-3.0, -1.0j, 1.0j, -2.0j, 2.0j])


def test_order_does_not_depend_on_the_order_given():
    rng = np.random.default_rng(0)
    values = np.linalg.eigvals(rng.standard_normal((40, 7, 7))).astype(complex)
    shuffled = rng.permuted(values, axis=-1)
    np.testing.assert_array_equal(pole_order(values), pole_order(shuffled))
    pair = pole_order(values)
    lower = np.argwhere(pair.imag < 0.0)
    for i, j in lower:
        assert pair[i, j + 1] == np.conj(pair[i, j])


def test_damping_ratio_and_frequency():
    values = np.array([-3.0 + 4.0j, 3.0 - 4.0j, -2.0, 2.0, 5.0j, 0.0])
    np.testing.assert_allclose(damping_ratio(values), [0.6, -0.6, 1.0, -1.0, 0.0, 0.0])
    np.testing.assert_allclose(natural_frequency(values), [5.0, 5.0, 2.0, 2.0, 5.0, 0.0])
    assert least_damping_ratio(values) == -1.0
    assert largest_real_part(values) == 3.0


def test_grid_equals_points():
    A = np.random.default_rng(1).standard_normal((2, 3, 5, 5))
    values = poles(A)
    assert values.shape == (2, 3, 5)
    for i in np.ndindex(2, 3):
        np.testing.assert_allclose(values[i], poles(A[i]), rtol=1e-12)
        np.testing.assert_allclose(damping_ratio(values)[i], damping_ratio(poles(A[i])), rtol=1e-12)
        np.testing.assert_allclose(least_damping_ratio(values)[i], least_damping_ratio(poles(A[i])), rtol=1e-12)
        np.testing.assert_allclose(largest_real_part(values)[i], largest_real_part(poles(A[i])), rtol=1e-12)
