"""Step responses against python-control, an ODE solver and closed forms."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

from design.response.step_response import step_response
from tests.design.step_loops import data_set_a, loop, random_stable, second_order, servo_and_aileron

STEP = np.array([np.deg2rad(10.0)])


def control_outputs(one, step, time):
    system = control.ss(one.closed, one.reference_input, one.closed_outputs, one.reference_feedthrough)
    inputs = np.repeat(np.reshape(step, (-1, 1)), len(time), axis=1)
    return control.forced_response(system, time, inputs).outputs.T + one.offset


@pytest.mark.parametrize("loops", [data_set_a(np.array([20.0, 35.0, 50.0])), random_stable(1, 4)])
def test_response_is_that_of_python_control(loops):
    response = step_response(loops, STEP, 0.8, 301)
    for i in range(len(loops.A)):
        expected = control_outputs(loops.take(i), STEP, np.linspace(0.0, 0.8, 301))
        scale = np.max(np.abs(expected), axis=0)
        np.testing.assert_allclose(response.outputs[i] / scale, expected / scale, rtol=0.0, atol=1e-9)


def test_response_is_that_of_an_ode_solver():
    one = data_set_a(50.0)
    response = step_response(one, STEP, 0.5, 26)
    push = one.reference_input @ STEP
    solution = solve_ivp(
        lambda t, x: one.closed @ x + push,
        (0.0, 0.5),
        np.zeros(5),
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        t_eval=np.linspace(0.0, 0.5, 26),
    )
    np.testing.assert_allclose(response.states, solution.y.T, atol=1e-10 * np.max(np.abs(solution.y)))


def test_second_order_response_in_closed_form():
    w, z = 30.0, 0.3
    response = step_response(second_order(w, z, trim_torque=-0.4), STEP, 0.6)
    t, wd = response.time, w * np.sqrt(1.0 - z**2)
    angle = STEP[0] * (1.0 - np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t)))
    rate = STEP[0] * np.exp(-z * w * t) * w**2 / wd * np.sin(wd * t)
    torque = w**2 * (STEP[0] - angle) - 2.0 * z * w * rate - 0.4
    np.testing.assert_allclose(response.outputs, np.stack([angle, rate, torque], axis=-1), atol=1e-11)


def test_first_sample_holds_the_jump_of_the_feed_forward():
    response = step_response(second_order(30.0, 0.3, trim_torque=-0.4), STEP, 0.6)
    np.testing.assert_allclose(response.outputs[0], [0.0, 0.0, 900.0 * STEP[0] - 0.4], rtol=1e-15)
    np.testing.assert_array_equal(response.states[0], 0.0)


def test_singular_closed_loop_is_exact():
    free = loop(
        A=[[0.0, 1.0], [0.0, 0.0]],
        B=[[0.0], [1.0]],
        E=np.zeros((2, 1)),
        K=np.zeros((1, 2)),
        N=[[3.0]],
        C=np.eye(2),
        F=np.zeros((2, 2)),
        D=np.zeros((2, 1)),
        offset=[0.1, 0.0],
        outputs=("da", "da_rate"),
    )
    response = step_response(free, np.array([2.0]), 4.0, 9)
    np.testing.assert_allclose(response.outputs[:, 0], 0.1 + 3.0 * response.time**2, rtol=1e-13)
    assert np.all(np.isnan(response.final_outputs))


def test_grid_gives_the_same_as_each_point():
    loops = data_set_a(np.array([[20.0, 30.0, 40.0], [25.0, 35.0, 50.0]]))
    steps = np.deg2rad(np.arange(6.0).reshape(2, 3, 1) + 1.0)
    grid = step_response(loops, steps, 0.7, 203)
    assert grid.outputs.shape == (2, 3, 203, 6)
    assert grid.time.shape == (2, 3, 203)
    for index in np.ndindex(2, 3):
        point = step_response(loops.take(index), steps[index], 0.7, 203)
        taken = grid.take(index)
        for name in ("time", "states", "outputs", "reference", "peaks", "final_outputs"):
            expected = getattr(point, name)
            np.testing.assert_allclose(
                getattr(taken, name), expected, rtol=1e-11, atol=1e-13 * np.max(np.abs(expected)), err_msg=name
            )
            np.testing.assert_allclose(
                getattr(grid, name)[index], expected, rtol=1e-11, atol=1e-13 * np.max(np.abs(expected)), err_msg=name
            )


def test_no_points_give_no_responses():
    none = data_set_a(np.array([20.0, 30.0])).take(np.zeros(2, dtype=bool))
    response = step_response(none, STEP, 0.7, 11)
    assert response.outputs.shape == (0, 11, 6)
    assert response.peaks.shape == (0, 6)


def test_times_are_one_shared_read_only_row():
    response = step_response(data_set_a(np.array([20.0, 30.0])), STEP, 0.7, 11)
    assert response.time.strides[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        response.outputs[0, 0, 0] = 1.0


@settings(max_examples=25, deadline=None)
@given(st.floats(-3.0, 3.0), st.integers(0, 10_000))
def test_response_less_trim_is_linear_in_the_step(size, seed):
    loops = random_stable(seed, 2, n=3)
    unit = step_response(loops, np.ones(1), 0.5, 20).outputs - loops.offset[:, None]
    scaled = step_response(loops, np.array([size]), 0.5, 20).outputs - loops.offset[:, None]
    np.testing.assert_allclose(scaled, size * unit, rtol=1e-9, atol=1e-10 * np.max(np.abs(unit)))


def test_unstable_loops_are_followed_and_overflow_without_a_warning():
    loops = second_order(np.array([30.0, 30.0]), np.array([-0.1, -0.9]))
    response = step_response(loops, STEP, 2.0)
    expected = control_outputs(loops.take(0), STEP, response.time[0])
    np.testing.assert_allclose(response.outputs[0], expected, atol=1e-9 * np.max(np.abs(expected)))
    assert np.all(np.isnan(response.final_outputs))
    # The largest |output| of a growing response is at its end, or at the last turn before it.
    assert np.all(response.peaks[0] >= np.max(np.abs(response.outputs[0]), axis=0))
    far = step_response(loops, STEP, 100.0)
    assert not np.all(np.isfinite(far.outputs[1]))
    assert not np.any(np.isfinite(far.peaks[1]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": np.inf}, "duration"),
        ({"duration": np.nan}, "duration"),
        ({"duration": 1.0, "samples": 1}, "two samples"),
    ],
)
def test_impossible_requests_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        step_response(second_order(10.0, 0.5), STEP, **arguments)


def test_a_reference_of_the_wrong_size_is_refused():
    with pytest.raises(ValueError, match="broadcast"):
        step_response(second_order(10.0, 0.5), np.ones(3), 1.0)


def test_unknown_output_is_named():
    with pytest.raises(ValueError, match="no output 'dt'; it has da, da_rate, T_a"):
        step_response(second_order(10.0, 0.5), STEP, 1.0).index("dt")


def brute_peak(generator, row, duration):
    """Largest |row z|: samples even and geometric, then a bounded search of the exact solution about the largest."""
    times = np.union1d(np.linspace(0.0, duration, 6001), duration * np.logspace(-6.0, 0.0, 1201))
    start = np.zeros(len(generator))
    start[-1] = 1.0
    states = expm(generator * times[:, None, None])[..., -1]
    sizes = np.abs(states @ row)
    k = int(np.argmax(sizes))
    low, high = times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)]
    found = minimize_scalar(
        lambda t: -abs(row @ expm(generator * t)[:, -1]), bounds=(low, high), options={"xatol": 1e-9 * high}
    )
    return max(sizes[k], -found.fun)


@pytest.mark.parametrize(
    ("loops", "duration"),
    [
        (data_set_a(np.array([50.0])), 1.0),
        (random_stable(3, 2), 0.5),
        (random_stable(4, 1), 20.0),
        # A 1 kHz servo in ten seconds, and one with next to no damping: the first is over before an even
        # sampling has begun, the second turns 160 times.
        (servo_and_aileron(2.0 * np.pi * 1000.0, 0.7, 5.0, 0.4).take(None), 10.0),
        (servo_and_aileron(100.0, 0.01, 20.0, 0.5).take(None), 10.0),
    ],
)
def test_peaks_are_those_of_the_continuous_response(loops, duration):
    response = step_response(loops, STEP, duration)
    for i in range(len(loops.A)):
        expected = [brute_peak(response.generator[i], row, duration) for row in response.rows[i]]
        np.testing.assert_allclose(response.peaks[i], expected, rtol=1e-8)
