import numpy as np
import pytest

from design.frequency.delayed import (
    LARGEST_TURN,
    LOUD,
    POINTS,
    QUIET,
    SPARE,
    grid_response,
    real_axis_starts,
    search_grid,
    zero_between,
)
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


@pytest.mark.parametrize("delay", [0.01, 0.7])
def test_response_on_the_grid(delay):
    loop = stabilised(6, 5, seed=3, delay=delay)
    closed = closed_loop(loop)
    found = grid_response(closed)
    for i in range(6):
        for k in (0, 1, 700, 2000, -1):
            s = 1j * found.omega[i, k] * closed.scale[i]
            L = loop.c[i] @ np.linalg.solve(s * np.eye(5) - loop.A[i], loop.b[i]) * np.exp(-s * delay)
            np.testing.assert_allclose(found.value[i, k], L / (1.0 + L), rtol=1e-10)


def test_starts_are_where_the_response_is_real():
    """``exp(-s h) / s`` is real and negative at pi / (2 h) and every two pi / h on: no other can be critical."""
    delay = 0.5
    closed = closed_loop(of_transfer([1.0], [1.0, 0.0], delay=delay))
    found = real_axis_starts(closed, grid_response(closed), 10)[0] * closed.scale[0]
    assert found[0] == 0.0
    assert found.size == 1 + 10 * SPARE
    np.testing.assert_allclose(found[1:], (4 * np.arange(found.size - 1) + 1) * np.pi / (2 * delay), rtol=1e-8)


def test_starts_nearest_to_the_gain_flown_are_kept():
    """All that a fine grid shows within a factor of the gain flown is there, for a delay of many turns."""
    loop = stabilised(20, 4, seed=4, delay=8.0)
    closed = closed_loop(loop)
    starts = real_axis_starts(closed, grid_response(closed), 4)
    w = np.linspace(1e-3, 30.0, 200001)
    for i in range(20):
        ratio = np.array(np.polyval(closed.numerator[i], 1j * w) / np.polyval(closed.transfer.denominator[i], 1j * w))
        L = ratio * np.exp(-1j * w * closed.delay[i])
        k = np.flatnonzero((L.imag[1:] * L.imag[:-1] < 0.0) & (L.real[1:] < 0.0))
        nearest = k[np.argsort(np.abs(np.log(np.abs(L.real[k]))))][:4]
        for place in nearest:
            assert np.nanmin(np.abs(starts[i] - w[place])) < 2e-4


def test_zero_between():
    low, high = np.array([0.0, 1.0, 2.0, 0.0]), np.array([2.0, 4.0, 30.0, 1.0])
    root = np.array([1.25, 1.0001, 29.99, 0.5])
    found = zero_between(lambda x: np.sign(x - root) * np.abs(x - root) ** np.array([1.0, 3.0, 0.5, 1.0]), low, high)
    np.testing.assert_allclose(found, root, rtol=1e-4)
    # Without a change of sign: somewhere between.
    found = zero_between(lambda x: 1.0 + x**2, low, high)
    assert np.all((found >= low) & (found <= high))


def test_grid_equals_points():
    loop = stabilised(4, 3, seed=2, delay=0.4)
    closed = closed_loop(loop)
    for i in range(4):
        one = closed_loop(loop.take(i))
        same(search_grid(closed)[i], search_grid(one)[0])
        starts, alone = (
            real_axis_starts(closed, grid_response(closed), 5)[i],
            real_axis_starts(one, grid_response(one), 5),
        )
        same(starts[~np.isnan(starts)], alone[0])
