"""Stability and damping with delays, against the Lambert function, margins and dense contours."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from design.delay.damping import (
    DECAY_PER_DELAY,
    least_damping_ratio_delayed,
    poles_damped_less,
    unstable_poles,
)
from design.delay.delayed_poles import delayed_poles
from design.frequency.margins import margins
from design.frequency.poles import damping_ratio, least_damping_ratio, poles
from tests.design.delay.delayed_loops import DRIVES, loop, random_loops, scalar, tab_only


def test_without_a_bound_there_is_no_least_damping_ratio():
    """Along the chain of ``x' = -0.3 x(t - 1)``, a loop with 73 degrees of phase margin, it falls below any value."""
    chain = np.array([lambertw(-0.3, k) for k in (1, 10, 100, 1000, 10_000)])
    ratio = damping_ratio(chain)
    assert np.all(np.diff(ratio) < 0.0)
    assert ratio[-1] < 3e-4
    assert np.all(chain.real < -DECAY_PER_DELAY)
    assert least_damping_ratio_delayed(scalar(0.3, 1.0)) == 1.0


@pytest.mark.parametrize("delay", [1.0, 0.01])
def test_scalar_loop(delay):
    a = np.array([1e-3, 0.2, 0.4, 0.7, 1.0, 1.3, 1.57, 1.6, 4.0, 20.0])
    loops = scalar(a / delay, delay)
    roots = np.array([[lambertw(-x, k) for k in range(-40, 41)] for x in a])
    counts = roots.real > -DECAY_PER_DELAY
    exact = np.where(counts, damping_ratio(roots), 1.0).min(axis=-1)
    np.testing.assert_allclose(least_damping_ratio_delayed(loops), exact, rtol=1e-10)
    np.testing.assert_array_equal(unstable_poles(loops), (roots.real >= 0.0).sum(axis=-1))
    for least in (-0.3, 0.0, 0.25, 0.7):
        below = (counts & (damping_ratio(roots) < least)).sum(axis=-1)
        np.testing.assert_array_equal(poles_damped_less(loops, least), below)


def test_stable_until_a_quarter_turn():
    """``x' = -a x(t - delay)`` is stable for a delay below pi / 2."""
    a = np.pi / 2.0 * np.array([1.0 - 1e-6, 1.0, 1.0 + 1e-6])
    np.testing.assert_array_equal(unstable_poles(scalar(a, 1.0)), [0.0, 2.0, 2.0])
    ratio = least_damping_ratio_delayed(scalar(a, 1.0))
    assert ratio[0] > 0.0 > ratio[2]
    assert abs(ratio[1]) < 1e-12


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 6), delay=st.floats(1e-6, 3.0), stable=st.booleans())
def test_stability_is_that_of_the_margins(seed, n, delay, stable):
    """Which count how often the poles cross the axis as the delay grows."""
    loops = random_loops(5, n, (delay,), seed, stable)
    count = unstable_poles(loops)
    np.testing.assert_array_equal(count == 0.0, ~np.isnan(margins(loops.cut("tab")).phase_margin))
    ratio = least_damping_ratio_delayed(loops)
    assert np.all((ratio < 0.0) == (count > 0.0))


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10_000), n=st.integers(1, 5), delay=st.sampled_from([(0.3,), (1.0,), (0.4, 0.4), (0.2, 0.7)])
)
def test_least_damping_ratio_and_counts_agree(seed, n, delay):
    loops = random_loops(4, n, delay, seed)
    ratio = least_damping_ratio_delayed(loops)
    assert np.isfinite(ratio).all()
    for i in range(4):
        one = loops.take(i)
        if abs(ratio[i]) < 0.99:
            assert poles_damped_less(one, ratio[i] - 1e-5) == 0.0
            assert poles_damped_less(one, ratio[i] + 1e-5) >= 2.0
        found = delayed_poles(one)
        limit = -DECAY_PER_DELAY / max(delay)
        if found.complete_beyond < limit:
            counted = found.poles[found.poles.real > limit]
            assert ratio[i] == pytest.approx(damping_ratio(counted).min(initial=1.0), abs=1e-12)


def test_without_a_delay_all_poles_count():
    loops = random_loops(6, 5, (0.0, 0.0), seed=4, stable=False)
    closed = poles(loops.closed)
    np.testing.assert_allclose(least_damping_ratio_delayed(loops), least_damping_ratio(closed), rtol=1e-12)
    np.testing.assert_array_equal(unstable_poles(loops), (closed.real > 0.0).sum(axis=-1))
    np.testing.assert_array_equal(poles_damped_less(loops, 0.3), (damping_ratio(closed) < 0.3).sum(axis=-1))


def test_a_short_delay_changes_little():
    loops = random_loops(6, 5, (0.0,), seed=4)
    ideal = least_damping_ratio(poles(loops.closed))
    for delay in (1e-8, 1e-5):
        ours = least_damping_ratio_delayed(replace(loops, delay=(delay,)))
        np.testing.assert_allclose(ours, ideal, atol=30.0 * delay + 1e-9)


def test_an_integral_that_nothing_feeds_back_is_on_the_edge():
    A, B = np.diag([0.0, -1.0]), np.array([[0.0], [1.0]])
    one = loop(A, B, [[0.0, 0.5]], (0.3,))
    assert unstable_poles(one) == 1.0
    assert least_damping_ratio_delayed(one) == 0.0


def test_grid_equals_points_and_a_failed_point_breaks_no_other():
    loops = random_loops(6, 4, (0.4, 0.9), seed=9)
    K = loops.K.copy()
    K[3, 0, 0] = np.inf
    loops = replace(loops, K=K)
    whole, below, unstable = least_damping_ratio_delayed(loops), poles_damped_less(loops, 0.3), unstable_poles(loops)
    assert np.isnan([whole[3], below[3], unstable[3]]).all()
    for i in (0, 1, 2, 4, 5):
        one = loops.take(i)
        np.testing.assert_allclose(least_damping_ratio_delayed(one), whole[i], rtol=1e-12)
        assert poles_damped_less(one, 0.3) == below[i]
        assert unstable_poles(one) == unstable[i]


@pytest.mark.parametrize("least", [1.0, -1.0, np.nan])
def test_a_damping_ratio_that_cannot_be_counted_below(least):
    with pytest.raises(ValueError, match="damping ratio"):
        poles_damped_less(scalar(1.0, 0.1), least)


@pytest.mark.parametrize("drive", list(DRIVES))
@pytest.mark.parametrize("delay", [1e-6, 0.001, 0.005, 0.015, 0.05])
def test_tab_loops(plant_a, drive, delay):
    """All is proved, stability is that of the margins, and the loop that is flown is what is judged."""
    tab = tab_only(plant_a, drive, delay)
    count, ratio, found = unstable_poles(tab), least_damping_ratio_delayed(tab), delayed_poles(tab)
    np.testing.assert_array_equal(count == 0.0, ~np.isnan(margins(tab.cut("tab")).phase_margin))
    assert np.isfinite(ratio).all()
    assert np.all(found.complete_beyond < -DECAY_PER_DELAY / delay)
    counted = found.poles.real > -DECAY_PER_DELAY / delay
    exact = np.where(counted, damping_ratio(np.where(counted, found.poles, -1.0)), 1.0).min(axis=-1)
    np.testing.assert_allclose(ratio, exact, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal((counted & (found.poles.real >= 0.0)).sum(axis=-1), count)
