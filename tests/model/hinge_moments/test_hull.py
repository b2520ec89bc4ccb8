import numpy as np
import pytest
from scipy.optimize import linprog

from model.hinge_moments.hull import hull_of
from tests.model.hinge_moments.tables import grid_angles, random_angles

DEG = np.deg2rad(1.0)


def test_grid_is_a_box():
    hull = hull_of(grid_angles([0.0, 5 * DEG], np.linspace(-20, 20, 5) * DEG, [-10 * DEG, 0.0, 15 * DEG]))
    assert len(hull.offsets) == 0
    assert hull.contains(5 * DEG, 20 * DEG, -10 * DEG)
    assert str(hull) == "alpha 0 to 5, tab -20 to 20, aileron -10 to 15 deg"
    np.testing.assert_array_equal(
        hull.contains([2 * DEG, 5.1 * DEG, 2 * DEG], [0.0, 0.0, 20.1 * DEG], 0.0), [True, False, False]
    )


def inside_by_linear_programme(rows, point):
    """Whether a point is a convex combination of the rows."""
    system = np.vstack([rows.T, np.ones(len(rows))])
    return linprog(np.zeros(len(rows)), A_eq=system, b_eq=[*point, 1.0]).status == 0


@pytest.mark.parametrize("flat", [False, True])
def test_scattered_rows_have_the_hull_of_their_combinations(flat):
    rows = np.random.default_rng(1).normal(0.0, 0.1, (40, 3))
    if flat:
        rows[:, 0] = 0.05
    hull, points = hull_of(rows), random_angles((80,), 2, 0.25)
    if flat:
        points[0] = 0.05
    expected = [inside_by_linear_programme(rows, p) for p in points.T]
    assert 5 < sum(expected) < 75
    np.testing.assert_array_equal(hull.contains(*points), expected)
    assert np.all(hull.contains(*rows.T))
    assert "convex hull" in str(hull)


def test_a_single_incidence_covers_itself_only():
    hull = hull_of(grid_angles([5 * DEG], [-0.1, 0.1], [-0.1, 0.1]))
    np.testing.assert_array_equal(hull.contains(np.array([4.9, 5.0, 5.1]) * DEG, 0.0, 0.0), [False, True, False])
    assert str(hull).startswith("alpha 5, tab")


def test_batched_equals_single():
    hull = hull_of(np.random.default_rng(1).normal(0.0, 0.1, (40, 3)))
    points = random_angles((6, 7), 5, 0.2)
    whole = hull.contains(*points)
    assert whole.shape == (6, 7)
    for index in np.ndindex(6, 7):
        assert hull.contains(*(float(p[index]) for p in points)) == whole[index]


@pytest.mark.parametrize("direction", [[1.0, 1.0, 1.0], [0.0, 1.0, -1.0]])
def test_rows_on_a_line_surround_nothing(direction):
    with pytest.raises(ValueError, match="in one plane or on one line"):
        hull_of(np.linspace(0.0, 0.3, 9)[:, None] * direction)
