"""The graded mesh: exact states, and samples as dense as each mode needs while it is alive."""

import numpy as np
import pytest
from scipy.linalg import expm

from design.response.graded import BLOCKS, INTERVALS, RESOLUTION, graded_states
from design.response.step_response import step_response
from tests.design.step_loops import data_set_a, random_stable, servo_and_aileron

STEP = np.array([0.2])


@pytest.mark.parametrize("loops", [data_set_a(np.array([20.0, 50.0])), random_stable(7, 2)])
def test_states_are_exact_at_every_sample(loops):
    response = step_response(loops, STEP, 1.3, 5)
    mesh = response.graded
    for i in range(2):
        expected = expm(response.generator[i] * mesh.times[..., None, None])[..., -1]
        scale = np.max(np.abs(expected), axis=(0, 1))
        np.testing.assert_allclose(mesh.states[i] / scale, expected / scale, rtol=0.0, atol=1e-11)


def test_blocks_cover_the_response_without_a_gap():
    mesh = graded_states(np.zeros((2, 2)), np.array([0.0 + 0.0j]), 3.0)
    assert mesh.states.shape == (BLOCKS, INTERVALS + 1, 2)
    assert mesh.times[0, 0] == 0.0
    np.testing.assert_allclose(mesh.times[1:, 0], mesh.times[:-1, -1], rtol=1e-14)
    np.testing.assert_allclose(mesh.times[-1, -1], 3.0, rtol=1e-14)
    np.testing.assert_array_equal(mesh.states, np.broadcast_to([0.0, 1.0], mesh.states.shape))


@pytest.mark.parametrize(("bandwidth", "damping"), [(6000.0, 0.7), (100.0, 0.02), (300.0, 0.2)])
def test_every_mode_is_resolved_while_it_is_alive(bandwidth, damping):
    response = step_response(servo_and_aileron(bandwidth, damping, 5.0, 0.5), STEP, 10.0, 5)
    mesh = response.graded
    starts, steps = mesh.times[:, 0], mesh.steps
    for pole in response.poles:
        sampled = np.abs(pole) * steps
        left = np.exp(pole.real * starts)
        # Where a mode is sampled more coarsely it has decayed by more than interpolation magnifies it.
        assert np.all((sampled <= RESOLUTION * 1.0001) | (left * np.minimum(sampled, 3.0) ** 10 < 2e-5))
    assert np.max(np.abs(response.poles)) * steps[0] <= RESOLUTION * 1.0001
