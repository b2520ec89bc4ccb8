import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.frequency.feedback import closed_loop
from design.frequency.peaks import peaks
from design.loop import SisoLoop
from tests.design.siso_loops import of_transfer, stabilised


def on_a_fine_grid(loop, i):
    """``|1 - T|`` and ``|1 - 2 T|`` at frequencies crowded about the closed loop's poles, by partial fractions."""
    A, b, c = loop.closed()[i], loop.sign * loop.gain[i] * loop.b[i], loop.c[i]
    pole, V = np.linalg.eig(A)
    residue = (c @ V) * np.linalg.solve(V, b.astype(complex))
    near = np.abs(pole.imag)[:, None] + np.abs(pole.real)[:, None] * np.linspace(-6.0, 6.0, 1201)
    w = np.unique(np.concatenate([[0.0], np.geomspace(1e-5, 1e5, 4001), np.abs(near).ravel()]))
    T = (residue / (1j * w[:, None] - pole)).sum(axis=-1)
    return np.abs(1.0 - T).max(), np.abs(1.0 - 2.0 * T).max()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 100_000), order=st.integers(1, 7))
def test_no_frequency_is_higher_than_the_peak(seed, order):
    loop = stabilised(6, order, seed)
    closed = closed_loop(loop)
    found = peaks(closed, closed.poles)
    for i in range(6):
        sensitivity, balanced = on_a_fine_grid(loop, i)
        # A fine grid is never above, and below by no more than its width.
        assert sensitivity * (1 - 1e-7) <= found.sensitivity[i] <= max(sensitivity, 1.0) * (1 + 1e-4)
        assert balanced * (1 - 1e-7) <= found.balanced[i] <= max(balanced, 1.0) * (1 + 1e-4)


@pytest.mark.parametrize("damping", [1e-1, 1e-3, 1e-5])
def test_narrow_resonances(damping):
    """Two resonances of almost the same height, one of them narrow, far from any sample of the search."""
    wide, narrow = np.array([1.0, 0.4, 1.0]), np.array([1.0, 2 * damping * 31.7, 31.7**2])
    closed_polynomial = np.polymul(wide, narrow)
    numerator = np.polymul(np.polysub(wide, [1.0, 1.0, 1.0]), narrow)
    numerator = np.polyadd(numerator, np.polymul([-6 * damping * 31.7, 0.0], wide))
    denominator = np.polysub(closed_polynomial, numerator)
    loop = of_transfer(numerator / denominator[0], denominator / denominator[0])
    closed = closed_loop(loop)
    found = peaks(closed, closed.poles)
    stacked = SisoLoop("test", loop.A[None], loop.b[None], loop.c[None], np.ones(1), 1)
    sensitivity, balanced = on_a_fine_grid(stacked, 0)
    np.testing.assert_allclose([found.sensitivity[0], found.balanced[0]], [sensitivity, balanced], rtol=1e-4)
    assert found.sensitivity[0] >= sensitivity * (1 - 1e-9)


def test_peak_at_zero_frequency_and_at_infinity():
    unstable = closed_loop(of_transfer([2.0], [1.0, -1.0]))
    # 1 + 2 / (s - 1): S = (s - 1) / (s + 1) is all-pass; S - T = (s - 3) / (s + 1) is 3 at zero frequency.
    found = peaks(unstable, unstable.poles)
    np.testing.assert_allclose([found.sensitivity[0], found.balanced[0]], [1.0, 3.0], rtol=1e-9)
    lag = closed_loop(of_transfer([1.0], [1.0, 1.0]))
    found = peaks(lag, lag.poles)
    np.testing.assert_allclose([found.sensitivity[0], found.balanced[0]], [1.0, 1.0], rtol=1e-12)


def test_second_order_in_closed_form():
    """``w^2 / (s (s + 2 z w))``: the square of the peak of S, from the zero of its derivative in x = (w / w0)^2."""
    z = 0.2
    closed = closed_loop(of_transfer([1.0], [1.0, 2 * z, 0.0]))
    found = peaks(closed, closed.poles)
    x = (1.0 + np.sqrt(1.0 + 8.0 * z**2)) / 2.0
    expected = np.sqrt(x * (x + 4 * z**2) / ((1 - x) ** 2 + 4 * z**2 * x))
    np.testing.assert_allclose(found.sensitivity[0], expected, rtol=1e-12)


def test_grid_equals_points():
    loop = stabilised(30, 5, seed=3)
    closed = closed_loop(loop)
    found = peaks(closed, closed.poles)
    for i in range(30):
        one = closed_loop(loop.take(i))
        alone = peaks(one, one.poles)
        np.testing.assert_allclose(found.sensitivity[i], alone.sensitivity[0], rtol=1e-12)
        np.testing.assert_allclose(found.balanced[i], alone.balanced[0], rtol=1e-12)
