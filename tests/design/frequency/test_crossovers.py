import numpy as np
import pytest

from design.frequency.crossovers import critical_ratio, gain_crossings, phase_crossings, real_axis_frequencies
from design.frequency.feedback import closed_loop, open_loop_value
from design.loop import SisoLoop
from tests.design.siso_loops import of_transfer, stabilised


def response_of(loop, w):
    """Open loop at the frequencies, (N, W), by partial fractions."""
    pole, V = np.linalg.eig(loop.A)
    residue = (loop.c[:, None, :] @ V)[:, 0] * np.linalg.solve(V, loop.b[..., None].astype(complex))[..., 0]
    gain = (loop.sign * loop.gain)[:, None]
    return gain * (residue[:, None] / (1j * w[:, None] - pole[:, None])).sum(axis=-1)


def signs(values):
    return np.count_nonzero(np.diff(np.sign(values), axis=-1), axis=-1)


@pytest.mark.parametrize("order", [1, 3, 6])
def test_all_crossings_of_a_fine_grid_are_found(order):
    loop = stabilised(30, order, seed=order, gain=2.0)
    closed, w = closed_loop(loop), np.geomspace(1e-5, 1e5, 30001)
    L = response_of(loop, w)
    unity, real = gain_crossings(closed), phase_crossings(closed)
    np.testing.assert_array_equal((~np.isnan(unity.omega)).sum(axis=-1), signs(np.abs(L) - 1.0))
    np.testing.assert_allclose(np.abs(open_loop_value(unity.value[~np.isnan(unity.omega)])), 1.0, rtol=1e-11)
    for i in range(30):
        k = np.flatnonzero((L[i, 1:].imag * L[i, :-1].imag < 0.0) & (L[i, 1:].real < -1e-6))
        above = real.omega[i] * closed.scale[i] > 0.0
        assert above.sum() == k.size
        np.testing.assert_allclose(np.sort(real.omega[i][above] * closed.scale[i]), w[k], rtol=1e-3)


def test_lists_rise_and_end_in_nan():
    closed = closed_loop(stabilised(200, 5, seed=7))
    for found in (gain_crossings(closed), phase_crossings(closed)):
        assert found.omega.shape == (200, 5)
        gone = np.isnan(found.omega)
        np.testing.assert_array_equal(np.sort(gone, axis=-1), gone)
        assert np.all(np.diff(found.omega, axis=-1)[~gone[:, 1:]] > 0.0)
        np.testing.assert_array_equal(np.isnan(found.value), gone)
        np.testing.assert_array_equal(np.isnan(found.slope), gone)


def test_zero_frequency_counts_where_the_loop_is_negative_there():
    A = np.array([[[-1.0]], [[-1.0]], [[1.0]]])
    loop = SisoLoop("test", A, np.ones((3, 1)), np.array([[-0.5], [0.5], [4.0]]), np.ones(3), 1)
    found = phase_crossings(closed_loop(loop))
    np.testing.assert_array_equal(found.omega, [[0.0], [np.nan], [0.0]])
    np.testing.assert_allclose(critical_ratio(found.value)[[0, 2], 0], [2.0, 0.25])


def test_a_crossing_at_an_integrator_is_none():
    """At the origin of ``k / (s (s + 1)^2)`` the critical gain is zero; at 1 rad/s it is 2."""
    found = phase_crossings(closed_loop(of_transfer([0.5], np.poly([0.0, -1.0, -1.0]))))
    np.testing.assert_allclose(critical_ratio(found.value[0, :1]), [4.0], rtol=1e-12)
    assert np.all(np.isnan(found.omega[0, 1:]))


def test_touching_the_unit_circle():
    """``|L| = 1`` just at the peak of a resonance: within rounding once, a little above twice."""
    damping, peak = 0.1, 2 * 0.1 * np.sqrt(1 - 0.1**2)
    for factor, count in ((1.0, (0, 1, 2)), (1.0 + 1e-6, (2,)), (1.0 - 1e-6, (0,))):
        # In series with a lag, so that |L| is a polynomial of degree three.
        lag = np.sqrt(1.0 + (1 - 2 * damping**2) / 400.0)
        loop = of_transfer([20.0 * factor * peak * lag], np.polymul([1.0, 2 * damping, 1.0], [1.0, 20.0]))
        found = gain_crossings(closed_loop(loop))
        near = np.abs(found.omega[0] * closed_loop(loop).scale[0] - 1.0) < 0.1
        assert near.sum() in count


def test_real_axis_frequencies():
    """``(s + 1) / (s^2 - s + 4)``: Im of ``(1 + jw)(4 - w^2 + jw)`` is ``w (5 - w^2)``."""
    found = real_axis_frequencies(np.array([[0.0, 1.0, 1.0]]), np.array([[1.0, -1.0, 4.0]]))
    np.testing.assert_allclose(found, [[0.0, np.sqrt(5.0)]], rtol=1e-12)
    np.testing.assert_array_equal(real_axis_frequencies(np.zeros((1, 3)), np.array([[1.0, 1.0, 1.0]])), [[0.0, np.nan]])


@pytest.mark.parametrize("delay", [0.0, 0.4])
def test_grid_equals_points(delay):
    loop = stabilised(40, 5, seed=9, delay=delay)
    closed = closed_loop(loop)
    every = gain_crossings(closed), phase_crossings(closed)
    for i in range(40):
        one = closed_loop(loop.take(i))
        for found, alone in zip(every, (gain_crossings(one), phase_crossings(one)), strict=True):
            np.testing.assert_allclose(found.omega[i], alone.omega[0], rtol=1e-12)
            np.testing.assert_allclose(found.value[i], alone.value[0], rtol=1e-10)
