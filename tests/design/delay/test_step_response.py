"""Step responses with delays against the method of steps, adaptive integration, and closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from design.delay.step_response import DelayedResponse, delayed_step_response
from design.delay.with_pade import without_delay
from design.response.demand import actuator_demand
from design.response.step_metrics import step_metrics
from design.response.step_response import step_response
from tests.design.delay.delayed_loops import DRIVES, full_loop, loop, random_loops, tab_only
from tests.design.delay.method_of_steps import outputs

STEP = np.array([np.deg2rad(10.0)])


def largest_errors(ours, exact, offset):
    """Largest error of each output over its largest change."""
    size = np.abs(exact - offset).max(axis=0)
    return np.abs(ours - exact).max(axis=0) / np.where(size > 0.0, size, 1.0)


@pytest.mark.parametrize("drive", list(DRIVES))
@pytest.mark.parametrize(("delay", "angles", "torque"), [
    (0.001, 2e-11, 5e-9), (0.005, 2e-11, 5e-8), (0.015, 2e-9, 1e-6), (0.05, 1e-6, 1e-4),
])  # fmt: skip
def test_tab_loops_against_the_method_of_steps(plant_a, drive, delay, angles, torque):
    tab = tab_only(plant_a, drive, delay)
    duration, samples = (0.15, 2001) if delay < 0.004 else (0.5, 2001)
    response = delayed_step_response(tab, STEP, duration, samples)
    time = np.linspace(0.0, duration, samples)
    corner = np.abs(time / delay - np.round(time / delay)) < 1e-6
    time = np.where(corner, time + 1e-12, time)
    for index in ((0, 1), (1, 2)):
        exact = outputs(tab.take(index), STEP, time)
        error = dict(zip(tab.outputs, largest_errors(response.outputs[index], exact, tab.offset[index]), strict=True))
        assert max(error["da"], error["dt"], error["dt_command"]) < angles
        assert error.get("T_t", 0.0) < torque
        assert error["dt_rate"] < (torque if drive != "ideal" else 20.0 * torque)


def test_the_reference_itself_against_adaptive_integration(plant_a):
    """The method of steps by collocation and by an integrator with dense output for what arrives agree."""
    tab = tab_only(plant_a, "second_order", 0.015).take((0, 1))
    time = np.linspace(0.0, 0.12, 97)[1:-1] + 1e-6
    sent, states, x = [lambda t: 0.0], [], np.zeros(tab.A.shape[-1])
    for k in range(8):
        found = solve_ivp(
            lambda t, x: tab.A @ x + tab.B[:, 0] * sent[-1](t - 0.015) + tab.E @ STEP, (0.015 * k, 0.015 * (k + 1)), x,
            method="DOP853", rtol=1e-11, atol=1e-14, dense_output=True,
        )  # fmt: skip
        states.append(found.sol)
        sent.append(lambda t, sol=found.sol: -(tab.K @ sol(t))[0])
        x = found.y[:, -1]
    exact = np.array([tab.C[:2] @ states[int(t / 0.015)](t) for t in time]) + tab.offset[:2]
    np.testing.assert_allclose(outputs(tab, STEP, time)[:, :2], exact, atol=1e-9 * STEP[0])


@pytest.mark.parametrize("delay", [(0.3,), (0.3, 0.3), (0.3, 0.0)])
def test_random_loops_with_every_matrix(delay):
    """Commands that jump with the reference, outputs that take them and their rates; one input without a delay."""
    full = full_loop(delay, seed=3)
    response = delayed_step_response(full, np.array([0.7]), 2.0, 1601)
    exact_loop = full
    if 0.0 in delay:
        closed = full.B[:, 1:] @ full.K[1:]
        exact_loop = loop(
            full.A - closed, full.B[:, :1], full.K[:1], (0.3,), E=full.E + full.B[:, 1:] @ full.N[1:], N=full.N[:1],
            C=full.C - full.D[:, 1:] @ full.K[1:], F=full.F - full.H[:, 1:] @ full.K[1:], D=full.D[:, :1],
            H=full.H[:, :1], offset=full.offset + full.D[:, 1:] @ full.N[1:] @ np.array([0.7]),
        )  # fmt: skip
    time = np.linspace(0.0, 2.0, 1601)
    time = np.where(np.abs(time / 0.3 - np.round(time / 0.3)) < 1e-9, time + 1e-12, time)
    exact = outputs(exact_loop, np.array([0.7]), time)
    np.testing.assert_allclose(largest_errors(response.outputs, exact, full.offset), 0.0, atol=1e-6)
    np.testing.assert_allclose(response.outputs[time < 0.9], exact[time < 0.9], atol=1e-11 * np.abs(exact).max())


def test_an_integrator_by_hand():
    """``x' = u(t - 1)``, ``u = r - x``: t - 1, then t - 1 - (t - 2)^2 / 2, then + (t - 3)^3 / 6."""
    one = loop([[0.0]], [[1.0]], [[1.0]], (1.0,), N=[[1.0]], C=[[1.0]])
    response = delayed_step_response(one, np.ones(1), 4.0, 401)
    t = response.time
    exact = sum((-1.0) ** (k + 1) * np.maximum(t - k, 0.0) ** k / k_factorial
                for k, k_factorial in ((1, 1.0), (2, 2.0), (3, 6.0)))  # fmt: skip
    np.testing.assert_allclose(response.outputs[t < 3.0, 0], exact[t < 3.0], atol=1e-14)
    np.testing.assert_allclose(response.outputs[:, 0], exact, atol=1e-6)


def test_mesh_is_the_response(plant_a):
    """Blocks end at the corners; signals, their rates and the samples are of one response."""
    tab = tab_only(plant_a, "first_order", 0.015)
    response = delayed_step_response(tab, STEP, 0.5)
    mesh = response.graded
    assert mesh.times[0, 0] == 0.0
    np.testing.assert_allclose(mesh.times[1:, 0], mesh.times[:-1, -1], rtol=1e-12)
    assert mesh.times[-1, -1] == pytest.approx(0.5)
    corners = 0.015 * np.arange(1, 4)
    assert np.abs(mesh.times[:, 0] - corners[:, None]).min(axis=-1).max() < 1e-12
    signals = mesh.signals(response.rows)[0, 1]
    inner = mesh.times[:, 1:-1]
    exact = outputs(tab.take((0, 1)), STEP, inner.ravel())
    ours = np.moveaxis(signals[:, :, 1:-1], 0, -1).reshape(-1, len(tab.outputs))
    error = largest_errors(ours, exact, tab.offset[0, 1])
    assert error.max() < 1e-6
    # The torque has its corner at the end of a block: what was, and what will be.
    torque, rate = tab.outputs.index("T_t"), tab.outputs.index("dt_rate")
    before = outputs(tab.take((0, 1)), STEP, corners * (1.0 - 1e-9))
    ends = [int(np.argmin(np.abs(mesh.times[:, -1] - corner))) for corner in corners]
    np.testing.assert_allclose(signals[torque, ends, -1], before[:, torque], atol=1e-8)
    slope = mesh.signals(response.rows[..., rate : rate + 1, :] @ response.generator)[0, 1, 0]
    h = 1e-7
    middle = mesh.times[:, 7]
    difference = (outputs(tab.take((0, 1)), STEP, middle + h) - outputs(tab.take((0, 1)), STEP, middle - h)) / (2 * h)
    np.testing.assert_allclose(slope[:, 7], difference[:, rate], atol=1e-5 * np.abs(slope).max())


def test_metrics_and_demand_are_those_of_dense_samples(plant_a):
    tab = tab_only(plant_a, "second_order", 0.015)
    response = delayed_step_response(tab, STEP, 2.0)
    metrics = step_metrics(without_delay(tab), response, "da", STEP)
    demand = actuator_demand(without_delay(tab), response, "tab")
    time = np.arange(1, 200_000) * 1e-5 + 1e-9
    exact = outputs(tab.take((0, 1)), STEP, time)
    names = tab.outputs.index
    da = (exact[:, names("da")] - tab.offset[0, 1, names("da")]) / STEP[0]
    assert metrics.overshoot[0, 1] == pytest.approx(max(da.max() - 1.0, 0.0), abs=1e-8)
    assert metrics.settling_time[0, 1] == pytest.approx(time[np.abs(da - 1.0) > 0.02][-1], abs=2e-5)
    assert metrics.steady_state_value[0, 1] - tab.offset[0, 1, names("da")] == pytest.approx(STEP[0], rel=1e-10)
    torque, rate = exact[:, names("T_t")], exact[:, names("dt_rate")]
    assert demand.peak_torque[0, 1] == pytest.approx(np.abs(torque).max(), rel=1e-6)
    assert demand.peak_rate[0, 1] == pytest.approx(np.abs(rate).max(), rel=1e-6)
    assert demand.peak_power[0, 1] == pytest.approx(np.abs(torque * rate).max(), rel=1e-6)
    assert demand.energy_out[0, 1] == pytest.approx(np.maximum(torque * rate, 0.0).sum() * 1e-5, rel=1e-3)
    assert demand.rms_torque[0, 1] == pytest.approx(np.sqrt(np.mean(torque**2)), rel=1e-4)


@pytest.mark.parametrize(("duration", "error"), [(0.31, 1e-3), (0.6, 5e-3), (0.65, 1e-3), (0.9, 1e-3), (1.0, 1e-6)])
def test_responses_of_a_few_delays(duration, error):
    """A response that ends before the last exact delay has one exact delay less, and is that much worse."""
    one = full_loop((0.3,), seed=3)
    response = delayed_step_response(one, np.array([0.7]), duration, 101)
    time = np.linspace(0.0, duration, 101)
    time = np.where(np.abs(time / 0.3 - np.round(time / 0.3)) < 1e-9, time + 1e-12, time)[:-1]
    exact = outputs(one, np.array([0.7]), time)
    np.testing.assert_allclose(largest_errors(response.outputs[:-1], exact, one.offset), 0.0, atol=error)
    assert response.graded.times[-1, -1] == pytest.approx(duration)


def test_inputs_of_different_delays_have_chains_that_start_empty():
    one = full_loop((0.3, 0.5), seed=3)
    response = delayed_step_response(one, np.array([0.7]), 2.0)
    plain = step_response(without_delay(one), np.array([0.7]), 2.0)
    np.testing.assert_array_equal(response.outputs, plain.outputs)


def test_without_a_delay():
    one = full_loop((0.0, 0.0), seed=3)
    response = delayed_step_response(one, np.array([0.7]), 2.0)
    np.testing.assert_array_equal(response.outputs, step_response(one, np.array([0.7]), 2.0).outputs)


def test_grid_equals_points(plant_a):
    tab = tab_only(plant_a, "second_order", 0.005)
    whole = delayed_step_response(tab, STEP, 0.3)
    for index in ((0, 0), (1, 3)):
        one = delayed_step_response(tab.take(index), STEP, 0.3)
        scale = np.abs(one.outputs).max(axis=0) + 1e-300
        np.testing.assert_allclose(whole.outputs[index] / scale, one.outputs / scale, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(whole.peaks[index], one.peaks, rtol=1e-8)
    part = whole.take((slice(None), 1))
    assert isinstance(part, DelayedResponse)
    np.testing.assert_allclose(part.peaks, whole.peaks[:, 1], rtol=1e-8)


def test_an_unstable_loop_grows_as_it_should():
    """``x' = -2.5 x(t - 1)`` from a push."""
    one = loop([[0.0]], [[1.0]], [[2.5]], (1.0,), E=[[1.0]], C=[[1.0]])
    response = delayed_step_response(one, np.ones(1), 12.0, 301)
    exact = outputs(one, np.ones(1), response.time[:-1] + 1e-10)
    assert np.abs(exact[-20:]).max() > 5.0 * np.abs(exact[:100]).max()
    np.testing.assert_allclose(response.outputs[:-1], exact, atol=1e-6 * np.abs(exact).max())
    assert np.isnan(response.final_outputs).all()


def test_requests_that_cannot_be_answered():
    one = random_loops(1, 3, (0.5,), 1).take(0)
    for duration in (0.5, -1.0, np.inf, np.nan):
        with pytest.raises(ValueError, match="delay"):
            delayed_step_response(one, np.ones(1), duration)
    with pytest.raises(ValueError, match="samples"):
        delayed_step_response(one, np.ones(1), 2.0, 1)
