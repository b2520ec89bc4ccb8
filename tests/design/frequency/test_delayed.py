import numpy as np
import pytest

from design.frequency.delayed import LARGEST_TURN, LOUD, POINTS, QUIET, real_axis_brackets, search_grid
from design.frequency.feedback import closed_loop
from tests.design.siso_loops import of_transfer, same, stabilised


@pytest.mark.parametrize("delay", [0.001, 0.3, 5.0])
def test_grid_covers_the_band_densely(delay):
    closed = closed_loop(stabilised(40, 5, seed=1, delay=delay))
    grid = search_grid(closed)
    step = np.diff(grid, axis=-1)
    assert np.all(grid[:, 0] == 0.0)
    assert np.all(step > 0.0)
    ratio = closed.transfer
    for i in range(40):
        w = np.geomspace(1e-3, 1e3, 4001)
        L = np.abs(np.polyval(ratio.numerator[i], 1j * w) / np.polyval(ratio.denominator[i], 1j * w))
        quiet, loud = (max(w[level < L], default=0.0) for level in (QUIET, LOUD))
        limit = LARGEST_TURN / closed.delay[i]
        assert grid[i, -1] >= min(quiet, limit) * 0.999
        below = grid[i, 1:] <= min(loud, limit)
        assert step[i][below].max(initial=0.0) <= 1.01 * max(loud, 2.0 * np.abs(closed.poles[i]).max()) / (POINTS - 1)
        heard = grid[i, 1:] <= min(quiet, limit)
        assert step[i][heard].max(initial=0.0) * closed.delay[i] <= 0.26 * np.pi
        for pole in closed.poles[i]:
            assert np.abs(grid[i] - min(abs(pole.imag), limit)).min() < 1e-12


def test_brackets_are_where_the_response_is_real():
    """``exp(-s h) / s`` is real at odd multiples of pi / (2 h)."""
    delay = 0.5
    closed = closed_loop(of_transfer([1.0], [1.0, 0.0], delay=delay))
    found = real_axis_brackets(closed, 1)[0] * closed.scale[0]
    assert found[0] == 0.0
    np.testing.assert_allclose(found[1:30], (2 * np.arange(29) + 1) * np.pi / (2 * delay), rtol=1e-9)


def test_grid_equals_points():
    loop = stabilised(4, 3, seed=2, delay=0.4)
    closed = closed_loop(loop)
    for i in range(4):
        one = closed_loop(loop.take(i))
        same(search_grid(closed)[i], search_grid(one)[0])
        alone = real_axis_brackets(one, 1)[0]
        same(real_axis_brackets(closed, 1)[i][: alone.size], alone)
