import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from model.hinge_moments.camber import mean_line
from model.hinge_moments.mean_line_table import MAX_POINTS, mean_line_of_points
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from tests.model.hinge_moments.test_thin_aerofoil import ANGLES, load_moment

WAVY_X = np.array([0.0, 0.1, 0.25, 0.5, 0.72, 0.9, 1.0])
WAVY_Z = np.array([0.0, 0.02, 0.035, 0.03, 0.012, -0.002, 0.0])


def cosine_points(n):
    x = 0.5 * (1 - np.cos(np.linspace(0, np.pi, n)))
    return np.where(np.arange(n) == n - 1, 1.0, x)


def test_mean_line_is_the_spline_through_the_points():
    line, x = mean_line_of_points(WAVY_X, WAVY_Z), np.linspace(0, 1, 201)
    spline = CubicSpline(WAVY_X, WAVY_Z)
    np.testing.assert_allclose(line.ordinate(x), spline(x), atol=1e-14)
    np.testing.assert_allclose(line.slope(x), spline(x, 1), atol=1e-13)


def test_its_pressure_integrates_to_its_hinge_moments():
    source = ThinAerofoil(0.7, 0.88, mean_line_of_points(WAVY_X, WAVY_Z))
    value = source.at(*ANGLES).value
    assert -load_moment(source, 0.88, ANGLES) == pytest.approx(value[0], abs=1e-10)
    assert -load_moment(source, 0.70, ANGLES) == pytest.approx(value[1], abs=1e-10)


@pytest.mark.parametrize("section", ["NACA 23012", "NACA 2412"])
def test_a_known_line_given_by_points_has_its_hinge_moments(section):
    known = mean_line(section)
    x = cosine_points(101)
    table = ThinAerofoil(0.7, 0.88, mean_line_of_points(x, known.ordinate(x)))
    np.testing.assert_allclose(table.offset, ThinAerofoil(0.7, 0.88, known).offset, rtol=1e-7)


def test_the_chord_line_joins_the_ends():
    tilted = mean_line_of_points(WAVY_X, WAVY_Z + 0.01 - 0.03 * WAVY_X)
    x = np.linspace(0, 1, 50)
    np.testing.assert_allclose(tilted.ordinate(x), mean_line_of_points(WAVY_X, WAVY_Z).ordinate(x), atol=1e-15)


@pytest.mark.parametrize(
    ("x", "z", "message"),
    [
        ([0.0, 0.5, 1.0], [0.0, 0.1, 0.0], "needs 4 to 500 points"),
        (np.linspace(0, 1, MAX_POINTS + 1), np.zeros(MAX_POINTS + 1), "needs 4 to 500 points"),
        (WAVY_X, WAVY_Z[:-1], "needs 4 to 500 points"),
        (WAVY_X + 0.1, WAVY_Z, "x must increase from 0"),
        (WAVY_X[::-1], WAVY_Z, "x must increase from 0"),
        (WAVY_X, 100 * WAVY_Z, "none may exceed 0.5"),
        (WAVY_X, np.nan * WAVY_Z, "must be finite"),
    ],
)
def test_impossible_lines_are_refused(x, z, message):
    with pytest.raises(ValueError, match=message):
        mean_line_of_points(x, z)


def test_points_that_nearly_coincide_are_refused():
    with pytest.raises(ValueError, match="too close together"):
        mean_line_of_points(np.array([0.0, 5e-324, 0.5, 1.0]), np.array([0.0, 0.05, 0.02, 0.0]))
