"""Digital controllers: the sampled loop against a simulation of plant and code, and against its continuous stand-in."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from design.assess import achieved, assess
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.frequency.margins import margins
from design.frequency.sampled import sampled_margins, sampled_poles
from design.sampling import Sampling, as_if_continuous, digital_loop

FILTER = 2.0 * np.pi * 100.0
NF = ClassicalController("nf", "negative_feedback", rate_filter=FILTER)
PF_RATE = ClassicalController("pf", "positive_feedback", tab_command="rate")
GAINS = {"K_theta": 120.0, "K_d": 0.01, "K_p": 0.4, "K_i": 10.0, "K_f": 0.4}
STEP = np.array([np.deg2rad(10.0)])


def _loop(plant, actuator, controller):
    slow = {"K_i": 2.0} if controller.kind == "positive_feedback" else {}
    gains = {name: np.full(plant.grid.shape, ({**GAINS, **slow})[name]) for name in controller.gain_units}
    return tab_loop(plant.model, plant.servo, actuator, controller, gains)


def _coded(loop, x, sampling, samples):
    """Aileron at the samples from an initial state: the plant by matrix exponentials, the controller as it is coded.

    Integral and filter by the trapezoidal rule on this sample's measurement and the last one's; the command waits one
    sample for the computation.
    """
    T, at = sampling.time, loop.states.index
    own = [at("int_a"), *([at("da_filtered")] if "da_filtered" in loop.states else [])]
    plant = [i for i in range(len(loop.states)) if i not in own]
    Ad = expm(T * loop.A[np.ix_(plant, plant)])
    n = len(plant)
    both = np.zeros((n + 1, n + 1))
    both[:n, :n], both[:n, n] = loop.A[np.ix_(plant, plant)], loop.B[plant, 0]
    Bd = expm(T * both)[:n, n]
    x, da = x.copy(), []
    integral = filtered = last = 0.0
    waiting = 0.0
    for _ in range(samples):
        measured = x[plant.index(at("da"))]
        integral -= 0.5 * T * (measured + last)
        whole = np.zeros(len(loop.states))
        whole[plant], whole[at("int_a")] = x, integral
        if len(own) > 1:
            a = 0.5 * T * FILTER
            filtered = ((1.0 - a) * filtered + a * (measured + last)) / (1.0 + a)
            whole[own[1]] = filtered
        command, last = -loop.K[0] @ whole, measured
        da.append(measured)
        x = Ad @ x + Bd * waiting
        waiting = command
    return np.array(da)


@pytest.mark.parametrize("controller", [NF, PF_RATE], ids=["nf", "pf_rate"])
def test_modes_are_those_of_the_code(plant_a, tab_actuator, controller):
    """Prony's way: the simulated aileron obeys the linear recurrence of the closed loop's characteristic polynomial."""
    index, sampling = (1, 2), Sampling(0.004, 0.004)
    loop = _loop(plant_a, tab_actuator, controller).take(index)
    digital = digital_loop(loop, sampling)
    recurrence = np.poly(np.linalg.eigvals(digital.closed))
    order = len(recurrence) - 1
    inside = 1 + ("da_filtered" in loop.states)
    start = np.random.default_rng(3).standard_normal(len(loop.states) - inside)
    da = _coded(loop, start, sampling, 4 * order)
    residual = np.convolve(da, recurrence.real)[order + 2 : len(da)]
    assert np.max(np.abs(residual)) < 1e-9 * np.max(np.abs(da)) * np.max(np.abs(recurrence))


def test_a_digital_controller_lags_as_its_continuous_stand_in(plant_a, tab_actuator):
    """Phase margins agree to the second order of the sample time."""
    loop = _loop(plant_a, tab_actuator, NF)
    differences = []
    for T in (2e-3, 1e-3):
        sampling = Sampling(T, T)
        digital = sampled_margins(digital_loop(loop, sampling).cuts()).phase_margin[0]
        differences.append(np.abs(digital - margins(as_if_continuous(loop, sampling).cut("tab")).phase_margin).max())
    assert differences[0] < 5e-3
    assert 3.0 < differences[0] / differences[1] < 5.0


def test_the_assessment_is_of_the_sampled_loop(plant_a, tab_actuator):
    loop, sampling = _loop(plant_a, tab_actuator, NF), Sampling(2e-3, 1e-3)
    found = assess(loop, STEP, 1.0, sampling=sampling)
    digital = digital_loop(loop, sampling)
    poles = sampled_poles(digital.closed, sampling.time)
    np.testing.assert_allclose(found.largest_real_part, np.log(np.abs(poles.z).max(axis=-1)) / sampling.time)
    np.testing.assert_array_equal(found.damping_ratio, poles.damping_ratio.min(axis=-1))
    wanted = sampled_margins(digital.cuts()).phase_margin[0]
    np.testing.assert_array_equal(achieved(found, "phase_margin"), wanted)
    assert found.loop.delay == (0.002,)
    slower = assess(loop, STEP, 1.0, sampling=Sampling(3e-3, 2e-3))
    assert np.all(achieved(slower, "phase_margin") < achieved(found, "phase_margin"))


def test_a_slow_computer_destabilises_what_was_stable(plant_a, tab_actuator):
    loop = _loop(plant_a, tab_actuator, NF)
    assert np.all(assess(loop, STEP, 1.0).largest_real_part < 0.0)
    assert np.any(assess(loop, STEP, 1.0, sampling=Sampling(0.03, 0.03)).largest_real_part > 0.0)


def test_commands_may_not_drive_the_controllers_own_states(plant_a, tab_actuator):
    loop = _loop(plant_a, tab_actuator, NF)
    B = loop.B.copy()
    B[..., loop.states.index("int_a"), 0] = 1.0
    with pytest.raises(ValueError, match="through the commands"):
        digital_loop(replace(loop, B=B), Sampling(0.002, 0.002))
