"""The search's quick figures against the exact ones of the loop in state space."""

import numpy as np
import pytest

from design.assess import achieved, assess
from design.classical.candidates import CandidateJudge
from design.classical.normal_form import NormalForm
from design.classical.synthesis import ClassicalController
from design.classical.tab_loop import tab_loop
from design.specs import Spec

ANY = (Spec("settling_time", "max", 1e9), Spec("overshoot", "max", 1e9))


@pytest.fixture(scope="module")
def judged(plant_a, tab_actuator):
    """Quick and exact figures of one stable candidate a point."""
    controller = ClassicalController("nf", "negative_feedback", rate_filter=2.0 * np.pi * 100.0)
    servo, model = plant_a.servo.take(np.ones((2, 4), bool)), plant_a.model.take(np.ones((2, 4), bool))
    form = NormalForm.of(servo, tab_actuator, controller.kind, controller.rate_filter)
    kappa = np.tile([0.6, 0.3, 0.4], (8, 1))
    judge = CandidateJudge(form, 1.0)
    quick = judge.judge(np.arange(8), kappa, ANY)
    gains = dict(zip(("K_d", "K_p", "K_i"), form.gains(kappa).T, strict=True))
    exact = assess(tab_loop(model, servo, tab_actuator, controller, gains), np.array([0.1]), 1.0)
    return judge, kappa, quick, exact


@pytest.mark.parametrize(
    ("quantity", "tolerance"),
    [
        ("damping_ratio", 1e-8),
        ("gain_margin", 1e-5),
        ("phase_margin", 1e-5),
        ("settling_time", 1e-4),
        ("overshoot", 1e-6),
    ],
)
def test_figures_are_close_to_the_exact_ones(judged, quantity, tolerance):
    _, _, quick, exact = judged
    np.testing.assert_allclose(quick.values[quantity], achieved(exact, quantity), rtol=tolerance, atol=tolerance / 10)


def test_bandwidth_is_close_to_the_exact_one(judged):
    _, _, quick, exact = judged
    np.testing.assert_allclose(quick.bandwidth, exact.step.bandwidth, rtol=1e-4)


def test_gradient_of_the_damping_equals_a_finite_difference(judged):
    judge, kappa, _, _ = judged
    at, h = np.arange(8), 1e-6
    ratio, gradient = judge.mode_damping(at, kappa)
    for j in range(3):
        step = np.zeros(3)
        step[j] = h
        up, down = judge.mode_damping(at, kappa + step)[0], judge.mode_damping(at, kappa - step)[0]
        real = ratio > 1.5
        difference = np.where(real, 0.0, (up - down) / (2 * h))
        np.testing.assert_allclose(np.where(real, 0.0, gradient[..., j]), difference, rtol=1e-4, atol=1e-6)


def test_unstable_candidates_have_no_margins(judged):
    judge, _, _, _ = judged
    quick = judge.judge(np.array([0]), np.array([[0.0, 0.0, 50.0]]), ANY)
    assert quick.values["damping_ratio"][0] < 0
    assert np.isnan(quick.bandwidth[0])
    assert np.isinf(quick.miss(Spec("gain_margin", "min", 6.0))[0])
