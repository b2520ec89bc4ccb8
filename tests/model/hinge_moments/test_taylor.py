import time

import numpy as np
import pytest

from model.hinge_moments.camber import mean_line
from model.hinge_moments.expansion import Angles
from model.hinge_moments.table import table_of_rows
from model.hinge_moments.taylor import MAX_ORDER, fit_taylor
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from tests.model.hinge_moments.tables import (
    assert_batched_is_single,
    gradient_by_differences,
    grid_angles,
    random_angles,
    tabulate,
    uneven_grid,
)

THEORY = ThinAerofoil(0.7, 0.88, mean_line("NACA 23012"))
SCATTERED = np.random.default_rng(8).uniform(-0.4, 0.4, (300, 3))


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("rows", [uneven_grid(), SCATTERED])
@pytest.mark.parametrize("about", [None, Angles(0.08, -0.1, 0.2)])
def test_thin_aerofoil_as_a_table_is_itself(order, rows, about):
    fit = fit_taylor(tabulate(THEORY, rows), order, about)
    angles = random_angles((5, 6))
    np.testing.assert_allclose(fit.at(*angles).gradient, THEORY.at(*angles).gradient, rtol=1e-10, atol=1e-13)
    np.testing.assert_allclose(fit.at(*angles).value, THEORY.at(*angles).value, rtol=1e-10, atol=1e-14)
    assert fit.report.C_Ha.largest < 1e-15
    assert fit.report.C_Ht.percent_of_range < 1e-9


@pytest.mark.parametrize("about", [Angles(), Angles(0.1, -0.2, 0.1)])
def test_order_three_is_the_polynomial_source_itself(polynomial_source, about):
    # The made-up source is a polynomial of order three: offset, three powers of each angle, their product.
    fit = fit_taylor(tabulate(polynomial_source, uneven_grid()), 3, about)
    angles = random_angles((40,), within=0.5)
    np.testing.assert_allclose(fit.at(*angles).value, polynomial_source.at(*angles).value, atol=1e-13)
    np.testing.assert_allclose(fit.at(*angles).gradient, polynomial_source.at(*angles).gradient, atol=1e-12)
    assert len(fit.polynomial.terms) == 20
    constant = polynomial_source.at(about.alpha, about.dt, about.da)
    np.testing.assert_allclose(fit.polynomial.coefficients[:, 0], constant.value, atol=1e-14)
    by_name = dict(zip(fit.polynomial.terms, fit.polynomial.coefficients.T, strict=True))
    np.testing.assert_allclose(by_name["dt"], constant.gradient[:, 1], atol=1e-12)
    np.testing.assert_allclose(by_name["alpha dt da"], [1.0, 1.0], atol=1e-10)


def test_without_a_window_the_point_of_expansion_is_only_a_way_of_writing():
    table, angles = xfoil_naca23012(), random_angles((30,), within=0.3)
    here, there = fit_taylor(table, 3), fit_taylor(table, 3, Angles(0.05, 0.1, -0.2))
    np.testing.assert_allclose(here.at(*angles).value, there.at(*angles).value, atol=1e-14)
    assert here.report.C_Ha.largest == pytest.approx(there.report.C_Ha.largest, rel=1e-9)


def test_a_point_of_expansion_far_from_the_rows_does_no_harm():
    table, angles = xfoil_naca23012(), random_angles((30,), within=0.3)
    here, there = fit_taylor(table, 6), fit_taylor(table, 6, Angles(1.0, 1.0, 1.0))
    np.testing.assert_allclose(here.at(*angles).value, there.at(*angles).value, atol=1e-9)


def test_least_squares_is_numpys():
    table = xfoil_naca23012(1_000_000)
    fit = fit_taylor(table, 1)
    design = np.column_stack([np.ones(len(table.angles)), table.angles])
    expected = np.linalg.lstsq(design, table.coefficients, rcond=None)[0]
    np.testing.assert_allclose(fit.polynomial.coefficients, expected.T, rtol=1e-10)
    error = design @ expected - table.coefficients
    report = fit.report.C_Ha
    assert report.largest == pytest.approx(np.abs(error[:, 1]).max())
    assert report.rms == pytest.approx(np.sqrt(np.mean(error[:, 1] ** 2)))
    assert report.percent_of_range == pytest.approx(100 * report.largest / np.ptp(table.coefficients[:, 1]))
    assert (fit.report.kind, fit.report.rows_used, fit.report.rows_outside_window) == ("residual", 242, 0)


@pytest.mark.parametrize("order", [1, 2, 4, MAX_ORDER])
def test_gradient_is_the_derivative_of_the_value(order):
    fit, angles = fit_taylor(xfoil_naca23012(), order, Angles(0.05, 0.0, 0.1)), random_angles((50,))
    np.testing.assert_allclose(fit.at(*angles).gradient, gradient_by_differences(fit, *angles), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("order", [1, 3, MAX_ORDER])
def test_batched_equals_single(order):
    assert_batched_is_single(fit_taylor(xfoil_naca23012(), order), random_angles((5, 4), within=0.4))


def test_window_keeps_the_rows_near_the_trim_and_their_hull():
    deg = np.deg2rad(1.0)
    about, window = Angles(5 * deg, 0.0, 10 * deg), Angles(np.inf, 10 * deg, 5 * deg)
    fit = fit_taylor(xfoil_naca23012(), 2, about, window)
    assert fit.report.rows_used == 2 * 7 * 3
    assert fit.report.rows_outside_window == 242 - 42
    assert fit.domain == "alpha 0 to 5, tab -10 to 10, aileron 5 to 15 deg"
    np.testing.assert_array_equal(fit.covers(0.05, 0.0, np.array([10.0, 15.0, 15.1]) * deg), [True, True, False])
    # A window of the same size sees less of the curve than the whole table.
    assert fit.report.C_Ha.largest < 0.3 * fit_taylor(xfoil_naca23012(), 2).report.C_Ha.largest
    with pytest.raises(ValueError, match=r"no row .* about alpha, tab, aileron = 5, 0, 12 deg"):
        fit_taylor(xfoil_naca23012(), 1, Angles(5 * deg, 0.0, 12 * deg), Angles(deg, deg, deg))


def test_powers_that_the_levels_cannot_tell_apart_are_left_out_by_name(polynomial_source):
    fit = fit_taylor(xfoil_naca23012(), 2)
    assert fit.report.notes == ("too few different angles for the terms alpha^2: they are left out",)
    assert "alpha^2" not in fit.polynomial.terms
    assert {"alpha", "alpha dt", "dt da", "dt^2"} < set(fit.polynomial.terms)
    few = fit_taylor(tabulate(polynomial_source, grid_angles([0, 0.1], [0, 0.1], [0, 0.1])), 5)
    assert len(few.polynomial.terms) == 8
    assert few.report.C_Ha.largest < 1e-15
    assert "and 42 more" in few.report.notes[0]


def test_one_incidence_is_handled_and_told(polynomial_source):
    fit = fit_taylor(tabulate(polynomial_source, grid_angles([0.1], np.linspace(-0.3, 0.3, 5), [-0.2, 0.0, 0.2])), 2)
    assert "one incidence only (5.72958 deg)" in fit.report.notes[0]
    np.testing.assert_array_equal(fit.at(0.1, 0.05, 0.02).gradient[:, 0], 0.0)
    np.testing.assert_array_equal(fit.covers(np.array([0.1, 0.0]), 0.0, 0.0), [True, False])


@pytest.mark.parametrize(
    ("angles", "order", "message"),
    [
        (grid_angles([0, 0.1], [0.1], [0, 0.1]), 1, r"one tab angle only \(5\.72958 deg\)"),
        (grid_angles([0, 0.1], [0, 0.1], [-0.1]), 1, r"one aileron angle only \(-5\.72958 deg\)"),
        (np.array([[0, 0, 0], [0.1, 0.1, 0.1], [0.2, 0.2, 0.4]]), 1, "3 rows cannot determine the 4 terms"),
        (np.linspace(0, 0.4, 9)[:, None] * [0, 1, 2], 1, "do not tell the terms dt, da apart"),
        (np.linspace(0, 0.4, 9)[:, None] * [1, 1, 1] + [0, 0, 0.1], 1, "do not tell the terms"),
        (SCATTERED * [1, 1, 1e-6] + SCATTERED[:, [0, 1, 1]] * [0, 0, 1], 1, "terms dt, da apart"),
        (uneven_grid(), 0, "must be 1 to 6, not 0"),
        (uneven_grid(), 7, "must be 1 to 6, not 7"),
    ],
)
def test_rows_that_do_not_suffice_are_refused(angles, order, message):
    with pytest.raises(ValueError, match=message):
        fit_taylor(tabulate(THEORY, angles), order)


@pytest.mark.parametrize("about", [Angles(np.nan), Angles(0.0, np.inf)])
def test_point_of_expansion_must_be_finite(about):
    with pytest.raises(ValueError, match="point of expansion"):
        fit_taylor(xfoil_naca23012(), 1, about)
    with pytest.raises(ValueError, match="must be numbers"):
        fit_taylor(xfoil_naca23012(), 1, window=Angles(np.nan, 1.0, 1.0))


def test_a_constant_coefficient_has_no_range_and_no_error():
    alpha, dt, da = uneven_grid().T
    fit = fit_taylor(table_of_rows(alpha=alpha, da=da, dt=dt, C_Ha=da, C_Ht=np.zeros(len(da))))
    assert fit.report.C_Ht.value_range == 0.0
    assert fit.report.C_Ht.percent_of_range == fit.report.C_Ht.rms_percent_of_range == 0.0


def test_a_million_rows(polynomial_source):
    rng = np.random.default_rng(0)
    angles = rng.uniform(-0.4, 0.4, (1_000_000, 3))
    begin = time.perf_counter()
    fit = fit_taylor(tabulate(polynomial_source, angles), 3)
    assert time.perf_counter() - begin < 60.0
    assert fit.report.rows_used + fit.report.count.merged == 1_000_000
    assert fit.report.C_Ha.largest < 1e-9  # angles closer than that are one
    assert fit.covers(0.0, 0.0, 0.0)
    assert not fit.covers(0.41, 0.0, 0.0)
