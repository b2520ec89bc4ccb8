"""Poles of loops with delays: the Lambert function, the determinant, dense contours, and the delay margin."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from design.delay.characteristic import PART
from design.delay.delayed_poles import MORE, delayed_poles
from design.frequency.margins import margins
from design.frequency.poles import pole_order, poles
from tests.design.delay.delayed_loops import determinant, loop, random_loops, scalar, winding


def _finite(values):
    return values[np.isfinite(values)]


@pytest.mark.parametrize("a", [1e-6, 0.01, 0.3, 0.367, 0.369, 1.0, 1.5, np.pi / 2.0, 1.6, 3.0, 10.0, 1000.0])
@pytest.mark.parametrize("delay", [1.0, 0.004])
def test_poles_of_the_scalar_loop_are_those_of_the_lambert_function(a, delay):
    """``s = W_k(-a) / delay`` for ``x' = -(a / delay) x(t - delay)``, the rightmost n + MORE of them and no others."""
    found = delayed_poles(scalar(a / delay, delay))
    exact = np.array([lambertw(-a, k) for k in range(-15, 16)]) / delay
    exact = exact[np.argsort(-exact.real)]
    ours = _finite(found.poles)
    assert ours.size in (MORE, MORE + 1)
    np.testing.assert_allclose(ours, pole_order(exact[: ours.size]), rtol=1e-12)
    assert exact[ours.size].real < found.complete_beyond < exact[ours.size - 1].real


def test_a_double_root_is_two_roots_or_is_not_given():
    """At ``a = 1 / e`` the two real roots are one: rounding hides how many there are."""
    found = delayed_poles(scalar(np.exp(-1.0), 1.0))
    ours = _finite(found.poles)
    if ours.size:
        np.testing.assert_allclose(ours[ours.real > -1.5], -1.0, atol=1e-6)


@pytest.mark.parametrize("delay", [(0.05,), (0.5,), (3.0,), (0.3, 0.3), (0.2, 1.0), (0.0, 0.8)])
@pytest.mark.parametrize("stable", [True, False])
def test_random_loops(delay, stable):
    """Every pole is a zero of the determinant to rounding, and none to the right of the line is missing."""
    loops = random_loops(40, 5, delay, seed=3, stable=stable)
    found = delayed_poles(loops)
    assert np.isfinite(found.complete_beyond).all()
    for i in range(40):
        ours = _finite(found.poles[i])
        assert ours.size >= 5 + MORE - 1
        np.testing.assert_array_equal(ours, pole_order(ours))
        np.testing.assert_array_equal(np.sort_complex(ours), np.sort_complex(ours.conj()))
        x = np.exp(-ours[:, None] * np.array(delay))
        one = loops.take(i)
        D = ours[:, None, None] * np.eye(5) - one.A + (one.B * x[:, None, :]) @ one.K
        singular = np.linalg.svd(D, compute_uv=False)
        assert np.all(singular[:, -1] < 1e-13 * singular[:, 0])
        if i < 3:
            left, far = found.complete_beyond[i], 1.5 * np.abs(ours).max() + 30.0
            corners = [left - 1j * far, far - 1j * far, far + 1j * far, left + 1j * far, left]
            assert winding(one, corners) == ours.size


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 8), delay=st.floats(0.01, 3.0), stable=st.booleans())
def test_poles_are_found_and_are_zeros(seed, n, delay, stable):
    loops = random_loops(3, n, (delay,), seed, stable)
    found = delayed_poles(loops)
    assert np.isfinite(found.complete_beyond).all()
    for i in range(3):
        ours = _finite(found.poles[i])
        assert ours.size >= n + MORE - 1
        h = 1e-6 * np.maximum(np.abs(ours), 1.0)
        at = [determinant(loops.take(i), ours + k * h) for k in (-1.0, 0.0, 1.0)]
        step = np.abs(at[1] * 2.0 * h / (at[2] - at[0]))
        assert np.all(step < 1e-8 * np.maximum(np.abs(ours), 1.0))


def test_a_short_delay_leaves_the_poles_where_they_are():
    """First order in the delay: ``ds = -s' d`` with the sensitivity from a second, twice as long, delay."""
    base = random_loops(5, 4, (0.0,), seed=8)
    ideal = poles(base.closed)
    moved = []
    for delay in (1e-7, 2e-7):
        found = delayed_poles(replace(base, delay=(delay,)))
        moved.append([np.sort_complex(_finite(p)[-4:]) - np.sort_complex(q) for p, q in
                      zip(found.poles, ideal, strict=True)])  # fmt: skip
    np.testing.assert_allclose(moved[0], 0.0, atol=1e-5)
    np.testing.assert_allclose(np.array(moved[1]), 2.0 * np.array(moved[0]), atol=1e-10)


def test_without_a_delay_there_are_n_poles():
    loops = random_loops(4, 3, (0.0, 0.0), seed=1)
    found = delayed_poles(loops)
    np.testing.assert_array_equal(found.poles[:, :3], poles(loops.closed))
    assert np.isnan(found.poles[:, 3:]).all()
    np.testing.assert_array_equal(found.complete_beyond, -np.inf)


def test_a_loop_without_gain_has_no_other_poles_than_its_plant():
    A = np.array([[0.0, 1.0, 0.0], [-4.0, -0.4, 1.0], [0.0, 0.0, 0.0]])
    found = delayed_poles(loop(A, np.ones((3, 1)), np.zeros((1, 3)), (0.2,)))
    np.testing.assert_allclose(_finite(found.poles), poles(A), atol=1e-14)
    assert found.poles[2] == 0.0


def test_at_the_delay_margin_a_pole_is_on_the_axis_at_the_crossover():
    base = random_loops(60, 4, (0.0,), seed=5)
    found = margins(base.cut("tab"))
    finite = np.flatnonzero(np.isfinite(found.delay_margin))
    assert finite.size > 9
    for i in finite:
        delay, omega = found.delay_margin[i], found.phase_omega[i]
        at = delayed_poles(replace(base.take(i), delay=(float(delay),)))
        right = _finite(at.poles)[-1]
        assert abs(right.real) < 1e-9 * abs(right)
        assert np.nanmin(np.abs(omega - right.imag)) < 1e-8 * right.imag
        before, after = (delayed_poles(replace(base.take(i), delay=(float(delay) * k,))) for k in (0.999, 1.001))
        assert _finite(before.poles)[-1].real < 0.0 < _finite(after.poles)[-1].real


def test_grid_equals_points_and_a_failed_point_breaks_no_other():
    loops = random_loops(6, 4, (0.4, 0.9), seed=9)
    A = loops.A.copy()
    A[2, 0, 0] = np.nan
    loops = replace(loops, A=A)
    whole = delayed_poles(loops)
    assert np.isnan(whole.poles[2]).all()
    assert np.isnan(whole.complete_beyond[2])
    for i in (0, 1, 3, 4, 5):
        one = delayed_poles(loops.take(i))
        np.testing.assert_allclose(one.poles, whole.poles[i], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(one.complete_beyond, whole.complete_beyond[i], rtol=1e-12)
    nested = delayed_poles(loops.take(np.array([[0, 1, 3], [3, 4, 5]])))
    np.testing.assert_allclose(nested.poles[1], whole.poles[3:], rtol=1e-12, atol=1e-12)


def test_many_points_are_worked_on_in_parts():
    few = random_loops(5, 3, (0.6,), seed=2)
    many, found = delayed_poles(few.take(np.arange(2 * PART + 3) % 5)), delayed_poles(few)
    np.testing.assert_allclose(many.poles, found.poles[np.arange(2 * PART + 3) % 5], rtol=1e-12, atol=1e-12)


def test_a_long_delay_among_the_modes_of_the_plant():
    """Thirty radians of a light mode pass in one delay: its root is one of the chain's."""
    A = np.array([[0.0, 1.0, 0.0], [-900.0, -3.0, 900.0], [0.0, 0.0, 0.0]])
    one = loop(A, [[0.0], [0.0], [1.0]], [[0.4, 0.0, 0.0]], (1.0,))
    found = delayed_poles(one)
    ours, far = _finite(found.poles), 400.0
    left = float(found.complete_beyond)
    corners = [left - 1j * far, far - 1j * far, far + 1j * far, left + 1j * far, left]
    assert winding(one, corners, 20_000) == ours.size >= 3 + MORE - 1
