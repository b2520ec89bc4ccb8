from dataclasses import replace

import control as ct
import numpy as np
import pytest

from design.lqr.phase_plane import free_trajectory, step_trajectory
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.tracking import steady_state
from model.actuators import Actuator
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

WEIGHTS = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.01)
ORDER = ("da", "dt", "da_rate", "dt_rate", "T_a", "T_t")
FIELDS = ("aileron", "tab", "aileron_rate", "tab_rate", "aileron_torque", "tab_torque")


def loop_of(reference="aileron_and_tab", *actuators):
    model, _ = example("wind_tunnel")
    return model, lqr_loop(model, design_lqr(model, LqrController("n", WEIGHTS, reference=reference), None, *actuators))


@pytest.mark.parametrize("reference", ["aileron", "aileron_and_tab"])
def test_a_step_by_python_control(reference):
    model, loop = loop_of(reference)
    r = np.deg2rad([10.0, -6.0])[: len(loop.references)]
    plane = step_trajectory(loop, r, 0.6, 301)
    rows = [loop.outputs.index(name) for name in ORDER]
    for index in [(0, 0), (1, 3)]:
        here = loop.take(index)
        system = ct.ss(here.closed, here.reference_input, here.closed_outputs, here.reference_feedthrough)
        expected = (
            ct.forced_response(system, plane.time[index], np.tile(r[:, None], 301)).outputs + here.offset[:, None]
        )
        for name, row in zip(FIELDS, rows, strict=True):
            ours = getattr(plane.take(index), name)
            np.testing.assert_allclose(ours, expected[row], atol=1e-9 * np.abs(expected[row]).max() + 1e-12)
    # From trim, by way of both planes, to where both surfaces rest.
    np.testing.assert_allclose(plane.aileron[..., 0], model.state_offset[..., 2], atol=1e-15)
    end = steady_state(model, structure=design_lqr(model, LqrController("n", WEIGHTS, reference=reference)).structure)
    np.testing.assert_allclose(plane.tab[..., -1], (end.N_x @ r)[..., 0], atol=2e-4)
    np.testing.assert_allclose(plane.tab_rate[..., -1], 0.0, atol=2e-3)


@pytest.mark.parametrize("actuators", [(), (Actuator(torque_loop_bandwidth=200.0),) * 2], ids=["ideal", "lagged"])
def test_an_initial_state_by_python_control(actuators):
    """With no reference, from any state: the torques are totals, and answer at once where they are ideal."""
    _, loop = loop_of("none", *actuators)
    x = np.zeros(len(loop.states))
    x[:4] = 0.1, -2.0, 0.05, 1.5
    plane = free_trajectory(loop, x, 0.4, 201)
    rows = [loop.outputs.index(name) for name in ORDER]
    for index in [(0, 1), (1, 2)]:
        here = loop.take(index)
        system = ct.ss(here.closed, np.zeros((len(x), 1)), here.closed_outputs, 0)
        expected = ct.initial_response(system, plane.time[index], x).outputs + here.offset[:, None]
        for name, row in zip(FIELDS, rows, strict=True):
            ours = getattr(plane.take(index), name)
            np.testing.assert_allclose(ours, expected[row], atol=1e-9 * np.abs(expected[row]).max())
    np.testing.assert_allclose(plane.aileron_rate[..., 0], 1.5, rtol=1e-12)


def test_states_that_differ_over_the_grid_and_grid_equals_points():
    _, loop = loop_of("aileron")
    x = np.random.default_rng(0).normal(size=(2, 4, 5)) * [0.1, 3.0, 0.1, 3.0, 0.002]
    plane = free_trajectory(loop, x, 0.3, 40)
    for index in np.ndindex(2, 4):
        alone = free_trajectory(loop.take(index), x[index], 0.3, 40)
        for name in FIELDS:
            np.testing.assert_allclose(getattr(plane.take(index), name), getattr(alone, name), rtol=1e-10, atol=1e-12)


def test_a_trajectory_with_a_delay_coasts_at_first():
    """From an initial state nothing is commanded before the delay has passed: the surfaces fly free."""
    _, loop = loop_of("none", Actuator(delay=0.0015), Actuator(delay=0.0015))
    x = np.array([0.1, 0.0, 0.05, 0.0])
    late, free = (free_trajectory(each, x, 0.001, 11) for each in (loop, replace(loop, K=np.zeros_like(loop.K))))
    np.testing.assert_allclose(late.aileron, free.aileron, rtol=1e-4)
    assert np.all(np.abs(free_trajectory(loop, x, 0.01, 11).aileron[..., -1] - x[2]) > 1e-3)
    # A step asks nothing of an undelayed surface either.
    with_step = step_trajectory(loop_of("aileron", Actuator(delay=0.0015), Actuator(delay=0.0015))[1], [0.1], 0.1, 101)
    np.testing.assert_allclose(with_step.aileron[..., :2], 0.0, atol=1e-12)
    assert np.all(with_step.aileron[..., -1] > 0.05)


@pytest.mark.parametrize(("duration", "samples"), [(0.0, 10), (np.inf, 10), (1.0, 1)])
def test_what_is_no_trajectory(duration, samples):
    _, loop = loop_of("none")
    with pytest.raises(ValueError, match=r"duration|samples"):
        free_trajectory(loop, np.zeros(4), duration, samples)
    with pytest.raises(ValueError, match=r"broadcast|shape"):
        free_trajectory(loop, np.zeros(7), 1.0)
