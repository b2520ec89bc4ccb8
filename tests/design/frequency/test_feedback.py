from dataclasses import replace

import numpy as np
import pytest

from design.frequency.feedback import closed_loop, complementary, log_slope, open_loop_value
from tests.design.siso_loops import in_other_states, of_transfer, stabilised


@pytest.mark.parametrize("delay", [0.0, 0.4])
def test_complementary_sensitivity_and_its_slope(delay):
    loop = stabilised(5, 4, seed=1, gain=3.0, delay=delay)
    closed = closed_loop(loop)
    rows, w, h = np.array([0, 1, 1, 4]), np.array([0.1, 0.4, 0.9, 0.02]), 1e-6
    T, slope = complementary(closed, rows, w, delayed=delay > 0.0)
    for i, (row, x) in enumerate(zip(rows, w * closed.scale[rows], strict=True)):
        resolvent = np.linalg.solve(1j * x * np.eye(4) - loop.A[row], 3.0 * loop.b[row])
        L = loop.c[row] @ resolvent * np.exp(-1j * x * delay)
        np.testing.assert_allclose(T[i], L / (1.0 + L), rtol=1e-10)
        np.testing.assert_allclose(open_loop_value(T[i]), L, rtol=1e-10)
    (up, _), (down, _) = (complementary(closed, rows, w + s, delayed=delay > 0.0) for s in (h, -h))
    np.testing.assert_allclose(slope, (up - down) / (2 * h), rtol=1e-6)
    change = np.log(np.abs(open_loop_value(up))) - np.log(np.abs(open_loop_value(down)))
    np.testing.assert_allclose(log_slope(T, slope), change / (2 * h), rtol=1e-5, atol=1e-7)


def test_poles_and_polynomials_are_those_of_the_closed_loop():
    loop = stabilised(5, 4, seed=2)
    closed = closed_loop(loop)
    expected = np.sort_complex(np.linalg.eigvals(loop.closed()))
    np.testing.assert_allclose(np.sort_complex(closed.poles * closed.scale[:, None]), expected, rtol=1e-10)
    roots = np.array([np.sort_complex(np.roots(p)) for p in closed.characteristic])
    np.testing.assert_allclose(roots * closed.scale[:, None], expected, rtol=1e-7)
    assert closed.regular.all()


def test_a_pole_on_the_axis_is_told_from_one_beside_it():
    on = of_transfer([2.0], [1.0, 0.0, 1.0])
    beside = of_transfer([2.0], [1.0, 1e-6, 1.0])
    for seed in range(5):
        assert not closed_loop(in_other_states(on, seed)).regular[0]
        assert closed_loop(in_other_states(beside, seed)).regular[0]


def test_stable_is_left_of_the_axis():
    loop = stabilised(4, 3, seed=3)
    np.testing.assert_array_equal(closed_loop(loop).stable, [True] * 4)
    shifted = replace(loop, A=loop.A + np.array([0.0, 20.0, 0.0, 20.0])[:, None, None] * np.eye(3))
    np.testing.assert_array_equal(closed_loop(shifted).stable, [True, False, True, False])


def test_quietened_points_have_no_loop_and_leave_the_others_alone():
    closed = closed_loop(stabilised(3, 4, seed=4))
    kept = np.array([True, False, True])
    quiet = closed.quietened(kept)
    T, slope = complementary(quiet, np.array([0, 1, 2]), np.array([0.3, 0.3, 0.3]), delayed=False)
    expected, _ = complementary(closed, np.array([0, 1, 2]), np.array([0.3, 0.3, 0.3]), delayed=False)
    assert (T[1], slope[1]) == (0.0, 0.0)
    np.testing.assert_array_equal(T[kept], expected[kept])
    np.testing.assert_allclose(quiet.poles[1], -np.ones(4))
    assert closed.quietened(np.array([True, True, True])) is closed


def test_zero_and_infinite_frequency():
    closed = closed_loop(stabilised(2, 4, seed=5))
    T, slope = complementary(closed, np.array([0, 1, 1]), np.array([0.0, 0.0, np.inf]), delayed=False)
    np.testing.assert_allclose(T[:2], closed.numerator[:, -1] / closed.characteristic[:, -1])
    np.testing.assert_allclose(T[2], 0.0)
    h = 1e-6
    (up, _), (down, _) = (complementary(closed, np.array([0]), np.array([x]), delayed=False) for x in (h, -h))
    np.testing.assert_allclose(slope[0], (up - down)[0] / (2 * h), rtol=1e-6)
