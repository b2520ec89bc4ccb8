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
    assert np.all(closed_loop(on).b == 0.0)
