"""Guaranteed peaks: closed forms, linear programmes solved by others, brute force, and laws that must hold."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import linprog

from design.worst_case.peaks import guaranteed_peaks
from design.worst_case.reference import worst_reference
from tests.design.worst_case.any_loops import random_system, resonance, system

A = 0.2


def bounds(loop, amplitude=A, rate=None, outputs=None):
    found = guaranteed_peaks(loop, amplitude, rate, outputs)
    assert np.all(found.lower <= found.upper)
    return found


def tight(found, value, rtol=2e-4):
    np.testing.assert_allclose(found.upper, value, rtol=rtol)
    assert np.all(found.lower <= value * (1.0 + 1e-9))
    assert np.all(found.upper >= value * (1.0 - 1e-9))


# --- closed forms


def test_a_lag_reaches_its_gain_whatever_the_rate():
    loop = system([[-7.0]], [[7.0]], [[-3.0]])
    for rate in (None, 0.01, 1.0, 1e4):
        tight(bounds(loop, rate=rate), 3.0 * A)


def test_what_a_lag_leaves_of_a_reference():
    """``s / (s + w)``: D and the L1 norm of g add up; with a rate R held from -A to A it is R/w (1 - exp(-2 w A/R))."""
    loop = system([[-7.0]], [[7.0]], [[-1.0]], [[1.0]])
    tight(bounds(loop), 2.0 * A)
    for rate in (0.01, 0.3, 2.0, 50.0):
        tight(bounds(loop, rate=rate), rate / 7.0 * (1.0 - np.exp(-14.0 * A / rate)))


@pytest.mark.parametrize("zeta", [0.02, 0.2, 0.7])
def test_a_resonance_has_the_l1_norm_of_its_half_swings(zeta):
    swing = np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2))
    tight(bounds(resonance(30.0, zeta)), A * (1.0 + swing) / (1.0 - swing), rtol=1e-6)


def test_a_slow_rate_only_leaves_the_steady_gain():
    found = bounds(resonance(30.0, 0.1), rate=1e-4)
    np.testing.assert_allclose(found.upper, A, rtol=1e-3)
    assert found.lower > A


def test_a_nearly_free_integrator_follows_the_integral_of_the_reference():
    """``1 / (s + e)`` reaches A/e however slow the reference is, in the end."""
    loop = system([[-1e-4]], [[1.0]], [[1.0]])
    tight(bounds(loop, rate=0.1), A / 1e-4)


def test_three_equal_modes_are_no_trouble():
    """``w^3 / (s + w)^3`` in one chain of states, whose eigenvectors are all the same; its output never overshoots."""
    loop = system(-5.0 * np.eye(3) + 5.0 * np.eye(3, k=-1), [[5.0], [0.0], [0.0]], [[0.0, 0.0, 1.0]])
    tight(bounds(loop), A, rtol=1e-6)
    tight(bounds(loop, rate=0.4), A)


# --- other routes


def impulse(loop, point, times):
    """(o, T) impulse responses, by modes."""
    poles, V = np.linalg.eig(loop.closed[point])
    excited = np.linalg.solve(V, loop.reference_input[point][:, 0])
    return ((loop.closed_outputs[point] @ V * excited) @ np.exp(np.outer(poles, times))).real


def test_without_a_rate_it_is_the_l1_norm_of_dense_quadrature():
    loop = random_system(1, 6)
    found = bounds(loop, 1.0)
    for point in range(6):
        slowest = -np.linalg.eigvals(loop.closed[point]).real.max()
        times = np.concatenate([[0.0], np.geomspace(1e-6, 22.0 / slowest, 200_001)])
        norm = np.trapezoid(np.abs(impulse(loop, point, times)), times, axis=-1)
        norm += np.abs(loop.reference_feedthrough[point][:, 0])
        np.testing.assert_allclose(found.upper[point], norm, rtol=1e-5)
        np.testing.assert_allclose(found.lower[point], norm, rtol=1e-5)


def by_linprog(A, b, c, d, rate, step, count):
    """Largest output over references straight between even instants, size 1, weights by the matrix exponential."""
    n = len(b)
    M = np.zeros((n + 2, n + 2))
    M[:n, :n], M[:n, n], M[n, n + 1] = A, b, 1.0
    E = expm(M * step)
    weights = np.zeros(count + 1)  # r(T), r(T - h), ...
    weights[0] += d
    row = c
    for k in range(count):  # x after = E x + (from r(T-(k+1)h) to r(T-kh))
        ramp = row @ E[:n, n + 1] / step
        hold = row @ E[:n, n]
        weights[k] += ramp
        weights[k + 1] += hold - ramp
        row = row @ E[:n, :n]
    D = np.diff(np.eye(count + 1), axis=0)
    limit = np.full(2 * count, rate * step)
    solved = linprog(-weights, np.concatenate([D, -D]), limit, bounds=(-1.0, 1.0), method="highs")
    return -solved.fun


@pytest.mark.parametrize("rate", [0.7, 4.0, 30.0])
@pytest.mark.parametrize("seed", [3, 4])
def test_a_linear_programme_on_even_instants_agrees(rate, seed):
    rng = np.random.default_rng(seed)
    poles = -rng.uniform(1.0, 3.0, 2) + 1j * rng.uniform(4.0, 15.0, 2)
    blocks = [np.array([[p.real, p.imag], [-p.imag, p.real]]) for p in poles]
    M = np.zeros((4, 4))
    M[:2, :2], M[2:, 2:] = blocks
    b, c, d = rng.standard_normal(4), rng.standard_normal(4), rng.standard_normal()
    found = bounds(system(M, b[:, None], c[None], [[d]]), 1.0, rate)
    value = by_linprog(M, b, c, d, rate, 0.008, 1200)
    assert value <= found.upper[0] * (1.0 + 1e-9)  # the end of the mesh is held for ever: both leave out exp(-9.6)
    np.testing.assert_allclose(value, found.upper[0], rtol=1e-3)


def test_brute_force_never_exceeds_the_upper_bound():
    """10^4 random admissible references, bang-bang with random switches among them, simulated exactly."""
    rng = np.random.default_rng(7)
    loop, rate, step, count = random_system(11, 4, n=4), 6.0, 0.01, 300
    draws = 2500
    found = bounds(loop, A, rate)
    for point in range(4):
        n = 4
        M = np.zeros((n + 2, n + 2))
        M[:n, :n], M[:n, n], M[n, n + 1] = loop.closed[point], loop.reference_input[point][:, 0], 1.0
        E = expm(M * step)
        x, r, peak = np.zeros((draws, n)), np.zeros(draws), np.zeros(3)
        slope = rng.choice([-rate, rate], draws)
        often = rng.uniform(0.005, 0.3, draws)
        for _ in range(count):
            slope = np.where(rng.random(draws) < often, -slope, slope)
            after = np.clip(r + slope * step * rng.choice([0.3, 1.0], draws), -A, A)
            x = np.column_stack([x, r, (after - r) / step]) @ E[:n].T
            r = after
            y = x @ loop.closed_outputs[point].T + r[:, None] * loop.reference_feedthrough[point][:, 0]
            peak = np.maximum(peak, np.abs(y).max(axis=0))
        assert np.all(peak <= found.upper[point])
        assert np.all(peak > 0.3 * found.upper[point])


# --- laws


@given(seed=st.integers(0, 10_000), log_rate=st.floats(-3.0, 5.0), scale=st.floats(0.01, 100.0))
@settings(max_examples=25, deadline=None)
def test_the_bounds_are_close_homogeneous_and_rise_with_the_rate(seed, log_rate, scale):
    loop, rate = random_system(seed, 2), 10.0**log_rate
    found, faster, free = bounds(loop, A, rate), bounds(loop, A, 1.5 * rate), bounds(loop, A)
    np.testing.assert_allclose(found.lower, found.upper, rtol=1e-3)
    assert np.all(found.upper <= faster.upper * (1.0 + 2e-4))
    assert np.all(faster.upper <= free.upper * (1.0 + 1e-9))
    scaled = bounds(loop, scale * A, scale * rate)
    np.testing.assert_allclose(scaled.upper, scale * found.upper, rtol=2e-4)
    np.testing.assert_allclose(bounds(loop, 4.0 * A, 4.0 * rate).upper, 4.0 * found.upper, rtol=1e-12)


def test_a_rate_without_end_is_none():
    loop = random_system(5, 3)
    np.testing.assert_allclose(bounds(loop, A, 1e9).upper, bounds(loop, A).upper, rtol=1e-4)
    np.testing.assert_array_equal(bounds(loop, A, np.inf).upper, bounds(loop, A, None).upper)


@pytest.mark.parametrize("rate", [None, 2.0])
def test_a_grid_gives_the_numbers_of_its_points(rate):
    loop = random_system(21, 6)
    whole = bounds(loop, A, rate)
    for i in range(6):
        one = bounds(loop.take(i), A, rate)
        assert one.upper.shape == (3,)
        np.testing.assert_allclose(one.upper, whole.upper[i], rtol=1e-12)
        np.testing.assert_allclose(one.lower, whole.lower[i], rtol=1e-12)
    folded = bounds(loop.take(np.arange(6).reshape(2, 3)), A, rate)
    np.testing.assert_array_equal(folded.upper.reshape(6, 3), whole.upper)


def test_trim_adds_to_the_change_whatever_its_sign():
    trims = np.array([[0.0, 0.0], [0.5, -2.0], [-0.5, 2.0]])
    M, b, C = (np.broadcast_to(x, (3, *np.shape(x))) for x in ([[-2.0]], [[2.0]], [[1.0], [-3.0]]))
    found = bounds(system(M, b, C, trim=trims))
    np.testing.assert_allclose(found.upper, np.abs(trims) + A * np.array([1.0, 3.0]), rtol=1e-6)


def test_references_add_up_each_with_its_limits():
    rng = np.random.default_rng(2)
    M, b, C = np.diag([-1.0, -4.0]) + 0.0, rng.standard_normal((2, 2)), rng.standard_normal((3, 2))
    D = rng.standard_normal((3, 2))
    both = bounds(system(M, b, C, D, references=("r_a", "r_t")), np.array([0.1, 0.3]), np.array([0.5, np.inf]))
    first = bounds(system(M, b[:, :1], C, D[:, :1]), 0.1, 0.5)
    second = bounds(system(M, b[:, 1:], C, D[:, 1:]), 0.3)
    np.testing.assert_allclose(both.upper, first.upper + second.upper, rtol=1e-12)
    np.testing.assert_allclose(both.lower, first.lower + second.lower, rtol=1e-12)


def test_an_output_of_the_rate_adds_the_rate_and_has_no_bound_without_one():
    loop = system([[-7.0]], [[7.0]], [[1.0], [1.0]], R=[[0.0], [-0.5]])
    found = bounds(loop, rate=3.0)
    np.testing.assert_allclose(found.upper, [A, A + 1.5], rtol=1e-4)
    free = bounds(loop)
    assert np.isfinite(free.upper[0])
    assert free.upper[1] == np.inf


def test_the_tracking_error_is_what_the_angle_leaves_of_its_reference():
    loop = system([[-7.0]], [[7.0]], [[1.0]], trim=[0.3], outputs=("da",))
    found = bounds(loop, rate=0.3, outputs=("da_error", "da"))
    np.testing.assert_allclose(found.upper, [0.3 / 7.0 * (1.0 - np.exp(-14.0 * A / 0.3)), 0.3 + A], rtol=1e-4)


def test_unstable_and_unknown_points_leave_the_others_alone():
    M = np.array([[[-2.0]], [[2.0]], [[np.nan]], [[0.0]]])
    b, C = np.ones((4, 1, 1)), np.ones((4, 1, 1))
    found = guaranteed_peaks(system(M, b, C, trim=np.full((4, 1), -0.1)), A)
    np.testing.assert_allclose(found.upper[:, 0], [0.1 + 0.5 * A, np.inf, np.nan, np.inf], rtol=1e-6)
    np.testing.assert_allclose(found.lower[:, 0], [0.1 + 0.5 * A, 0.1, np.nan, 0.1], rtol=1e-6)


def test_modes_that_no_mesh_follows_have_no_bound():
    for loop in (resonance(30.0, 0.0035), system(np.diag([-1e-9, -1.0]), np.ones((2, 1)), np.ones((1, 2)))):
        assert bounds(loop).upper[0] == np.inf
    assert np.isfinite(bounds(resonance(30.0, 0.0045)).upper[0])


def test_a_delay_is_followed_by_a_chain_of_states():
    """``x' = v, v(t) = 8 (r - x)(t - 40 ms)``, integrated step by step with its past: the worst series comes near."""
    gain, delay, rate, step = 8.0, 0.04, 5.0, 1e-4
    loop = system([[0.0]], [[1.0]], [[1.0]])
    loop = replace(loop, K=np.array([[gain]]), N=np.array([[gain]]), delay=(delay,))
    found = bounds(loop, A, rate)
    manoeuvre = worst_reference(loop, "da", A, rate)
    times = np.arange(0.0, manoeuvre.times[-1] + step, step)
    r, x, late = manoeuvre.at(times)[:, 0], np.zeros(times.size), round(delay / step)
    for k in range(late, times.size - 1):
        x[k + 1] = x[k] + step * gain * (r[k - late] - x[k - late])
    np.testing.assert_allclose(np.abs(x).max(), found.upper[0], rtol=2e-3)
    at_once = bounds(replace(loop, delay=(0.0,)), A, rate)
    assert found.upper[0] > at_once.upper[0]
    assert found.index("da") == 0
    np.testing.assert_array_equal(bounds(replace(loop, delay=(1e-16,)), A, rate).upper, at_once.upper)


def test_nothing_asked_moves_nothing():
    found = bounds(random_system(2, 2), 0.0, 1.0)
    np.testing.assert_array_equal(found.upper, 0.0)


def test_limits_that_make_no_sense_are_refused():
    loop = random_system(2, 1)
    for amplitude, rate in ((-1.0, None), (np.inf, None), (np.nan, None), (1.0, 0.0), (1.0, -1.0), (1.0, np.nan)):
        with pytest.raises(ValueError, match="must be"):
            guaranteed_peaks(loop, amplitude, rate)
    with pytest.raises(ValueError, match="one for each of 1"):
        guaranteed_peaks(loop, np.ones(2))
    with pytest.raises(ValueError, match="no output 'dx'"):
        guaranteed_peaks(loop, 1.0, outputs=("dx",))
    with pytest.raises(ValueError, match="no reference for 'dt_error'"):
        guaranteed_peaks(loop, 1.0, outputs=("dt_error",))
    with pytest.raises(ValueError, match="delays must not be negative"):
        guaranteed_peaks(replace(loop, delay=(-0.1,)), 1.0)
    with pytest.raises(ValueError, match="there is no output"):
        guaranteed_peaks(loop, 1.0).index("dx")
