"""Noise to commanded deflection against the formula ``|C / (1 + L)|`` on a dense sweep."""

from dataclasses import replace

import numpy as np
import pytest

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.disturbance.noise_gain import noise_gain
from tests.design.step_loops import second_order

FILTER = 2.0 * np.pi * 100.0
GAINS = {"K_theta": 120.0, "K_d": 0.02, "K_p": 0.6, "K_i": 30.0, "K_f": 0.4}


def _loop(plant, actuator, controller):
    integral = {"K_i": 2.0} if controller.kind == "positive_feedback" else {}
    gains = {name: np.full(plant.grid.shape, ({**GAINS, **integral})[name]) for name in controller.gain_units}
    return tab_loop(plant.model, plant.servo, actuator, controller, gains), gains


@pytest.mark.parametrize("delay", [0.0, 0.001])
@pytest.mark.parametrize("command", ["deflection", "rate"])
@pytest.mark.parametrize("kind", ["negative_feedback", "positive_feedback"])
def test_peak_of_the_formula(plant_a, tab_actuator, kind, command, delay):
    actuator = replace(tab_actuator, delay=delay)
    controller = ClassicalController("c", kind, rate_filter=FILTER, tab_command=command)
    loop, gains = _loop(plant_a, actuator, controller)
    ours = noise_gain(loop)
    s = 1j * np.geomspace(1e-2, 1e5, 40001)
    for index in [(0, 0), (1, 3)]:
        g = {name: float(values[index]) for name, values in gains.items()}
        if kind == "negative_feedback":
            C = g["K_i"] / s + g["K_p"] + g["K_d"] * FILTER * s / (s + FILTER)
        else:
            C = g["K_i"] / s - g["K_f"]
        w, z, lag = actuator.servo_bandwidth, actuator.servo_damping_ratio, actuator.rate_loop_bandwidth
        if command == "deflection":
            drive = w**2 / (s**2 + 2 * z * w * s + w**2) * np.exp(-s * delay)
        else:
            inner = g["K_theta"] * lag / (s * (s + lag)) * np.exp(-s * delay)
            drive = inner / (1.0 + inner)
        P = np.polyval(plant_a.servo.numerator[index], s) / np.polyval(plant_a.servo.denominator[index], s)
        swept = np.max(np.abs(C / (1.0 - P * drive * C)))
        assert ours[index] == pytest.approx(swept, rel=1e-4)
        assert ours[index] >= swept * (1.0 - 1e-9)


def test_a_loop_without_deflection_command_has_none():
    assert noise_gain(second_order(10.0, 0.5)) is None
