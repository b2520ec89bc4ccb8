import control as ct
import numpy as np
import pytest

from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.tracking import steady_state
from design.outcome import Outcome, Outcomes
from tests.design.lqr_cases import EXAMPLES, example

ARRAYS = ("A", "B", "E", "K", "N", "C", "F", "D", "offset")


def loop_of(name):
    model, controller = example(name)
    design = design_lqr(model, controller)
    return model, design, lqr_loop(model, design)


def test_names_and_shapes():
    _, _, loop = loop_of("wind_tunnel")
    assert loop.states == ("dt", "dt_rate", "da", "da_rate", "int_a")
    assert loop.inputs == ("tab", "aileron")
    assert loop.references == ("r_a",)
    assert loop.outputs == ("da", "dt", "da_rate", "dt_rate", "T_t", "T_a")
    assert loop.delay == (0.0, 0.0)
    assert loop.closed.shape == (2, 4, 5, 5)
    assert [stage.name for stage in loop.stages] == ["tab", "aileron"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_steady_state_has_no_error(name):
    model, _, loop = loop_of(name)
    rest = steady_state(model)
    state = np.linalg.solve(loop.closed, -loop.reference_input)
    output = (loop.closed_outputs @ state + loop.reference_feedthrough)[..., 0]
    # One radian of reference: the aileron is there, nothing moves, the aileron's torque is the trim's.
    size = np.abs(rest.N_u[..., 0, 0])
    assert np.max(np.abs(output[..., 0] - 1.0)) <= 1e-9
    assert np.max(np.abs(output[..., 2:4])) <= 1e-9
    assert np.max(np.abs(output[..., 5]) / size) <= 1e-9
    np.testing.assert_allclose(output[..., 4], rest.N_u[..., 0, 0], rtol=1e-9)
    np.testing.assert_allclose(output[..., 1], rest.N_x[..., 0, 0], rtol=1e-9)


def test_step_by_python_control():
    """An independent simulation of plant, law and integrator: it ends on the reference, and outputs are totals."""
    model, design, loop = loop_of("wind_tunnel")
    index = (0, 2)
    r = np.deg2rad(10.0)
    A, B, K, N = model.A[index], model.B[index], design.K[index], design.N[index]
    # States x and int; u = -K [x; int] + N r, int' = r - da.
    closed = np.zeros((5, 5))
    closed[:4, :4], closed[:4, 4:] = A - B @ K[:, :4], -B @ K[:, 4:]
    closed[4, 2] = -1.0
    drive = np.concatenate([B @ N, [[1.0]]])
    system = ct.ss(closed, drive, np.concatenate([np.eye(5), -K]), np.concatenate([np.zeros((5, 1)), N]))
    time = np.linspace(0.0, 1.0, 401)
    expected = ct.forced_response(system, time, np.full(len(time), r)).outputs
    ours = loop.take(index)
    flown = ct.ss(ours.closed, ours.reference_input, ours.closed_outputs, ours.reference_feedthrough)
    found = ct.forced_response(flown, time, np.full(len(time), r)).outputs + ours.offset[:, None]
    offset = np.concatenate([model.state_offset[index], model.input_offset[index]])
    for row, (name, source) in enumerate({"da": 2, "dt": 0, "da_rate": 3, "dt_rate": 1, "T_t": 5, "T_a": 6}.items()):
        assert ours.outputs[row] == name
        total = expected[source] + offset[source if source < 4 else source - 1]
        np.testing.assert_allclose(found[row], total, atol=1e-9 * np.abs(total).max() + 1e-12)
    assert np.any(model.input_offset[index] != 0.0)
    assert found[0, -1] == pytest.approx(r, abs=1e-6)


def test_stages_are_the_loop_opened_at_one_actuator():
    _, design, loop = loop_of("wind_tunnel_23012")
    for i, stage in enumerate(loop.stages):
        np.testing.assert_array_equal(stage.gain, 1.0)
        assert stage.sign == 1
        np.testing.assert_allclose(stage.closed(), loop.closed, rtol=1e-9, atol=1e-9 * np.abs(loop.closed).max())
        # Gain k on this actuator's command, the other one as designed.
        scale = np.ones((2, 1))
        scale[i] = 0.6
        scaled = loop.A - loop.B @ (scale * design.K)
        np.testing.assert_allclose(stage.closed(0.6), scaled, rtol=1e-9, atol=1e-9 * np.abs(scaled).max())
        # LQR keeps its poles stable from half the gain upwards (Kalman's inequality, R diagonal).
        for k in (0.51, 2.0, 20.0):
            assert np.linalg.eigvals(stage.closed(k)).real.max() < 0


def test_points_that_are_not_ok_hold_nan():
    model, controller = example("wind_tunnel")
    where = np.zeros((2, 4), dtype=bool)
    where[0, 1] = where[1, 2] = True
    outcomes = Outcomes.all_ok((2, 4)).failing(where, Outcome.EXCLUDED, lambda index: "test")
    loop = lqr_loop(model, design_lqr(model, controller, outcomes))
    whole = lqr_loop(model, design_lqr(model, controller))
    for name in ARRAYS:
        values = getattr(loop, name)
        assert np.isnan(values[where]).all()
        np.testing.assert_array_equal(values[~where], getattr(whole, name)[~where])
    for stage in loop.stages:
        assert np.isnan(stage.closed()[where]).all()
        assert np.isfinite(stage.closed()[~where]).all()


def test_grid_equals_points():
    model, design, loop = loop_of("airliner_aileron")
    for index in [(0, 0), (2, 3), (3, 6)]:
        point = lqr_loop(model.take(index), design.take(index))
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(loop.take(index), name), getattr(point, name))
        for ours, alone in zip(loop.take(index).stages, point.stages, strict=True):
            np.testing.assert_allclose(ours.closed(), alone.closed(), rtol=1e-13)
