"""Actuator demand against closed forms, an ODE solver's integrals and dense samples."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from design.response.demand import ActuatorDemand, actuator_demand, actuator_demands, envelope_demand
from design.response.step_response import step_response
from tests.design.step_loops import data_set_a, loop, random_stable, second_order, servo_and_aileron

STEP = np.array([np.deg2rad(10.0)])
PEAKS = ("peak_torque", "peak_rate", "peak_deflection", "peak_acceleration", "peak_power")
NAMES = (*PEAKS, "rms_torque", "holding_torque", "rms_power", "energy_out", "energy_back", "rms_acceleration")


def demand_of(loops, duration, actuator="aileron", step=STEP):
    return actuator_demand(loops, step_response(loops, step, duration, 101), actuator)


def with_deflection_outputs(one):
    """The hand-made second-order loop has exactly the outputs of one actuator."""
    assert one.outputs == ("da", "da_rate", "T_a")
    return one


def test_second_order_in_closed_form():
    w, z = 25.0, 0.4
    found = demand_of(with_deflection_outputs(second_order(w, z)), 2.0)
    r, wd = STEP[0], w * np.sqrt(1.0 - z**2)
    # The torque of a unit inertia is its acceleration: largest at t = 0+, by the feed-forward.
    np.testing.assert_allclose(found.peak_torque, r * w**2, rtol=1e-12)
    np.testing.assert_allclose(found.peak_acceleration, r * w**2, rtol=1e-12)
    turn = np.arccos(z) / wd
    np.testing.assert_allclose(found.peak_rate, r * w * np.exp(-z * w * turn), rtol=1e-10)
    np.testing.assert_allclose(found.peak_deflection, r * (1.0 + np.exp(-np.pi * z * w / wd)), rtol=1e-10)
    np.testing.assert_allclose(found.holding_torque, 0.0, atol=1e-12)
    # With no trim torque the net work is the kinetic energy left at the end, here none.
    np.testing.assert_allclose(found.energy_out, found.energy_back, rtol=1e-6)


def test_net_work_is_the_kinetic_energy_reached():
    w, z, duration = 25.0, 0.4, 0.05
    found = demand_of(second_order(w, z), duration)
    wd = w * np.sqrt(1.0 - z**2)
    rate = STEP[0] * np.exp(-z * w * duration) * w**2 / wd * np.sin(wd * duration)
    np.testing.assert_allclose(found.energy_out - found.energy_back, 0.5 * rate**2, rtol=1e-9)


def test_trim_torque_is_held_and_counted():
    found = demand_of(second_order(25.0, 0.4, trim_torque=-30.0), 2.0)
    plain = demand_of(second_order(25.0, 0.4), 2.0)
    np.testing.assert_allclose(found.holding_torque, 30.0, rtol=1e-12)
    dense = step_response(second_order(25.0, 0.4, trim_torque=-30.0), STEP, 2.0, 100_001).outputs
    np.testing.assert_allclose(found.peak_torque, np.max(np.abs(dense[:, 2])), rtol=1e-6)
    # A constant torque does the work torque times the angle gone through.
    net = (found.energy_out - found.energy_back) - (plain.energy_out - plain.energy_back)
    np.testing.assert_allclose(net, -30.0 * STEP[0], rtol=1e-7)


def solver_integrals(response, i, letter):
    """RMS torque, power and acceleration, energy out and back by an ODE solver with the integrals among its states."""
    M, T = response.generator[i], response.duration
    torque, rate = (response.rows[i, response.index(name)] for name in (f"T_{letter}", f"d{letter}_rate"))
    n = len(M)
    # Of the size of the others, or it would have all of the solver's attention.
    scale = np.abs(torque).max() / max(np.abs(rate @ M).max(), 1e-300)

    def slope(t, y):
        push = torque @ y[:n]
        power = push * (rate @ y[:n])
        bend = scale * (rate @ M @ y[:n])
        return np.concatenate([M @ y[:n], [push**2, power**2, bend**2, max(power, 0.0), max(-power, 0.0)]])

    start = np.zeros(n + 5)
    start[n - 1] = 1.0
    end = solve_ivp(slope, (0.0, T), start, method="DOP853", rtol=1e-12, atol=1e-16).y[n:, -1]
    return np.array([*np.sqrt(end[:2] / T), np.sqrt(end[2] / T) / scale, end[3], end[4]])


@pytest.mark.parametrize(
    ("loops", "duration"),
    [(data_set_a(np.array([20.0, 50.0])), 0.5), (random_stable(21, 2), 0.6), (random_stable(22, 2), 3.0)],
)
def test_integrals_are_those_of_an_ode_solver(loops, duration):
    response = step_response(loops, STEP, duration, 101)
    for letter, found in zip("ta", actuator_demands(loops, response, ("tab", "aileron")), strict=True):
        for i in range(2):
            expected = solver_integrals(response, i, letter)
            means = [found.rms_torque[i], found.rms_power[i], found.rms_acceleration[i]]
            known = np.isfinite(means)
            np.testing.assert_allclose(np.array(means)[known], expected[:3][known], rtol=1e-8)
            energies = [found.energy_out[i], found.energy_back[i]]
            np.testing.assert_allclose(energies, expected[3:], atol=2e-8 * np.max(expected[3:]))


def dense_signals(response, i, letter):
    """Torque, rate, deflection, acceleration and power at many exact samples, fine near t = 0."""
    T = response.duration
    times = np.union1d(np.linspace(0.0, T, 8001), T * np.logspace(-6.0, 0.0, 4001))
    states = expm(response.generator[i] * times[:, None, None])[..., -1]
    names = (f"T_{letter}", f"d{letter}_rate", f"d{letter}")
    torque, rate, deflection = (states @ response.rows[i, response.index(name)] for name in names)
    acceleration = states @ (response.rows[i, response.index(names[1])] @ response.generator[i])
    return torque, rate, deflection, acceleration, torque * rate


@pytest.mark.parametrize(
    ("loops", "duration"),
    [
        (data_set_a(np.array([50.0])), 1.0),
        (random_stable(23, 1), 0.5),
        (servo_and_aileron(2.0 * np.pi * 1000.0, 0.7, 5.0, 0.4).take(None), 10.0),
        (second_order(np.array([15.0]), np.array([-0.1]), trim_torque=3.0), 1.0),
    ],
)
def test_peaks_are_not_missed_and_not_invented(loops, duration):
    response = step_response(loops, STEP, duration, 101)
    for actuator in ("tab", "aileron")[-loops.B.shape[-1] :]:
        found = actuator_demand(loops, response, actuator)
        for name, signal in zip(
            ("peak_torque", "peak_rate", "peak_deflection", "peak_acceleration", "peak_power"),
            dense_signals(response, 0, actuator[0]),
            strict=True,
        ):
            sampled = np.max(np.abs(signal))
            # A dense sample is never above the peak, and below it by no more than its distance to it allows.
            assert getattr(found, name)[0] >= sampled * (1.0 - 1e-9), name
            np.testing.assert_allclose(getattr(found, name)[0], sampled, rtol=2e-5, err_msg=name)


def test_grid_gives_the_same_as_each_point():
    loops = data_set_a(np.array([[20.0, 30.0, 40.0], [25.0, 35.0, 50.0]]))
    for actuator in ("tab", "aileron"):
        grid = demand_of(loops, 1.0, actuator)
        for index in np.ndindex(2, 3):
            point = demand_of(loops.take(index), 1.0, actuator)
            for name in NAMES:
                assert getattr(grid, name).shape == (2, 3)
                np.testing.assert_allclose(
                    getattr(grid.take(index), name), getattr(point, name), rtol=1e-8, atol=1e-13, err_msg=name
                )


def test_both_actuators_together_are_each_alone():
    loops = data_set_a(np.array([30.0, 45.0]))
    response = step_response(loops, STEP, 1.0)
    for name, together in zip(("aileron", "tab"), actuator_demands(loops, response, ("aileron", "tab")), strict=True):
        alone = actuator_demand(loops, response, name)
        for quantity in NAMES:
            np.testing.assert_allclose(getattr(together, quantity), getattr(alone, quantity), rtol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.1, 10.0), st.integers(0, 10_000), st.sampled_from(["tab", "aileron"]))
def test_without_trim_torque_demand_scales_with_the_step(size, seed, actuator):
    trimmed = random_stable(seed, 2, n=3)
    loops = replace(trimmed, offset=np.zeros((2, 6)))
    one, scaled = (demand_of(loops, 0.7, actuator, step) for step in (STEP, size * STEP))
    for name in NAMES:
        power = 2 if "power" in name or "energy" in name else 1
        expected = size**power * getattr(one, name)
        floor = 1e-9 * size**2 * (one.energy_out + one.energy_back) if "energy" in name else 0.0
        np.testing.assert_array_less(np.abs(getattr(scaled, name) - expected), 1e-7 * np.abs(expected) + floor + 1e-300)


def test_jumps_ask_for_what_no_actuator_has():
    def outputs_through(rows):
        """One state that the step jumps straight past, seen as torque, rate and deflection through D."""
        return loop(
            A=[[-5.0]], B=[[1.0]], E=[[0.0]], K=[[0.0]], N=[[1.0]], C=[[1.0], [1.0], [1.0]], F=np.zeros((3, 1)),
            D=np.reshape(rows, (3, 1)), offset=np.zeros(3), outputs=("T_a", "da_rate", "da"),
        )  # fmt: skip

    smooth, rate, angle = (demand_of(outputs_through(rows), 1.0) for rows in ([1, 0, 0], [0, 1, 0], [0, 0, 1]))
    assert np.all(np.isfinite([getattr(smooth, name) for name in NAMES]))
    np.testing.assert_allclose(smooth.peak_torque, STEP[0] * 1.2, rtol=1e-2)
    assert np.isinf(rate.peak_acceleration)
    assert np.isfinite(rate.peak_rate)
    assert np.isinf([angle.peak_rate, angle.peak_power, angle.peak_acceleration]).all()
    assert np.isfinite(angle.peak_deflection)


def test_unstable_loops_overflow_without_a_warning():
    loops = second_order(np.array([30.0, 30.0]), np.array([0.5, -0.9]))
    found = demand_of(loops, 100.0)
    assert np.isfinite(found.peak_power[0])
    assert not np.isfinite(found.peak_torque[1])
    assert np.isnan(found.holding_torque[1])


def test_unknown_actuator_and_missing_output_are_named():
    one = second_order(10.0, 0.5)
    with pytest.raises(ValueError, match="no actuator 'flap'; there are tab, aileron"):
        demand_of(one, 1.0, "flap")
    with pytest.raises(ValueError, match="no output 'dt_rate'; it has da, da_rate, T_a"):
        demand_of(one, 1.0, "tab")


def test_a_torque_that_is_not_finite_is_unlimited():
    """A loop that leaves the torque out of its outputs says that there is none that is finite."""
    one = data_set_a(np.array([20.0]))
    kept = [i for i, name in enumerate(one.outputs) if name != "T_t"]
    rows = {name: getattr(one, name)[..., kept, :] for name in ("C", "F", "D", "H")}
    without = replace(one, **rows, offset=one.offset[..., kept], outputs=tuple(one.outputs[i] for i in kept))
    found, whole = demand_of(without, 1.0, "tab"), demand_of(one, 1.0, "tab")
    for name in ("peak_torque", "rms_torque", "peak_power", "rms_power", "peak_acceleration"):
        assert np.all(getattr(found, name) == np.inf), name
    for name in ("holding_torque", "energy_out", "energy_back"):
        assert np.all(np.isnan(getattr(found, name))), name
    for name in ("peak_rate", "peak_deflection"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))


def test_no_points_ask_for_nothing():
    none = data_set_a(np.array([20.0, 30.0])).take(np.zeros(2, dtype=bool))
    found = demand_of(none, 1.0)
    assert found.peak_torque.shape == (0,)
    envelope = envelope_demand("aileron", found, np.zeros(2, dtype=bool))
    assert all(r.value is None and r.point is None for r in envelope.requirements)


def test_envelope_takes_the_largest_and_says_where():
    rising = np.array([[1.0, np.nan, 3.0], [9.0, 2.0, -np.inf]])
    fields = {name: rising * (k + 1) for k, name in enumerate(NAMES)}
    fields["holding_torque"] = np.full((2, 3), np.nan)
    ok = np.array([[True, True, True], [False, True, True]])
    envelope = envelope_demand("tab", ActuatorDemand(**fields), ok)
    assert envelope.actuator == "tab"
    assert len(envelope.requirements) == len(NAMES)
    for k, name in enumerate(NAMES):
        requirement = envelope.requirement(name)
        expected = (None, None) if name == "holding_torque" else (3.0 * (k + 1), 2)
        assert (requirement.value, requirement.point) == expected
    with pytest.raises(KeyError):
        envelope.requirement("colour")


def test_envelope_of_the_points_that_carry_a_design_points_into_the_grid():
    loops = data_set_a(np.array([[20.0, 50.0], [30.0, 40.0]]))
    ok = np.array([[True, False], [True, True]])
    found = demand_of(loops.take(ok), 1.0)
    requirement = envelope_demand("aileron", found, ok).requirement("holding_torque")
    assert requirement.point == 3
    np.testing.assert_allclose(requirement.value, found.holding_torque[2], rtol=1e-15)
