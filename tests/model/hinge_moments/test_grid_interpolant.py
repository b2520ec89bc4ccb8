import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, RegularGridInterpolator

from model.hinge_moments.angle_grid import angle_grid
from model.hinge_moments.axis_weights import axis_of
from model.hinge_moments.camber import mean_line
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.read_table import read_table
from model.hinge_moments.table import table_of_rows
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
KINDS = ["multilinear", "cubic"]
LEVELS = np.array([-0.4, -0.25, -0.2, 0.0, 0.03, 0.2, 0.4])


@pytest.mark.parametrize("kind", KINDS)
def test_thin_aerofoil_as_a_table_is_itself_also_beyond_the_table(kind):
    table = tabulate(THEORY, uneven_grid())
    fit = fit_interpolant(table, kind)
    for angles in (random_angles((5, 6)), table.angles.T, random_angles((50,), within=0.8)):
        np.testing.assert_allclose(fit.at(*angles).gradient, THEORY.at(*angles).gradient, rtol=1e-9, atol=1e-13)
        np.testing.assert_allclose(fit.at(*angles).value, THEORY.at(*angles).value, rtol=1e-10, atol=1e-14)
    assert fit.report.C_Ha.largest < 1e-15


@pytest.mark.parametrize("kind", KINDS)
def test_goes_through_its_rows(polynomial_source, kind):
    table = tabulate(polynomial_source, uneven_grid())
    np.testing.assert_allclose(fit_interpolant(table, kind).at(*table.angles.T).value, table.coefficients, atol=1e-16)


def test_multilinear_is_scipys(polynomial_source):
    table, angles = tabulate(polynomial_source, uneven_grid()), random_angles((200,))
    grid = angle_grid(table)
    expected = RegularGridInterpolator(grid.levels, grid.nodes)(angles.T)
    np.testing.assert_allclose(fit_interpolant(table, "multilinear").at(*angles).value, expected, atol=1e-16)


@pytest.mark.parametrize("levels", [LEVELS, LEVELS[:4], LEVELS[:3]])
def test_cubic_axis_is_scipys_hermite_spline_with_the_slopes_of_parabolas(levels):
    values = np.sin(7 * levels)
    # numpy's gradient of second order is the slope of the parabola through three levels, at the ends too.
    spline = CubicHermiteSpline(levels, values, np.gradient(values, levels, edge_order=2))
    x = np.linspace(levels[0], levels[-1], 301)
    weights = axis_of(levels, "cubic").at(x)
    np.testing.assert_allclose(np.sum(weights.weight * values[weights.level], -1), spline(x), atol=1e-14)
    np.testing.assert_allclose(np.sum(weights.slope * values[weights.level], -1), spline(x, 1), atol=1e-12)


def test_cubic_is_exact_for_parabolas_and_smooth(polynomial_source):
    alpha, dt, da = uneven_grid().T

    def tab(a, t, d):
        return 0.1 + a * t + 3 * d**2 - 2 * t**2 + a * t * d**2

    fit = fit_interpolant(table_of_rows(alpha=alpha, da=da, dt=dt, C_Ht=tab(alpha, dt, da), C_Ha=da), "cubic")
    angles = random_angles((60,))
    np.testing.assert_allclose(fit.at(*angles).value[:, 0], tab(*angles), atol=1e-14)
    # The gradient is continuous at the levels.
    fit = fit_interpolant(tabulate(polynomial_source, uneven_grid()), "cubic")
    for k in range(3):
        levels = angle_grid(tabulate(polynomial_source, uneven_grid())).levels[k]
        here = np.repeat(np.full((3, 1), 0.01), len(levels), axis=1)
        before, after = here.copy(), here.copy()
        before[k], after[k] = levels - 1e-9, levels + 1e-9
        jump = fit.at(*after).gradient - fit.at(*before).gradient
        assert np.max(np.abs(jump)) < 1e-7


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("within", [0.34, 0.6])
def test_gradient_is_the_derivative_of_the_value(kind, within):
    fit, angles = fit_interpolant(xfoil_naca23012(), kind), random_angles((200,), 4, within)
    np.testing.assert_allclose(fit.at(*angles).gradient, gradient_by_differences(fit, *angles), rtol=1e-5, atol=1e-8)


def test_multilinear_gradient_at_a_level_is_the_central_difference(polynomial_source):
    table = tabulate(polynomial_source, uneven_grid())
    fit = fit_interpolant(table, "multilinear")
    inner = table.angles[np.all((table.angles > -0.37) & (table.angles < 0.37), axis=-1)].T
    assert inner.shape[1] == 3 * 5 * 4
    by_differences = gradient_by_differences(fit, *inner, step=1e-5)
    np.testing.assert_allclose(fit.at(*inner).gradient, by_differences, atol=1e-10)
    # A rounding of the angle does not choose a side.
    np.testing.assert_allclose(fit.at(*(inner + 1e-15)).gradient, by_differences, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_goes_on_straight_beyond_the_table(polynomial_source, kind):
    fit = fit_interpolant(tabulate(polynomial_source, uneven_grid()), kind)
    edge, step = fit.hull.upper[1], np.array([0.0, 0.1, 0.2])
    moments = fit.at(0.05, edge + step, 0.02)
    np.testing.assert_allclose(np.diff(moments.value, 2, axis=0), 0.0, atol=1e-15)
    np.testing.assert_allclose(moments.gradient[0, :, 1], moments.gradient[2, :, 1], rtol=1e-12)
    np.testing.assert_array_equal(fit.covers(0.05, edge + step, 0.02), [True, False, False])


@pytest.mark.parametrize("kind", KINDS)
def test_batched_equals_single(kind):
    assert_batched_is_single(fit_interpolant(xfoil_naca23012(), kind), random_angles((5, 4), within=0.4))
    assert_batched_is_single(fit_interpolant(xfoil_naca23012(), kind), xfoil_naca23012().angles[::7].T[:, None, :])


@pytest.mark.parametrize("kind", KINDS)
def test_many_points_are_taken_in_blocks(kind):
    fit, angles = fit_interpolant(xfoil_naca23012(), kind), random_angles((101, 99))
    whole, half = fit.at(*angles), fit.at(*angles[:, 50:])
    np.testing.assert_array_equal(whole.value[50:], half.value)
    np.testing.assert_array_equal(whole.gradient[50:], half.gradient)


@pytest.mark.parametrize("kind", KINDS)
def test_error_is_that_of_rows_left_out(kind):
    # By hand: one level of the aileron left out, predicted by scipy from the others.
    table = xfoil_naca23012()
    grid = angle_grid(table)
    fit, worst = fit_interpolant(table, kind), 0.0
    for axis in (1, 2):
        lines = np.moveaxis(grid.nodes[..., 1], axis, -1)
        for level in range(1, 10):
            x, y = np.delete(grid.levels[axis], level), np.delete(lines, level, axis=-1)
            if kind == "cubic":
                slopes = np.gradient(y, x, axis=-1, edge_order=2)
                found = CubicHermiteSpline(x, y, slopes, axis=-1)(grid.levels[axis][level])
            else:
                found = RegularGridInterpolator((x,), np.moveaxis(y, -1, 0))([grid.levels[axis][level]])[0]
            worst = max(worst, np.abs(found - lines[..., level]).max())
    assert fit.report.kind == "left_out"
    assert fit.report.C_Ha.largest == pytest.approx(worst, rel=1e-9)
    assert 0 < fit.report.C_Ha.rms < worst
    assert 2.5 < fit.report.C_Ha.percent_of_range < 3.6


def test_two_levels_leave_nothing_to_judge_by(polynomial_source):
    fit = fit_interpolant(tabulate(polynomial_source, grid_angles([0, 0.1], [0, 0.1], [0, 0.1])), "cubic")
    assert np.isnan(fit.report.C_Ha.largest)
    assert fit.report.notes == (
        "two levels only, joined straight: alpha, tab, aileron",
        "no angle has three levels, so no row lies between others and the error cannot be estimated",
    )


@pytest.mark.parametrize("kind", KINDS)
def test_one_incidence_is_handled_and_told(polynomial_source, kind):
    fit = fit_interpolant(tabulate(polynomial_source, grid_angles([0.1], LEVELS, LEVELS)), kind)
    assert "one incidence only" in fit.report.notes[0]
    moments = fit.at(0.1, LEVELS[3], LEVELS[2])
    np.testing.assert_allclose(moments.value, polynomial_source.at(0.1, LEVELS[3], LEVELS[2]).value, atol=1e-16)
    np.testing.assert_array_equal(moments.gradient[:, 0], 0.0)
    np.testing.assert_array_equal(fit.covers([0.1, 0.2], 0.0, 0.0), [True, False])


def test_gaps_are_counted_and_the_first_named():
    text = "alpha_deg,da_deg,dt_deg,C_Ha,C_Ht\n" + "".join(
        f"{a},{d},{t},{'' if (a, d, t) in ((0, 5, -10), (5, -5, 10), (5, 0, 10)) else 0.1},0\n"
        for a in (0, 5)
        for d in (-5, 0, 5)
        for t in (-10, 10)
    )
    table = read_table(text)
    assert table.count.without_coefficients == 3
    message = (
        r"every combination of 2 alphas, 2 tab and 3 aileron angles; 3 of 12 are missing, the first at "
        r"\(alpha, tab, aileron\) = \(0, -10, 5\), \(5, 10, -5\), \(5, 10, 0\) deg"
    )
    with pytest.raises(ValueError, match=message):
        fit_interpolant(table)


def test_scattered_rows_are_refused_at_once():
    angles = np.random.default_rng(0).uniform(-0.4, 0.4, (20_000, 3))
    with pytest.raises(ValueError, match=r"79\d+ of 79\d+ are missing, the first at"):
        fit_interpolant(tabulate(THEORY, angles))


@pytest.mark.parametrize(
    ("angles", "kind", "message"),
    [
        (grid_angles([0, 0.1], [0.1], [0, 0.1]), "cubic", "one tab angle only"),
        (grid_angles([0, 0.1], [0, 0.1], [0.0]), "multilinear", "one aileron angle only"),
        (uneven_grid(), "quintic", "must be one of"),
    ],
)
def test_tables_that_do_not_suffice_are_refused(angles, kind, message):
    with pytest.raises(ValueError, match=message):
        fit_interpolant(tabulate(THEORY, angles), kind)


def test_a_million_rows(polynomial_source):
    levels = np.linspace(-0.4, 0.4, 100)
    table = tabulate(polynomial_source, grid_angles(levels, levels, levels))
    fit = fit_interpolant(table, "cubic")
    angles = random_angles((1000,))
    np.testing.assert_allclose(fit.at(*angles).value, polynomial_source.at(*angles).value, atol=1e-6)
    # The error that leaving rows out tells is an upper bound of the true one.
    true = np.max(np.abs(fit.at(*angles).value - polynomial_source.at(*angles).value), axis=0)
    assert true[0] < fit.report.C_Ht.largest < 1e-5
    assert true[1] < fit.report.C_Ha.largest < 1e-5
