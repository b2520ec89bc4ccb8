"""The smaller the step, the closer the non-linear response is to the linear one of the same loop: order two."""

import numpy as np
import pytest

from design.delay.step_response import delayed_step_response
from design.estimation.rate_filters import with_rate_filters
from design.lqr.structures import Structure
from design.manoeuvre import step
from design.response.demand import actuator_demands
from design.response.step_response import step_response
from design.simulation.request import Freeplay, SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import Actuator
from tests.design.simulation.simulated_cases import SERVO, one, plant, tab_only, torque_loop

LAGS = Structure(tab=Actuator(torque_loop_bandwidth=400.0), aileron=Actuator(torque_loop_bandwidth=300.0))
TAB_LOOPS = {
    "second order": ("negative_feedback", "deflection", SERVO),
    "rate with lag": ("negative_feedback", "rate", SERVO),
    "first order": ("positive_feedback", "deflection", Actuator(SERVO.servo_bandwidth)),
    "ideal rate": ("positive_feedback", "rate", Actuator()),
}


def _difference(p, loop, size, substeps=None, **request):
    asked = SimulationRequest(0.3, 121, substeps=substeps, **request)
    points = (slice(None), 2)
    found = simulate(p.nonlinear.take(points), loop.take(points), step(np.array([size])), asked)
    linear = step_response(loop.take(points), np.array([size]), 0.3, 121)
    names = [name for name in loop.outputs if name in found.names]
    ours = np.stack([found.output(name) for name in names], axis=-1)
    return np.abs(ours - linear.outputs).max(axis=(0, 1)) / size


def _second_order(p, loop, big, floor, substeps=None):
    """The part by which the responses differ falls with the size, to the error of the integration."""
    differences = [_difference(p, loop, size, substeps) for size in (big, big / 4.0)]
    bent = differences[0] > 100.0 * floor
    assert np.any(bent)
    ratio = differences[0][bent] / differences[1][bent]
    assert np.all(ratio > 3.5)  # 4 for a quadratic residual, 16 for the cosine's cubic one


@pytest.mark.parametrize("structure", [Structure(), LAGS], ids=["ideal", "lagged"])
def test_torque_loops(structure):
    p = plant()
    _second_order(p, torque_loop(p, structure), 0.2, 1e-4)


@pytest.mark.parametrize("name", TAB_LOOPS)
def test_tab_loops(name):
    p = plant()
    kind, command, actuator = TAB_LOOPS[name]
    _second_order(p, tab_only(p, kind, command, actuator), 0.2, 1e-7, 16)


def test_table_of_hinge_moments_bends_in_the_square():
    p = plant("table")
    loop = tab_only(p)
    whole = [_difference(p, loop, size, 8)[0] for size in (0.004, 0.001)]
    assert whole[0] > 1e-5
    assert 3.6 < whole[0] / whole[1] < 4.7  # the table is a cubic


@pytest.mark.parametrize("kind", ["quasi_steady", "unsteady"])
def test_without_the_cosine_thin_aerofoils_are_linear(kind):
    p = plant(kind)
    for loop in (torque_loop(p), tab_only(p)):
        assert np.all(_difference(p, loop, 0.3, 32)[:4] < 1e-5)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_the_step_keeps_the_tolerance(tolerance):
    """Where nothing is bent the exact linear response tells the error of the integration."""
    p = plant("unsteady")
    points = (slice(None), 1)
    for loop in (torque_loop(p, LAGS).take(points), tab_only(p).take(points)):
        found = simulate(p.nonlinear.take(points), loop, step(np.array([0.1])), SimulationRequest(0.2, 51, tolerance))
        linear = step_response(loop, np.array([0.1]), 0.2, 51)
        change = linear.outputs - loop.offset[..., None, :]
        error = np.abs(found.outputs - linear.outputs).max(axis=-2) / np.abs(change).max(axis=-2).clip(1e-9)
        assert np.all(error < 3.0 * tolerance)


@pytest.mark.parametrize("name", TAB_LOOPS)
def test_link_without_band_is_a_linear_loop(name):
    """A stiff link hands the actuator's motion on to the tab."""
    p = plant()
    kind, command, actuator = TAB_LOOPS[name]
    loop = tab_only(p, kind, command, actuator)
    asked = SimulationRequest(0.1, 26, 1e-5, freeplay=Freeplay(0.0, 500.0, 0.2))
    found = simulate(*one(p, loop), step(np.array([0.01])), asked)
    plain = simulate(*one(p, loop), step(np.array([0.01])), SimulationRequest(0.1, 26, 1e-5))
    np.testing.assert_allclose(found.output("da"), plain.output("da"), atol=2e-5)
    np.testing.assert_allclose(found.output("dt_actuator"), plain.output("dt"), atol=1e-4)
    np.testing.assert_allclose(found.output("T_t")[1:], plain.output("T_t")[1:], atol=2e-3)
    still = simulate(*one(p, loop), step(np.zeros(1)), asked)
    assert np.abs(still.states).max() < 1e-14


def test_demand_of_small_steps_is_the_linear_one():
    p = plant()
    for loop in (torque_loop(p, LAGS), tab_only(p)):
        size = np.array([1e-3])
        points = (slice(None), 1)
        asked = SimulationRequest(0.3, 301, tolerance=1e-8)
        found = simulate(p.nonlinear.take(points), loop.take(points), step(size), asked)
        linear = actuator_demands(loop.take(points), step_response(loop.take(points), size, 0.3), loop.inputs)
        for ours, exact in zip(found.demand, linear, strict=True):
            for name in ("peak_torque", "rms_torque", "peak_rate", "peak_deflection", "peak_power", "rms_power"):
                np.testing.assert_allclose(getattr(ours, name), getattr(exact, name), rtol=3e-4, err_msg=name)
            for name in ("peak_acceleration", "energy_out", "energy_back"):
                scale = np.max(getattr(exact, name))
                np.testing.assert_allclose(getattr(ours, name), getattr(exact, name), rtol=2e-3, atol=1e-4 * scale)


def test_loops_with_filters_and_observers_are_simulated_as_they_are_flown():
    p = plant("quasi_steady")
    full = torque_loop(p).take((1, 2))
    late = torque_loop(p, Structure(tab=Actuator(delay=0.002), aileron=Actuator(delay=0.002), delay_states=2))
    points = p.nonlinear.take((1, 2))
    for loop in (with_rate_filters(full, 800.0), late.take((1, 2))):
        asked = SimulationRequest(0.1, 51, 1e-7)
        found = simulate(points, loop, step(np.array([0.05])), asked)
        linear = delayed_step_response(loop, np.array([0.05]), 0.1, 51)
        time = linear.time
        names = [loop.outputs.index(name) for name in ("da", "dt", "da_rate")]
        for row in names:
            ours = np.interp(time, found.time, found.outputs[:, row])
            both = np.isin(time, found.time)
            scale = np.abs(linear.outputs[:, row]).max()
            np.testing.assert_allclose(ours[both] / scale, linear.outputs[both, row] / scale, atol=1e-4)
