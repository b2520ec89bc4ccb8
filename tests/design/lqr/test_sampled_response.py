"""The response between the samples and its figures, against the code and the plant flown by brute force."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid

from design.assess import achieved, assess
from design.frequency.sampled import sampled_poles
from design.lqr.coded_loop import coded_loop
from design.lqr.sampled_assessment import assess_sampled, sampled_step_metrics
from design.lqr.sampled_design import design_lqr_sampled, emulated_lqr_loop, sampled_lqr_loop
from design.lqr.sampled_response import breaks_of, intervals, sampled_step_response
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.response.demand import ActuatorDemand
from design.response.step_metrics import StepMetrics
from design.sampling import Sampling
from model.actuators import Actuator
from tests.design.coded_flight import fly
from tests.design.lqr_cases import example

INDEX = (0, 2)
STEP = np.array([np.deg2rad(10.0)])
STEPS = ("rise_time", "settling_time", "overshoot", "undershoot", "peak_time", "steady_state_value", "bandwidth")
DEMANDS = tuple(ActuatorDemand.__dataclass_fields__)


def flown(sampling, duration, tab=None, aileron=None, way="redesigned", dense=60):
    """The coded loop of one point, and its flight by brute force: time, states and total torques on the surfaces."""
    tab, aileron = tab or Actuator(), aileron or Actuator()
    model, controller = example("wind_tunnel")
    model = model.take(INDEX)
    if way == "redesigned":
        design = design_lqr_sampled(model, controller, sampling, None, tab, aileron)
        loop = sampled_lqr_loop(model, design)
    else:
        design = design_lqr(model, controller, None, tab, aileron)
        loop = emulated_lqr_loop(model, design, sampling)
    lags = [actuator.torque_loop_bandwidth for actuator in (tab, aileron)]
    n = 4 + sum(lag is not None for lag in lags)
    A, B, place, torque = np.zeros((n, n)), np.zeros((n, 2)), 4, []
    A[:4, :4] = model.A
    for i, lag in enumerate(lags):
        torque.append(None if lag is None else place)
        if lag is None:
            B[:4, i] = model.B[:, i]
        else:
            A[:4, place], A[place, place], B[place, i] = model.B[:, i], -lag, lag
            place += 1
    delays = [sampling.delay + tab.delay, sampling.delay + aileron.delay]
    samples = int(np.ceil(duration / sampling.time - 1e-9))
    flight = fly(A, B, design, sampling.time, delays, STEP, samples, dense=dense)
    torques = [flight.commands[:, i] if at is None else flight.states[:, at] for i, at in enumerate(torque)]
    return model, loop, flight, np.stack(torques, axis=-1) + model.input_offset


CASES = {
    "slow": (Sampling(1e-2, 0.0), 0.3, None, None, "redesigned"),
    "whole": (Sampling(5e-3, 5e-3), 0.25, None, None, "redesigned"),
    "two fractions": (Sampling(6e-3, 2e-3), 0.25, Actuator(delay=1.5e-3), Actuator(delay=7e-3), "redesigned"),
    "lags": (
        Sampling(4e-3, 3e-3),
        0.2,
        Actuator(torque_loop_bandwidth=800.0),
        Actuator(torque_loop_bandwidth=500.0, delay=2e-3),
        "redesigned",
    ),
    "emulated": (Sampling(1e-3, 1e-3), 0.12, None, None, "emulated"),
}


@pytest.mark.parametrize("name", CASES)
def test_between_the_samples_it_is_the_flight(name):
    model, loop, flight, torques = flown(*CASES[name], dense=5)
    response = sampled_step_response(loop, STEP, CASES[name][1])
    held = response.held
    assert held.times[-1, -1] == pytest.approx(response.duration, rel=1e-12)
    names = [response.index(name) for name in ("da", "dt", "da_rate", "dt_rate")]
    ours = held.signals(response.rows[[*names, response.index("T_t"), response.index("T_a")]])
    totals = flight.states[:, [2, 0, 3, 1]] + model.state_offset[[2, 0, 3, 1]]
    wanted = np.concatenate([totals, torques], axis=-1)
    # Each stretch of the flight is a block of ours, its inner points lie inside, where nothing jumps.
    stretches = flight.time.reshape(-1, 5)
    assert len(stretches) == held.blocks
    for k in (1, 2, 3):
        place = (stretches[:, k] - held.times[:, 0]) / held.steps
        np.testing.assert_allclose(place, k * held.intervals / 4, atol=1e-6)
    for k in (0, 4) if held.intervals % 4 else (0, 1, 2, 3, 4):
        at = ours[:, :, k * held.intervals // 4]
        size = np.abs(wanted).max(axis=0)[:, None]
        assert np.max(np.abs(at - wanted[k::5].T) / size) < 1e-8


@pytest.mark.parametrize("name", CASES)
def test_figures_are_those_of_the_flight(name):
    model, loop, flight, torques = flown(*CASES[name])
    found = assess_sampled(loop, STEP, CASES[name][1])
    time, da = flight.time, flight.states[:, 2]
    assert found.step.steady_state_value == pytest.approx(model.state_offset[2] + STEP[0], rel=1e-12)
    course = da / STEP[0]
    assert found.step.overshoot == pytest.approx(course.max() - 1.0, rel=1e-3)
    assert found.step.overshoot >= course.max() - 1.0 - 1e-9
    assert found.step.peak_time == pytest.approx(time[np.argmax(course)], abs=2e-4)
    assert found.step.undershoot == pytest.approx(max(-course.min(), 0.0), abs=1e-5)
    outside = np.flatnonzero(np.abs(course - 1.0) > 0.02)
    if outside[-1] + 2 < len(time):
        assert found.step.settling_time == pytest.approx(time[outside[-1]], abs=3e-4)
    else:
        assert np.isnan(found.step.settling_time)
    rise = time[np.argmax(course >= 0.9)] - time[np.argmax(course >= 0.1)]
    assert found.step.rise_time == pytest.approx(rise, abs=4e-4)
    rates = flight.states[:, [1, 3]]
    for i, demand in enumerate(found.demand):
        torque, power = torques[:, i], torques[:, i] * rates[:, i]
        for value, signal in (
            (demand.peak_torque, torque),
            (demand.peak_rate, rates[:, i]),
            (demand.peak_power, power),
        ):
            largest = np.abs(signal).max()
            assert largest * (1 - 1e-8) <= value <= largest * (1 + 1e-3)
        rms = np.sqrt(trapezoid(torque**2, time) / time[-1])
        assert demand.rms_torque == pytest.approx(rms, rel=1e-3)
        net = cumulative_trapezoid(power, time)[-1]
        assert demand.energy_out - demand.energy_back == pytest.approx(net, rel=1e-3, abs=1e-4 * demand.energy_out)
        angle = flight.states[:, 2 - 2 * (1 - i)] + model.state_offset[2 - 2 * (1 - i)]
        assert demand.peak_deflection == pytest.approx(np.abs(angle).max(), rel=1e-4)
        # The mean acceleration of each stretch is below the peak, and comes near.
        change = np.diff(rates[:, i])[np.diff(time) > 0] / np.diff(time)[np.diff(time) > 0]
        assert demand.peak_acceleration == pytest.approx(np.abs(change).max(), rel=0.03)


def test_ripple_counts():
    """Seen at its samples only, a slow code hides a quarter of its overshoot, and a tenth of its largest rates."""
    _, loop, flight, _ = flown(Sampling(3e-2, 3e-2), 0.3)
    response, found = sampled_step_response(loop, STEP, 0.3), assess_sampled(loop, STEP, 0.3)
    at_samples = response.outputs[:, response.index("da")].max() / STEP[0] - 1.0
    assert found.step.overshoot == pytest.approx(flight.states[:, 2].max() / STEP[0] - 1.0, rel=1e-4)
    assert at_samples < 0.8 * found.step.overshoot
    angle = np.abs(response.outputs[:, response.index("dt")]).max()
    assert angle < 0.9 * found.demand[0].peak_deflection


def test_fast_sampling_is_the_continuous_response():
    """To the first order of the sample time, for designed gains and for emulated ones."""
    model, controller = example("wind_tunnel")
    model = model.take(INDEX)
    continuous = design_lqr(model, controller)
    wanted = assess(lqr_loop(model, continuous), STEP, 0.3)
    quantities = ("overshoot", "bandwidth", "aileron_rate", "damping_ratio", "phase_margin")
    errors = []
    for T in (4e-4, 2e-4):
        sampling = Sampling(T, 0.0)
        loops = (
            sampled_lqr_loop(model, design_lqr_sampled(model, controller, sampling)),
            emulated_lqr_loop(model, continuous, sampling),
        )
        found = [assess_sampled(loop, STEP, 0.3) for loop in loops]
        errors.append(
            [[abs(float(achieved(each, q) / achieved(wanted, q)) - 1.0) for q in quantities] for each in found]
        )
    ratio = np.array(errors[0]) / np.array(errors[1])
    assert np.max(errors[1]) < 0.06
    seen = np.array(errors[1]) > 1e-4
    assert np.all((ratio[seen] > 1.6) & (ratio[seen] < 2.4))


@pytest.mark.parametrize("sampling", [Sampling(2e-3, 2e-3), Sampling(5e-3, 3e-3)])
def test_bandwidth_by_a_scan(sampling):
    """3 dB below 1 of ``r_a -> da`` at the samples."""
    model, controller = example("wind_tunnel")
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, sampling)).take(INDEX)
    bandwidth = float(assess_sampled(loop, STEP, 0.2).step.bandwidth)

    def gain(omega):
        z = np.exp(1j * omega * sampling.time)
        pencil = z * np.eye(len(loop.F)) - loop.closed
        return abs(np.linalg.solve(pencil, loop.reference_input[:, 0])[2])

    assert gain(bandwidth) == pytest.approx(np.sqrt(0.5), rel=1e-7)
    assert all(gain(omega) > np.sqrt(0.5) for omega in np.linspace(1e-3, 0.999, 200) * bandwidth)


def test_grid_equals_points():
    model, controller = example("wind_tunnel")
    design = design_lqr_sampled(model, controller, Sampling(6e-3, 4e-3))
    loop = sampled_lqr_loop(model, design)
    grid = assess_sampled(loop, STEP, 0.3)
    for index in [(0, 0), (1, 1), (1, 3)]:
        point = assess_sampled(loop.take(index), STEP, 0.3)
        for name in StepMetrics.__dataclass_fields__:
            np.testing.assert_allclose(
                getattr(grid.step.take(index), name), getattr(point.step, name), rtol=1e-9, atol=1e-12
            )
        for ours, theirs in zip(grid.demand, point.demand, strict=True):
            for name in DEMANDS:
                np.testing.assert_allclose(getattr(ours.take(index), name), getattr(theirs, name), rtol=1e-9)
        np.testing.assert_allclose(grid.return_difference[index], point.return_difference, rtol=1e-9)
        np.testing.assert_allclose(grid.largest_real_part[index], point.largest_real_part, rtol=1e-10)


def test_points_with_other_meshes_and_many_parts(monkeypatch):
    """A stiff neighbour, and a memory that holds a single point, change nothing."""
    model, controller = example("wind_tunnel")
    A = model.A.copy()
    A[0, 1, 3, 3] -= 3000.0
    model = replace(model, A=A)
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(6e-3, 4e-3)))
    assert len(np.unique(intervals(loop))) > 1
    whole = assess_sampled(loop, STEP, 0.3)
    monkeypatch.setattr("design.lqr.sampled_assessment.PART", 1)
    for name in ("settling_time", "overshoot", "rise_time"):
        parts = getattr(assess_sampled(loop, STEP, 0.3).step, name)
        np.testing.assert_allclose(parts, getattr(whole.step, name), rtol=1e-10)
    alone = assess_sampled(loop.take((0, 0)), STEP, 0.3)
    np.testing.assert_allclose(whole.demand[0].peak_rate[0, 0], alone.demand[0].peak_rate, rtol=1e-12)


def test_an_unstable_loop_has_poles_and_no_metrics():
    model, controller = example("wind_tunnel")
    design = design_lqr(model, controller)
    found = assess_sampled(emulated_lqr_loop(model, design, Sampling(6e-3, 6e-3)), STEP, 3.0)
    assert not found.stable.any()
    assert np.isfinite(found.largest_real_part).all()
    for quantity in ("settling_time", "overshoot", "bandwidth", "gain_margin", "phase_margin", "sensitivity_peak"):
        assert np.isnan(achieved(found, quantity)).all()
    assert np.isnan(found.step.steady_state_error).all()


def test_modes_that_a_delay_ends_are_not_counted():
    """Twelve samples of delay put twelve poles of each command at 0, where rounding strews them far."""
    T = 1e-3
    model, controller = example("wind_tunnel")
    prompt = assess_sampled(sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(T, 0.0))), STEP, 0.2)
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(T, 12 * T)))
    late = assess_sampled(loop, STEP, 0.2)
    np.testing.assert_allclose(late.damping_ratio, prompt.damping_ratio, rtol=1e-6)
    assert np.isnan(late.poles).sum() == 8 * 24
    assert sampled_poles(loop.closed, T).damping_ratio.min(axis=-1).max() < prompt.damping_ratio.max()


def test_quantities():
    model, controller = example("wind_tunnel")
    found = assess_sampled(
        sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(2e-3, 2e-3))), STEP, 0.3
    )
    assert found.actuators == ("tab", "aileron")
    np.testing.assert_array_equal(achieved(found, "aileron_power"), found.demand[1].peak_power)
    np.testing.assert_allclose(achieved(found, "sensitivity_peak"), 1.0 / found.return_difference.min(axis=-1))
    margins = np.minimum(found.margins[0].gain_margin_up_db, -found.margins[0].gain_margin_down_db)
    assert np.all(achieved(found, "gain_margin") <= margins)
    for quantity in ("phase_margin", "disk_margin", "delay_margin", "damping_ratio", "settling_time", "tab_deflection"):
        assert np.isfinite(achieved(found, quantity)).all()
    assert achieved(found, "noise_gain") is None
    assert found.stable.all()


def test_two_references_and_none():
    model, controller = example("wind_tunnel")
    weights = replace(controller.weights, tab_integral=0.02)
    both = replace(controller, reference="aileron_and_tab", weights=weights)
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, both, Sampling(2e-3, 2e-3)))
    response = sampled_step_response(loop, np.deg2rad([10.0, -5.0]), 0.4)
    for output, size in (("da", 10.0), ("dt", -5.0)):
        metrics = sampled_step_metrics(loop, response, output)
        assert np.abs(metrics.steady_state_error).max() < 1e-10
        trim = loop.continuous.offset[..., response.index(output)]
        np.testing.assert_allclose(metrics.steady_state_value - trim, np.deg2rad(size), rtol=1e-8)
    free = sampled_step_metrics(loop, response, "da_rate")
    assert np.isnan(free.bandwidth).all()
    regulator = replace(controller, reference="none")
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, regulator, Sampling(2e-3, 2e-3)))
    found = assess_sampled(loop, np.zeros(0), 0.1)
    assert np.isnan(found.step.overshoot).all()
    np.testing.assert_allclose(found.demand[1].peak_rate, 0.0)
    with pytest.raises(ValueError, match="no output"):
        sampled_step_metrics(loop, sampled_step_response(loop, np.zeros(0), 0.1), "speed")


def test_where_commands_arrive():
    model, controller = example("wind_tunnel")
    loop = lqr_loop(model.take(INDEX), design_lqr(model.take(INDEX), controller))
    for sampling, wanted in (
        (Sampling(2e-3, 0.0), (0.0,)),
        (Sampling(2e-3, 4e-3), (0.0,)),
        (Sampling(2e-3, 5e-3), (0.0, 0.5)),
        (Sampling(1e-3, 3 * 1e-3), (0.0,)),
    ):
        assert breaks_of(coded_loop(loop, sampling)) == pytest.approx(wanted)
    uneven = coded_loop(replace(loop, delay=(0.5e-3, 3.4e-3)), Sampling(2e-3, 1e-3))
    assert breaks_of(uneven) == pytest.approx((0.0, 0.2, 0.75))


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf])
def test_durations_out_of_range(duration):
    model, controller = example("wind_tunnel")
    loop = emulated_lqr_loop(model, design_lqr(model, controller), Sampling(1e-3, 1e-3))
    with pytest.raises(ValueError, match="duration"):
        sampled_step_response(loop, STEP, duration)


def test_samples_are_those_of_the_code():
    model, controller = example("wind_tunnel")
    loop = emulated_lqr_loop(model, design_lqr(model, controller), Sampling(1e-3, 1e-3))
    response = sampled_step_response(loop, STEP, 0.0105)
    assert response.time.shape == (2, 4, 12)
    assert response.duration == pytest.approx(0.011)
    assert sampled_step_response(loop, STEP, 0.3).time.shape[-1] == 301
    np.testing.assert_allclose(response.held.states[..., ::1, 0, :4], response.states[..., :-1, :], atol=1e-12)
    np.testing.assert_allclose(response.held.states[..., -1, -1, :4], response.states[..., -1, :], atol=1e-12)
    np.testing.assert_allclose(np.exp(response.poles * 1e-3), response.closed_poles, atol=1e-12)
    np.testing.assert_array_equal(response.peaks >= np.abs(response.outputs).max(axis=-2) * (1 - 1e-12), True)
