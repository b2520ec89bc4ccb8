"""The loop functions against their definitions, python-control, and the margins that are taken elsewhere."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest

from design.disturbance.closed_system import closed_system
from design.disturbance.frequency_response import frequency_response
from design.disturbance.loop_responses import loop_responses
from design.frequency.margins import margins
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from tests.design.disturbance.outside_loops import full_loop, plain_loop
from tests.design.lqr_cases import example

OMEGA = np.array([0.05, 0.7, 3.0, 20.0, 400.0])


@pytest.mark.parametrize("delay", [(0.0, 0.0), (0.3, 0.0), (0.2, 0.7), (0.1,)])
def test_definitions(delay):
    loop = full_loop(delay=delay)
    found = loop_responses(loop, OMEGA)
    m = len(delay)
    one = np.eye(m)
    for index in np.ndindex(2, 3):
        for k, w in enumerate(OMEGA):
            turn = np.diag(np.exp(-1j * w * np.array(delay)))
            R = np.linalg.inv(1j * w * np.eye(5) - loop.A[index])
            L = loop.K[index] @ R @ loop.B[index] @ turn
            S = np.linalg.inv(one + L)
            W = np.concatenate([loop.E[index], loop.G[index]], axis=-1)
            M = np.concatenate([loop.N[index], loop.M[index]], axis=-1)
            command = S @ (M - loop.K[index] @ R @ W)
            for response, expected in (
                (found.loop, L), (found.sensitivity, S), (found.complementary, one - S), (found.command, command)
            ):  # fmt: skip
                np.testing.assert_allclose(response.value[index][k], expected, rtol=1e-9, atol=1e-11)
    assert found.loop.inputs == found.loop.outputs == loop.inputs
    assert found.command.inputs == ("r_a", "d_disturbance", "n_noise")
    np.testing.assert_allclose(
        found.sensitivity.singular_values, np.linalg.svd(found.sensitivity.value, compute_uv=False), rtol=1e-9
    )


def test_values_of_python_control():
    """Series, feedback and a second input, by python-control's own algebra."""
    loop = full_loop(grid=(), seed=5)
    found = loop_responses(loop, OMEGA)
    one = ct.ss([], [], [], np.eye(2))
    plant = ct.ss(loop.A, loop.B, loop.K, np.zeros((2, 2)))
    S, T = ct.feedback(one, plant), ct.feedback(plant, one)
    np.testing.assert_allclose(found.loop.value, np.moveaxis(plant(1j * OMEGA), -1, 0), rtol=1e-9)
    np.testing.assert_allclose(found.sensitivity.value, np.moveaxis(S(1j * OMEGA), -1, 0), rtol=1e-9)
    np.testing.assert_allclose(found.complementary.value, np.moveaxis(T(1j * OMEGA), -1, 0), rtol=1e-9)


def test_a_pole_of_the_open_loop_on_the_axis():
    """With an integral action L is infinite at zero frequency; S is 0 there, and T 1."""
    loop = plain_loop(
        [[0.0, 0.0], [-1.0, -3.0]], [[0.0], [1.0]], [[-4.0, 2.0]], np.eye(2), [[0.0, 0.0]], np.eye(2), 0.05
    )
    loop = replace(loop, A=np.array([[0.0, -1.0], [0.0, -3.0]]))
    omega = np.array([0.0, 1e-9, 1.0])
    found = loop_responses(loop, omega)
    assert np.isnan(found.loop.value[0]).all()
    np.testing.assert_allclose(found.sensitivity.value[0], 0.0, atol=1e-14)
    np.testing.assert_allclose(found.complementary.value[0], 1.0, rtol=1e-13)
    np.testing.assert_allclose(found.sensitivity.value[1], 1e-9j * 3.0 / 4.0, rtol=1e-6)
    closed = frequency_response(closed_system(loop, ("w0", "w1"), ("u0",)), omega)
    np.testing.assert_array_equal(found.command.value, closed.value)
    assert np.isfinite(found.command.value).all()


def test_one_loop_has_the_margins_that_are_taken_of_its_cut():
    """Peak of S, phase at the crossover, and the gain that is lost, delay and all."""
    model, controller = example("wind_tunnel")
    loop = lqr_loop(model, design_lqr(model, controller))
    for delay in (0.0, 0.0008):
        cut = replace(loop.cut("aileron"), delay=delay)
        # The loop whose other input stays closed, with this one alone.
        single = replace(
            loop, A=cut.A, B=cut.b[..., None], K=cut.c[..., None, :], N=loop.N[..., 1:, :], M=loop.M[..., 1:, :],
            D=loop.D[..., 1:], H=loop.H[..., 1:], inputs=("aileron",), delay=(delay,),
        )  # fmt: skip
        known = margins(cut)
        at = loop_responses(single, known.crossover[..., None])
        np.testing.assert_allclose(at.loop.magnitude[..., 0, 0, 0], 1.0, rtol=1e-9)
        angle = np.angle(-at.loop.value[..., 0, 0, 0])
        np.testing.assert_allclose(np.abs(angle), known.phase_margin, rtol=1e-8)
        omega = np.geomspace(1.0, 1e5, 4000)
        S = loop_responses(single, omega).sensitivity.magnitude[..., 0, 0].max(axis=-1)
        np.testing.assert_allclose(np.maximum(S, 1.0), known.sensitivity_peak, rtol=1e-4)


def test_two_loops_obey_kalman():
    """The smallest singular value of ``R^1/2 (I + L) R^-1/2`` is at least 1 for an optimal regulator."""
    model, controller = example("wind_tunnel")
    loop = lqr_loop(model, design_lqr(model, controller))
    omega = np.geomspace(0.1, 1e5, 300)
    root = np.diag([1.0 / 0.5, 1.0 / 2.0])
    L = loop_responses(loop, omega).loop.value
    smallest = np.linalg.svd(np.eye(2) + root @ L @ np.linalg.inv(root), compute_uv=False)[..., -1]
    assert np.all(smallest > 1.0 - 1e-9)
    assert np.min(smallest) < 1.01


def test_grid_equals_points_and_failed_points_stay_alone():
    loop = full_loop(delay=(0.02, 0.05))
    K = loop.K.copy()
    K[1, 1] = np.nan
    found = loop_responses(replace(loop, K=K), OMEGA)
    for index in np.ndindex(2, 3):
        alone = loop_responses(loop.take(index), OMEGA)
        for name in ("loop", "sensitivity", "complementary", "command"):
            value = getattr(found, name).value[index]
            if index == (1, 1):
                assert np.isnan(value).all()
            else:
                np.testing.assert_allclose(value, getattr(alone, name).value, rtol=1e-12)
