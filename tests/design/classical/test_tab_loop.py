"""The assembled loop against transfer functions composed by python-control, and against the equations of motion."""

import numpy as np
import pytest

from design.classical.synthesis import ClassicalController
from design.classical.tab_loop import tab_loop
from design.response.step_response import step_response
from model.motion import required_torque

NF = ClassicalController("nf", "negative_feedback", rate_filter=2.0 * np.pi * 100.0)
NF_MEASURED = ClassicalController("nf", "negative_feedback")
PF = ClassicalController("pf", "positive_feedback")
GAINS = {
    "negative_feedback": {"K_d": 0.02, "K_p": 0.6, "K_i": 30.0},
    "positive_feedback": {"K_f": 0.4, "K_i": 2.0},
}


def _loop(plant, actuator, controller):
    gains = {k: np.full(plant.grid.shape, v) for k, v in GAINS[controller.kind].items()}
    return tab_loop(plant.model, plant.servo, actuator, controller, gains)


def _composed(plant, actuator, controller, index):
    """Closed loop from r_a to da from block algebra."""
    import control as ct

    s = ct.tf("s")
    servo = plant.servo
    P = ct.tf(servo.numerator[index], servo.denominator[index])
    w, z = actuator.servo_bandwidth, actuator.servo_damping_ratio
    servo_lag = w**2 / (s**2 + 2 * z * w * s + w**2)
    g = GAINS[controller.kind]
    if controller.kind == "negative_feedback":
        rate = s if controller.rate_filter is None else controller.rate_filter * s / (s + controller.rate_filter)
        inner = -g["K_p"] - g["K_d"] * rate
    else:
        inner = ct.tf([g["K_f"]], [1])
    sigma = -1.0
    G = sigma * servo_lag * P
    return ct.minreal(G * g["K_i"] / s / (1 - G * inner + G * g["K_i"] / s), verbose=False)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("controller", [NF, NF_MEASURED, PF], ids=["nf", "nf_measured", "pf"])
def test_transfer_of_the_closed_loop_equals_block_algebra(plant_a, tab_actuator, controller):
    loop = _loop(plant_a, tab_actuator, controller)
    for index in [(0, 0), (1, 3)]:
        T = _composed(plant_a, tab_actuator, controller, index)
        row = loop.closed_outputs[index][loop.outputs.index("da")]
        for omega in (0.0, 5.0, 40.0, 300.0):
            ours = row @ np.linalg.solve(
                1j * omega * np.eye(loop.A.shape[-1]) - loop.closed[index], loop.E[index][:, 0]
            )
            assert ours == pytest.approx(complex(T(1j * omega)), rel=1e-8, abs=1e-10)


@pytest.mark.parametrize("controller", [NF, PF], ids=["nf", "pf"])
def test_stages_close_one_by_one_to_the_loop_that_is_flown(plant_a, tab_actuator, controller):
    loop = _loop(plant_a, tab_actuator, controller)
    np.testing.assert_allclose(loop.stages[-1].closed(), loop.closed, rtol=1e-12, atol=1e-9)
    assert [s.name for s in loop.stages] == list(GAINS[controller.kind])
    np.testing.assert_allclose(loop.cut("tab").closed(), loop.closed, rtol=1e-12, atol=1e-9)
    for before, after in zip(loop.stages[:-1], loop.stages[1:], strict=True):
        inner = [i for i, name in enumerate(loop.states) if name != "int_a"]
        opened = after.A if after.name != "K_i" else after.A[..., inner, :][..., inner]
        np.testing.assert_allclose(before.closed(), opened, rtol=1e-12, atol=1e-9)


def test_feedback_signs(plant_a, tab_actuator):
    assert [s.sign for s in _loop(plant_a, tab_actuator, NF).stages] == [+1, +1, +1]
    assert [s.sign for s in _loop(plant_a, tab_actuator, PF).stages] == [-1, +1]


def test_positive_feedback_is_negative_feedback_of_the_opposite_gain(plant_a, tab_actuator):
    positive = _loop(plant_a, tab_actuator, PF)
    gains = {"K_d": 0.0, "K_p": -GAINS["positive_feedback"]["K_f"], "K_i": GAINS["positive_feedback"]["K_i"]}
    gains = {k: np.full(plant_a.grid.shape, v) for k, v in gains.items()}
    negative = tab_loop(plant_a.model, plant_a.servo, tab_actuator, NF_MEASURED, gains)
    np.testing.assert_allclose(positive.closed, negative.closed, rtol=1e-12, atol=1e-12)


def test_tab_torque_obeys_the_equations_of_motion(plant_a, tab_actuator):
    """Inverse dynamics of the non-linear equations along the linear response, for a step small enough."""
    loop = _loop(plant_a, tab_actuator, NF)
    size = 1e-6
    response = step_response(loop, np.array([size]), 0.4, 41)
    x = response.states
    xdot = np.einsum("...ij,...tj->...ti", loop.closed, x) + loop.reference_input[..., None, :, 0] * size
    k = 17
    state = plant_a.trim.state + x[..., k, :4]
    acceleration = np.stack([xdot[..., k, 1], xdot[..., k, 3]], axis=-1)
    needed = required_torque(plant_a.system, plant_a.condition, plant_a.trim.alpha, state, acceleration)[..., 0]
    ours = response.outputs[..., k, loop.outputs.index("T_t")]
    still = plant_a.trim.torque[..., 0]
    np.testing.assert_allclose(ours - still, needed - still, rtol=1e-4)


def test_batched_equals_single(plant_a, tab_actuator):
    loop = _loop(plant_a, tab_actuator, NF)
    gains = {k: np.array(v) for k, v in GAINS["negative_feedback"].items()}
    single = tab_loop(plant_a.model.take((1, 2)), plant_a.servo.take((1, 2)), tab_actuator, NF, gains)
    for name in ("A", "B", "E", "K", "C", "F", "D", "offset"):
        np.testing.assert_array_equal(getattr(single, name), getattr(loop.take((1, 2)), name))


def test_an_ideal_servo_is_refused(plant_a, tab_actuator):
    from dataclasses import replace

    with pytest.raises(ValueError, match="servo"):
        _loop(plant_a, replace(tab_actuator, servo_bandwidth=None), PF)
