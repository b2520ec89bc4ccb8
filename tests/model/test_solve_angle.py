import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from model.solve_angle import EquationAt, least_angle, newton_angle, solve_angle

SHIFTS = np.array([-0.9, -0.31, 0.0, 0.4, 0.77, 3.0])


def equation_of(function, slope, covered=lambda x: np.ones(np.shape(x), dtype=bool)):
    return lambda x: EquationAt(function(x), slope(x), covered(x))


def cubic(shift):
    """Three solutions for small shifts, one for large ones."""
    return equation_of(lambda x: (x**2 - 1.0) * x - 0.3 * shift, lambda x: 3.0 * x**2 - 1.0)


def test_linear_equation_is_met_exactly():
    slopes = np.array([0.3, -2.0, 5e-4])
    equation = equation_of(lambda x: slopes * x - 0.2 * slopes, lambda x: slopes + 0.0 * x)
    solved = solve_angle(equation, (3,), 1.5)
    assert np.all(solved.found)
    np.testing.assert_allclose(solved.angle, 0.2, rtol=4e-16)


def test_the_solution_nearest_to_neutral_is_taken():
    solved = solve_angle(cubic(SHIFTS), (6,), 1.5)
    for shift, angle, found in zip(SHIFTS, solved.angle, solved.found, strict=True):
        x = np.linspace(-1.5, 1.5, 30001)
        value = (x**2 - 1.0) * x - 0.3 * shift
        roots = [
            brentq(lambda t, s=shift: (t**2 - 1.0) * t - 0.3 * s, x[k], x[k + 1], xtol=1e-15)
            for k in range(30000)
            if value[k] * value[k + 1] < 0
        ]
        roots += list(x[value == 0.0])
        assert found == bool(roots)
        if roots:
            assert angle == pytest.approx(min(roots, key=abs), abs=1e-14)


def test_steep_and_flat_equations_are_bisected():
    # Newton's method alone runs away from an arctangent's foot and from a step.
    for function, slope, root in [
        (lambda x: np.arctan(500.0 * (x - 1.2)), lambda x: 500.0 / (1.0 + (500.0 * (x - 1.2)) ** 2), 1.2),
        (lambda x: np.cbrt(x - 0.7), lambda x: np.cbrt(np.maximum((x - 0.7) ** 2, 1e-300)) ** -1 / 3.0, 0.7),
        (lambda x: np.where(x > 0.33, 1.0, -1.0), lambda x: 0.0 * x, 0.33),
    ]:
        solved = solve_angle(equation_of(function, slope), (), np.pi / 2)
        assert solved.found
        assert float(solved.angle) == pytest.approx(root, abs=2e-12)


def test_where_nothing_is_found_the_least_is_given():
    solved = solve_angle(equation_of(lambda x: x - 2.0, lambda x: 1.0 + 0.0 * x), (), 1.0)
    assert not solved.found
    assert float(solved.angle) == 1.0
    flat = solve_angle(equation_of(lambda x: 1.0 + 0.0 * x, lambda x: 0.0 * x), (), 1.0)
    assert not flat.found
    assert float(flat.angle) == 0.0


def test_a_solution_that_is_not_covered_is_none():
    inside = equation_of(lambda x: x - 0.4995, lambda x: 1.0 + 0.0 * x, lambda x: np.abs(x) <= 0.5)
    beyond = equation_of(lambda x: x - 0.5005, lambda x: 1.0 + 0.0 * x, lambda x: np.abs(x) <= 0.5)
    # Samples lie two degrees apart: the cell of both solutions is half covered.
    assert float(solve_angle(inside, (), np.pi / 2).angle) == pytest.approx(0.4995, rel=1e-14)
    assert not solve_angle(beyond, (), np.pi / 2).found
    nowhere = equation_of(lambda x: x, lambda x: 1.0 + 0.0 * x, lambda x: np.zeros(np.shape(x), dtype=bool))
    solved = solve_angle(nowhere, (), 1.0)
    assert not solved.found
    assert float(solved.angle) == 0.0


def test_not_a_number_is_no_solution():
    equation = equation_of(lambda x: np.where(x > 0.2, np.nan, x - 1.0), lambda x: 1.0 + 0.0 * x)
    solved = solve_angle(equation, (), 1.5)
    assert not solved.found
    assert np.isfinite(solved.angle)


def test_least_angle_is_the_global_one():
    # Two valleys of the same function, one lower than the other.
    def size(x):
        return (x**2 - 0.5) ** 2 + 0.1 * x * SHIFTS

    def slope(x):
        return 4.0 * x * (x**2 - 0.5) + 0.1 * SHIFTS

    stationary = equation_of(slope, lambda x: np.abs(12.0 * x**2 - 2.0))
    solved = least_angle(size, stationary, SHIFTS.shape, 1.2)
    assert np.all(solved.found)
    for k, shift in enumerate(SHIFTS):
        if shift == 0.0:
            continue  # both valleys are as low
        start = -np.sign(shift) * 0.7
        best = minimize_scalar(
            lambda x, s=shift: (x**2 - 0.5) ** 2 + 0.1 * x * s,
            bounds=(start - 0.5, start + 0.5), method="bounded", options={"xatol": 1e-12},
        )  # fmt: skip
        assert solved.angle[k] == pytest.approx(best.x, abs=1e-7)
        assert abs(slope(solved.angle)[k]) < 1e-14


def test_least_angle_may_be_the_limit():
    stationary = equation_of(lambda x: x - 3.0, lambda x: 1.0 + 0.0 * x)
    solved = least_angle(lambda x: (x - 3.0) ** 2, stationary, (), 0.7)
    assert solved.found
    assert float(solved.angle) == 0.7


def test_newton_angle_near_a_good_start():
    solved = newton_angle(cubic(SHIFTS), np.full(6, 1.1))
    np.testing.assert_allclose((solved.angle**2 - 1.0) * solved.angle, 0.3 * SHIFTS, atol=1e-15)
    assert np.all(solved.found)
    lost = newton_angle(equation_of(lambda x: 1.0 + x**2, lambda x: 2.0 * x), np.array([0.3, np.nan]))
    assert not np.any(lost.found)
    assert np.all(np.isfinite(lost.angle))


def test_batched_equals_single():
    batch = solve_angle(cubic(SHIFTS), (6,), 1.5)
    near = newton_angle(cubic(SHIFTS), np.full(6, 1.1))
    for k, shift in enumerate(SHIFTS):
        single = solve_angle(cubic(shift), (), 1.5)
        assert (single.angle, single.found) == (batch.angle[k], batch.found[k])
        assert float(newton_angle(cubic(shift), np.array(1.1)).angle) == near.angle[k]


def test_sampling_in_blocks_changes_nothing(monkeypatch):
    whole = solve_angle(cubic(SHIFTS), (6,), 1.5)
    monkeypatch.setattr("model.solve_angle._BLOCK", 20)
    np.testing.assert_array_equal(solve_angle(cubic(SHIFTS), (6,), 1.5).angle, whole.angle)
