import numpy as np
import pytest

from model.hinge_moments.camber import mean_line
from model.hinge_moments.derivatives import Derivatives, first_order
from model.hinge_moments.expansion import Angles
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from tests.model.hinge_moments.tables import assert_batched_is_single, gradient_by_differences, random_angles

NUMBERS = {
    "C_Ha_0": -0.002, "C_Ha_alpha": -0.05, "C_Ha_da": 0.08, "C_Ha_dt": 0.12,
    "C_Ht_0": -0.0001, "C_Ht_alpha": -0.004, "C_Ht_da": 0.006, "C_Ht_dt": 0.01,
}  # fmt: skip


def test_each_number_stands_where_its_name_says():
    source = Derivatives(**NUMBERS, alpha0=0.08, da0=0.1, dt0=-0.05)
    moments = source.at(0.08 + 0.01, -0.05 + 0.02, 0.1 + 0.03)
    np.testing.assert_allclose(moments.value[1], -0.002 - 0.05 * 0.01 + 0.12 * 0.02 + 0.08 * 0.03, rtol=1e-14)
    np.testing.assert_allclose(moments.value[0], -0.0001 - 0.004 * 0.01 + 0.01 * 0.02 + 0.006 * 0.03, rtol=1e-14)
    np.testing.assert_array_equal(moments.gradient, [[-0.004, 0.01, 0.006], [-0.05, 0.12, 0.08]])
    np.testing.assert_array_equal(source.at(0.08, -0.05, 0.1).value, [-0.0001, -0.002])


def test_gradient_is_the_derivative_of_the_value():
    source, angles = Derivatives(**NUMBERS, alpha0=0.2), random_angles((4, 5))
    np.testing.assert_allclose(source.at(*angles).gradient, gradient_by_differences(source, *angles), atol=1e-9)


@pytest.mark.parametrize("about", [Angles(), Angles(0.1, -0.2, 0.3)])
def test_first_order_of_a_linear_theory_is_the_theory(about):
    theory = ThinAerofoil(0.7, 0.88, mean_line("NACA 23012"))
    numbers, angles = first_order(theory, about), random_angles((20,))
    np.testing.assert_allclose(numbers.at(*angles).value, theory.at(*angles).value, atol=1e-16)
    np.testing.assert_array_equal(numbers.at(*angles).gradient, theory.at(*angles).gradient)
    assert numbers.alpha0 == about.alpha


def test_first_order_touches_a_source_that_is_not_linear(polynomial_source):
    about = Angles(0.1, -0.2, 0.15)
    numbers, step = first_order(polynomial_source, about), 1e-4
    far = numbers.at(0.1 + step, -0.2, 0.15 - step).value - polynomial_source.at(0.1 + step, -0.2, 0.15 - step).value
    assert np.max(np.abs(far)) < 10 * step**2


def test_numbers_may_be_arrays():
    source = Derivatives(**(NUMBERS | {"C_Ha_dt": np.array([0.1, 0.12, 0.2])}))
    whole = source.at(0.1, 0.2, 0.3)
    assert whole.gradient.shape == (3, 2, 3)
    single = Derivatives(**(NUMBERS | {"C_Ha_dt": 0.2})).at(0.1, 0.2, 0.3)
    np.testing.assert_array_equal(whole.take(2).value, single.value)


def test_covers_every_angle():
    source = Derivatives(**NUMBERS)
    assert source.covers(0.1, np.zeros((2, 1)), np.zeros(3)).shape == (2, 3)
    assert source.covers(3.0, -3.0, 3.0)
    assert ThinAerofoil(0.7, 0.88).covers(3.0, -3.0, 3.0)
    assert source.domain == ThinAerofoil(0.7, 0.88).domain == "every angle"


@pytest.mark.parametrize("name", [*NUMBERS, "alpha0", "da0", "dt0"])
def test_numbers_must_be_finite(name):
    with pytest.raises(ValueError, match=f"{name} must be finite"):
        Derivatives(**(NUMBERS | {name: np.nan}))


def test_batched_equals_single():
    assert_batched_is_single(Derivatives(**NUMBERS, dt0=0.1), random_angles((3, 4)))
