"""Step metrics against closed forms, dense exact samples and python-control."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import brentq

from design.response.step_metrics import step_metrics
from design.response.step_response import step_response
from tests.design.step_loops import data_set_a, loop, second_order

STEP = np.array([np.deg2rad(10.0)])
NAMES = (
    "rise_time",
    "settling_time",
    "overshoot",
    "undershoot",
    "peak_time",
    "steady_state_value",
    "steady_state_error",
    "bandwidth",
)


def metrics_of(loops, duration, step=STEP, **options):
    return step_metrics(loops, step_response(loops, step, duration, 101), **options)


def unit_step(w, z):
    """Closed form of the second-order unit step response."""
    wd = w * np.sqrt(1.0 - z**2)
    return lambda t: 1.0 - np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t))


def last_exit(y, duration, band=0.02):
    """Last time at which |y - 1| = band, from dense samples and Brent's method."""
    t = np.linspace(0.0, duration, 200_001)
    k = int(np.flatnonzero(np.abs(y(t) - 1.0) > band)[-1])
    return brentq(lambda s: abs(y(s) - 1.0) - band, t[k], t[k + 1], xtol=1e-14)


@pytest.mark.parametrize(("w", "z"), [(30.0, 0.1), (30.0, 0.4), (4.0, 0.7), (150.0, 0.6), (8.0, 0.9)])
def test_second_order_in_closed_form(w, z):
    duration = 8.0 / (z * w)
    found = metrics_of(second_order(w, z), duration)
    y, peak = unit_step(w, z), np.pi / (w * np.sqrt(1.0 - z**2))
    rise = brentq(lambda t: y(t) - 0.9, 0.0, peak, xtol=1e-14) - brentq(lambda t: y(t) - 0.1, 0.0, peak, xtol=1e-14)
    np.testing.assert_allclose(found.rise_time, rise, rtol=1e-8)
    np.testing.assert_allclose(found.settling_time, last_exit(y, duration), rtol=1e-8)
    np.testing.assert_allclose(found.overshoot, np.exp(-np.pi * z / np.sqrt(1.0 - z**2)), rtol=1e-8)
    np.testing.assert_allclose(found.peak_time, peak, rtol=1e-6)
    np.testing.assert_allclose(found.undershoot, 0.0, atol=1e-14)
    np.testing.assert_allclose(found.steady_state_value, STEP[0], rtol=1e-14)
    np.testing.assert_allclose(found.steady_state_error, 0.0, atol=1e-15)
    s = 1.0 - 2.0 * z**2
    np.testing.assert_allclose(found.bandwidth, w * np.sqrt(s + np.sqrt(s**2 + 1.0)), rtol=1e-9)


def test_settling_sees_an_excursion_that_no_sample_shows():
    # The first peak leaves the 2 % band by a thousandth of it, for a hundredth of a turn.
    log = np.log(0.02002)
    z = -log / np.hypot(np.pi, log)
    duration = 1.0
    for w in np.linspace(20.0, 23.0, 40):
        found = metrics_of(second_order(w, z), duration)
        np.testing.assert_allclose(found.settling_time, last_exit(unit_step(w, z), duration), rtol=1e-7)
        assert found.settling_time > np.pi / (w * np.sqrt(1.0 - z**2))


def test_a_peak_just_inside_the_band_does_not_delay_settling():
    log = np.log(0.0199)
    z = -log / np.hypot(np.pi, log)
    found = metrics_of(second_order(20.0, z), 1.0)
    np.testing.assert_allclose(found.settling_time, last_exit(unit_step(20.0, z), 1.0), rtol=1e-8)
    assert found.settling_time < np.pi / (20.0 * np.sqrt(1.0 - z**2))


def test_grid_gives_the_same_as_each_point():
    loops = data_set_a(np.array([[20.0, 30.0, 40.0], [25.0, 35.0, 50.0]]))
    grid = metrics_of(loops, 1.0)
    for index in np.ndindex(2, 3):
        point = metrics_of(loops.take(index), 1.0)
        for name in NAMES:
            assert getattr(grid, name).shape == (2, 3)
            expected = getattr(point, name)
            np.testing.assert_allclose(getattr(grid.take(index), name), expected, rtol=1e-8, atol=1e-13, err_msg=name)


def test_data_set_a_agrees_with_python_control():
    loops = data_set_a(np.array([20.0, 50.0]))
    found = metrics_of(loops, 1.0)
    for i in range(2):
        one = loops.take(i)
        system = control.ss(one.closed, one.reference_input, one.closed_outputs[2:3], one.reference_feedthrough[2:3])
        info = control.step_info(system, T=np.linspace(0.0, 1.0, 20_001))
        np.testing.assert_allclose(found.rise_time[i], info["RiseTime"], atol=1.1e-4)
        np.testing.assert_allclose(found.settling_time[i], info["SettlingTime"], atol=1.1e-4)
        np.testing.assert_allclose(found.overshoot[i], info["Overshoot"] / 100.0, atol=1e-6)
        np.testing.assert_allclose(found.undershoot[i], info["Undershoot"] / 100.0, atol=1e-6)
        np.testing.assert_allclose(found.steady_state_value[i], STEP[0], rtol=1e-9)


def wrong_way(zero, trim=0.3):
    """``da = (1 - s / zero) 100 / (s^2 + 20 s + 100) r_a``, with a trim value."""
    return loop(
        A=[[0.0, 1.0], [-100.0, -20.0]],
        B=[[0.0], [1.0]],
        E=[[0.0], [100.0]],
        K=np.zeros((1, 2)),
        N=np.zeros((1, 1)),
        C=[[1.0, -1.0 / zero]],
        F=np.zeros((1, 2)),
        D=np.zeros((1, 1)),
        offset=[trim],
        outputs=("da",),
    )


def test_undershoot_of_a_zero_in_the_right_half_plane():
    found = metrics_of(wrong_way(15.0), 2.0)
    # y = 1 - (1 + 10 t) e^(-10 t) - (100 / 15) t e^(-10 t): smallest where y' = 0.
    t = (100.0 / 15.0) / (100.0 + 1000.0 / 15.0)
    lowest = 1.0 - (1.0 + 10.0 * t + 100.0 / 15.0 * t) * np.exp(-10.0 * t)
    np.testing.assert_allclose(found.undershoot, -lowest, rtol=1e-8)
    np.testing.assert_allclose(found.overshoot, 0.0, atol=1e-12)
    assert np.isnan(found.peak_time)
    np.testing.assert_allclose(found.steady_state_value, 0.3 + STEP[0], rtol=1e-13)


def test_a_downward_step_has_the_same_shape():
    up, down = metrics_of(wrong_way(15.0), 2.0), metrics_of(wrong_way(15.0), 2.0, step=-STEP)
    for name in ("rise_time", "settling_time", "overshoot", "undershoot", "bandwidth"):
        np.testing.assert_allclose(getattr(down, name), getattr(up, name), rtol=1e-11, err_msg=name)
    np.testing.assert_allclose(down.steady_state_value, 0.3 - STEP[0], rtol=1e-13)


def test_steady_state_error_without_an_integral():
    one = second_order(20.0, 0.5)
    half = loop(one.A, one.B, one.E, one.K, 0.5 * one.N, one.C, one.F, one.D, one.offset, outputs=one.outputs)
    found = metrics_of(half, 2.0)
    np.testing.assert_allclose(found.steady_state_error, 0.5 * STEP[0], rtol=1e-12)
    np.testing.assert_allclose(found.overshoot, metrics_of(one, 2.0).overshoot, rtol=1e-10)
    asked = step_metrics(half, step_response(half, STEP, 2.0), "da", np.array([0.1]))
    np.testing.assert_allclose(asked.steady_state_error, 0.1 - 0.5 * STEP[0], rtol=1e-12)


def test_what_does_not_exist_is_nan():
    loops = second_order(np.array([10.0, 10.0, 10.0]), np.array([-0.2, 0.1, 0.5]))
    found = metrics_of(loops, 0.12)
    for name in NAMES:
        assert np.isnan(getattr(found, name)[0]), name
    assert np.all(np.isnan(found.settling_time))
    assert np.all(np.isnan(found.rise_time))
    assert np.all(np.isfinite(found.bandwidth[1:]))


def test_a_regulator_has_no_wanted_value():
    one = data_set_a(40.0)
    regulator = loop(
        one.A, one.B, np.zeros((5, 0)), one.K, np.zeros((2, 0)), one.C, one.F, one.D, one.offset, references=()
    )
    found = metrics_of(regulator, 1.0, step=np.zeros(0))
    for name in set(NAMES) - {"steady_state_value"}:
        assert np.isnan(getattr(found, name)), name
    np.testing.assert_allclose(found.steady_state_value, 0.0, atol=1e-15)


def test_no_points_give_no_metrics():
    none = data_set_a(np.array([20.0, 30.0])).take(np.zeros(2, dtype=bool))
    assert metrics_of(none, 1.0).rise_time.shape == (0,)


def test_unknown_output_is_named():
    with pytest.raises(ValueError, match="no output 'dt'"):
        metrics_of(second_order(10.0, 0.5), 1.0, output="dt")


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 100_000), st.floats(0.05, 5.0))
def test_metrics_are_those_of_dense_exact_samples(seed, duration):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((4, 4)) * 15.0
    A -= (np.max(np.linalg.eigvals(A).real) + rng.uniform(1.0, 8.0)) * np.eye(4)
    b, c = rng.standard_normal((4, 1)), rng.standard_normal((1, 4))
    zeros = np.zeros((1, 1))
    one = loop(A, b, b, np.zeros((1, 4)), zeros, c, 0.0 * c, zeros, np.zeros(1), outputs=("da",))
    gain = (c @ np.linalg.solve(-A, b)).item()
    found = metrics_of(one, duration, step=np.ones(1))
    time = np.linspace(0.0, duration, 4001)
    M = np.block([[A, b], [np.zeros((1, 5))]])
    y = (expm(M * time[:, None, None])[:, :4, 4] @ c[0]) / gain
    step = time[1]
    resolution = (np.linalg.norm(A, 2) * step) ** 2 * np.max(np.abs(y))
    np.testing.assert_allclose(found.overshoot, max(np.max(y) - 1.0, 0.0), atol=resolution + 1e-9)
    np.testing.assert_allclose(found.undershoot, max(-np.min(y), 0.0), atol=resolution + 1e-9)
    if np.max(y) > 0.9:
        rise = time[np.argmax(y >= 0.9)] - time[np.argmax(y >= 0.1)]
        np.testing.assert_allclose(found.rise_time, rise, atol=1.01 * step)
    outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
    if outside[-1] == 4000:
        assert np.isnan(found.settling_time)
    else:
        assert found.settling_time >= time[outside[-1]] - 1e-9
