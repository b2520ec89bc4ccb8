"""Disturbance figures of the loops that are flown: tab-only and concurrent, with and without delay."""

from dataclasses import replace

import numpy as np
import pytest

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.disturbance.assessment import assess_disturbances
from design.disturbance.closed_system import closed_system
from design.disturbance.frequency_response import frequency_response
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.response.step_response import step_response
from tests.design.lqr_cases import EXAMPLES, example

GAINS = {"K_d": 0.02, "K_p": 0.3, "K_i": 6.0}


def _tab(plant, actuator, **changes):
    controller = ClassicalController("nf", "negative_feedback", rate_filter=2.0 * np.pi * 100.0)
    gains = {name: np.full(plant.grid.shape, value) for name, value in GAINS.items()}
    return tab_loop(plant.model, plant.servo, replace(actuator, **changes), controller, gains)


def _concurrent(name="wind_tunnel"):
    model, controller = example(name)
    return lqr_loop(model, design_lqr(model, controller))


@pytest.mark.parametrize("name", EXAMPLES)
def test_concurrent_loops(name):
    loop = _concurrent(name)
    found = assess_disturbances(loop)
    assert found.disturbances == loop.disturbances
    assert found.outputs == ("da", "dt", "dt_rate", "tab", "aileron")
    shape = (*loop.A.shape[:-2], 5, 6)
    da, torque = found.outputs.index("da"), found.disturbances.index("T_a_disturbance")
    for values in (found.peak.gain, found.peak.omega, found.h2.pairs, found.rejection.peak):
        assert values.shape == shape
    assert np.all(np.isfinite(found.peak.gain) & (found.peak.gain > 0.0))
    # The integral action brings the aileron back; noise has no rejection; commands see noise at once.
    np.testing.assert_array_equal(found.rejection.residual[..., da, torque], 0.0)
    assert np.isfinite(found.rejection.rejection_time[..., da, torque]).all()
    noises = [k for k, name in enumerate(found.disturbances) if name.endswith("_noise")]
    assert np.isnan(found.rejection.peak[..., noises]).all()
    assert np.isinf(found.h2.pairs[..., 3:, noises]).all()
    assert np.isfinite(found.h2.pairs[..., :3, :]).all()
    assert np.isfinite(found.h2.pairs[..., [0, 1]]).all()


def test_a_torque_step_is_that_of_a_loop_whose_reference_is_the_torque():
    loop = _concurrent()
    found = assess_disturbances(loop)
    column = loop.disturbances.index("T_a_disturbance")
    swapped = replace(loop, E=loop.G[..., [column]], N=loop.M[..., [column]], offset=0.0 * loop.offset)
    course = step_response(swapped, np.array([1.0]), 1.5, 60001)
    for i, name in enumerate(("da", "dt", "dt_rate")):
        y = course.outputs[..., course.index(name)]
        np.testing.assert_allclose(np.abs(y).max(axis=-1), np.abs(found.rejection.peak[..., i, column]), rtol=2e-5)
        outside = np.abs(y) > 0.05 * np.abs(y).max(axis=-1, keepdims=True)
        last = y.shape[-1] - 1 - np.argmax(outside[..., ::-1], axis=-1)
        gone = np.where(last < y.shape[-1] - 1, course.time[0, 0][last], np.nan)
        np.testing.assert_allclose(found.rejection.rejection_time[..., i, column], gone, atol=6e-5)


@pytest.mark.parametrize("delay", [0.0, 0.004])
def test_tab_loops_against_sweeps(plant_a, tab_actuator, delay):
    loop = _tab(plant_a, tab_actuator, delay=delay)
    found = assess_disturbances(loop)
    assert found.disturbances == ("T_a_disturbance", "da_noise")
    assert found.outputs == ("da", "dt", "dt_rate", "tab")
    stable = np.isfinite(found.peak.gain).all(axis=(-2, -1))
    assert stable.sum() >= 6
    system = closed_system(loop, found.disturbances, found.outputs)
    omega = np.concatenate([np.linspace(0.0, 400.0, 8001), np.geomspace(400.0, 1e11, 10001)[1:]])
    for index in zip(*np.nonzero(stable), strict=True):
        magnitude = frequency_response(system.take(index), omega).magnitude
        swept = magnitude.max(axis=0)
        assert np.all(swept <= found.peak.gain[index] * (1.0 + 1e-9))
        assert np.all(swept >= found.peak.gain[index] * (1.0 - 1e-4))
        power = np.trapezoid(magnitude**2, omega, axis=0) / np.pi
        norm = found.h2.pairs[index]
        known = np.isfinite(norm)
        np.testing.assert_array_equal(known, [[True, True]] * 3 + [[True, False]])
        np.testing.assert_allclose(np.sqrt(power)[known], norm[known], rtol=1e-4)
    torque = found.rejection.rejection_time[..., 0]
    assert np.isfinite(torque[stable][:, 0]).all()
    np.testing.assert_array_equal(found.rejection.residual[stable][:, 0, 0], 0.0)


def test_failed_points_stay_alone_and_grid_equals_points(plant_a, tab_actuator):
    for loop in (_concurrent(), _tab(plant_a, tab_actuator, delay=0.004)):
        K = loop.K.copy()
        K[0, 2] = np.nan
        found = assess_disturbances(replace(loop, K=K))
        for index in np.ndindex(2, 4):
            alone = assess_disturbances(loop.take(index))
            pairs = (
                (found.peak.gain, alone.peak.gain), (found.h2.pairs, alone.h2.pairs), (found.h2.total, alone.h2.total),
                (found.rejection.peak, alone.rejection.peak), (found.rejection.residual, alone.rejection.residual),
                (found.rejection.rejection_time, alone.rejection.rejection_time),
            )  # fmt: skip
            for ours, theirs in pairs:
                if index == (0, 2):
                    assert np.isnan(ours[index]).all()
                else:
                    np.testing.assert_allclose(ours[index], theirs, rtol=1e-8, atol=1e-14)


def test_a_result_can_be_taken_apart():
    found = assess_disturbances(_concurrent())
    one = found.take((1, 2))
    np.testing.assert_array_equal(one.peak.gain, found.peak.gain[1, 2])
    np.testing.assert_array_equal(one.rejection.peak, found.rejection.peak[1, 2])
    with pytest.raises(ValueError, match="read-only"):
        one.h2.pairs[...] = 0.0


def test_an_output_that_is_not_there_is_named(plant_a, tab_actuator):
    with pytest.raises(ValueError, match="'elevator'"):
        assess_disturbances(_tab(plant_a, tab_actuator), ("elevator",))
