"""The normal form's polynomials against eigenvalues of the loop in state space."""

import numpy as np
import pytest

from design.classical.controller import ClassicalController
from design.classical.normal_form import NormalForm
from design.classical.synthesis import gain_values
from design.classical.tab_drive import tab_drive
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from model.polynomial_product import times

CONTROLLERS = {
    "nf": ClassicalController("nf", "negative_feedback", rate_filter=600.0),
    "nf_measured": ClassicalController("nf", "negative_feedback"),
    "pf": ClassicalController("pf", "positive_feedback"),
}
NAMES = {"negative_feedback": ("K_d", "K_p", "K_i"), "positive_feedback": ("K_f", "K_i")}


@pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS)
def test_closed_loop_polynomial_has_the_loop_s_poles(plant_b, tab_actuator, controller):
    form = NormalForm.of(plant_b.servo, tab_drive(tab_actuator, controller.tab_command), controller)
    kappa = np.random.default_rng(4).uniform(0.1, 1.5, (*plant_b.grid.shape, form.numerators.shape[-2]))
    names = NAMES[controller.kind]
    gains = [Gain(n, "", v) for n, v in zip(names, np.moveaxis(form.gains(kappa), -1, 0), strict=True)]
    loop = tab_loop(plant_b.model, plant_b.servo, tab_actuator, controller, gain_values(tuple(gains)))
    polynomial = form.denominator + np.einsum("...j,...jn->...n", kappa, form.numerators)
    for index in np.ndindex(plant_b.grid.shape):
        expected = np.sort_complex(np.linalg.eigvals(loop.closed[index]))
        ours = np.sort_complex(np.roots(polynomial[index]) * form.frequency[index])
        np.testing.assert_allclose(ours, expected, rtol=1e-7)


@pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS)
def test_loop_transfer_equals_the_cut_at_the_actuator(plant_b, tab_actuator, controller):
    form = NormalForm.of(plant_b.servo, tab_drive(tab_actuator, controller.tab_command), controller)
    kappa = np.full((*plant_b.grid.shape, form.numerators.shape[-2]), 0.7)
    gains = [Gain(n, "", v) for n, v in zip(NAMES[controller.kind], np.moveaxis(form.gains(kappa), -1, 0), strict=True)]
    cut = tab_loop(plant_b.model, plant_b.servo, tab_actuator, controller, gain_values(tuple(gains))).cut("tab")
    index, x = (1, 1), 0.8j
    s = x * form.frequency[index]
    expected = cut.c[index] @ np.linalg.solve(s * np.eye(cut.A.shape[-1]) - cut.A[index], cut.b[index])
    L = kappa[index] @ [np.polyval(n, x) for n in form.numerators[index]] / np.polyval(form.denominator[index], x)
    assert pytest.approx(expected, rel=1e-9) == L


def test_times_is_polynomial_multiplication():
    rng = np.random.default_rng(0)
    p, q = rng.standard_normal((5, 4)), rng.standard_normal((5, 3))
    expected = [np.polymul(a, b) for a, b in zip(p, q, strict=True)]
    np.testing.assert_allclose(times(p, q), expected, rtol=1e-13)


def test_batched_equals_single(plant_a, tab_actuator):
    drive, controller = tab_drive(tab_actuator, "deflection"), CONTROLLERS["nf"]
    whole = NormalForm.of(plant_a.servo, drive, controller)
    one = NormalForm.of(plant_a.servo.take((0, 2)), drive, controller)
    np.testing.assert_array_equal(whole.take((0, 2)).numerators, one.numerators)
    np.testing.assert_array_equal(whole.take((0, 2)).denominator, one.denominator)
