"""The loop with a Kalman filter: built by hand, by block algebra; separation; recovery of the full-state loop."""

from itertools import pairwise

import control as ct
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from design.delay.pade import delay_chain
from design.delay.with_pade import without_delay
from design.disturbance.closed_system import closed_system
from design.estimation.kalman_filter import kalman_filter
from design.estimation.noise_model import NoiseModel
from design.estimation.observer import DELAY_STATES, with_kalman_filter
from design.estimation.rate_filters import with_rate_filters
from tests.design.estimation.estimation_cases import (
    CASES,
    FIELDS,
    NOISE,
    PROMPT,
    full_state,
    open_response,
    same_numbers,
    with_holes,
)

POINT = (1, 1)
COMPLEX = np.array([0.3j, 4.0j, 37.0j, 210.0j, 1900.0j, 15.0 + 60.0j, -3.0 + 11.0j])


def observed(name, noise=NOISE):
    loop = full_state(name)
    found = kalman_filter(loop, noise)
    return loop, found, with_kalman_filter(loop, found)


def model_orders(name, loop):
    """States of the model of each delay, and whether the gains read them."""
    if name == "late":
        return (DELAY_STATES, DELAY_STATES), False
    return tuple(sum(state.startswith(f"{actuator}_delay_") for state in loop.states) for actuator in loop.inputs), True


def test_blocks_written_by_hand():
    """``x' = A x - B (K z + k c)``, ``c' = r - da - n``, ``z' = A z - B (K z + k c) + B N r + L (y + n - C z)``."""
    loop, found, made = observed("ideal")
    A, B, T = loop.A[POINT][:4, :4], loop.B[POINT][:4], loop.G[POINT][:4, :2]
    K, k, N, L = loop.K[POINT][:, :4], loop.K[POINT][:, 4:], loop.N[POINT], found.L[POINT]
    C = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    integral = np.array([[0.0, 0.0, -1.0, 0.0]])
    nothing = np.zeros((1, 4))
    closed = np.block(
        [
            [A, -B @ k, -B @ K],
            [integral, np.zeros((1, 1)), nothing],
            [L @ C, -B @ k, A - B @ K - L @ C],
        ]
    )
    point = made.take(POINT)
    np.testing.assert_allclose(point.closed, closed, rtol=1e-12, atol=1e-12 * np.abs(closed).max())
    np.testing.assert_allclose(point.reference_input, np.concatenate([B @ N, [[1.0]], B @ N]), rtol=1e-12)
    by_noise = np.block([[T, np.zeros((4, 2))], [np.zeros((1, 3)), -np.ones((1, 1))], [np.zeros((4, 2)), L]])
    np.testing.assert_allclose(point.disturbance_input, by_noise, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(point.K, np.concatenate([np.zeros((2, 4)), k, K], axis=-1))
    np.testing.assert_array_equal(point.N, N)
    assert not point.M.any()
    assert made.states == ("dt", "dt_rate", "da", "da_rate", "int_a", "est_dt", "est_dt_rate", "est_da", "est_da_rate")
    assert made.disturbances == ("T_t_disturbance", "T_a_disturbance", "dt_noise", "da_noise")
    # Opened at the tab, the filter hears the tab's command all the same.
    cut = point.cut("tab")
    opened = closed.copy()
    opened[:4] += np.concatenate([np.zeros((4, 4)), np.outer(B[:, 0], k[0]), np.outer(B[:, 0], K[0])], axis=-1)
    np.testing.assert_allclose(cut.A, opened, rtol=1e-12, atol=1e-12 * np.abs(closed).max())
    np.testing.assert_array_equal(cut.b, np.concatenate([B[:, 0], np.zeros(5)]))


def test_python_control_closes_the_same_loop():
    """The plant in feedback with the compensator ``(A - B K - L C, L, K)``, as transfers from torque to angles."""
    loop, found, made = observed("regulator")
    A, B, K, L = loop.A[POINT], loop.B[POINT], loop.K[POINT], found.L[POINT]
    C = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    closed = ct.feedback(ct.ss(A, B, C, 0), ct.ss(A - B @ K - L @ C, L, K, 0))
    disturbed = closed_system(made, ("T_t_disturbance", "T_a_disturbance"), ("dt", "da")).take(POINT)
    omega = np.geomspace(0.1, 5e3, 30)
    expected = np.moveaxis(closed(1j * omega), -1, 0)
    np.testing.assert_allclose(disturbed.response(omega), expected, rtol=1e-7, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("name", CASES)
def test_loop_transfer_by_block_algebra(name):
    """The filter as a transfer from angles and commands to estimates, with its delays, around the plant's transfer."""
    loop, found, made = observed(name)
    point, at = made.take(POINT), loop.states.index
    orders, read = model_orders(name, loop)
    plant = [at(state) for state in found.states]
    A, B, L = loop.A[POINT][np.ix_(plant, plant)], loop.B[POINT][plant], found.L[POINT]
    K = loop.K[POINT]
    C = np.eye(len(plant))[[0, 2]]
    for s in COMPLEX:
        late, model = np.eye(2, dtype=complex), np.zeros((2, 2), dtype=complex)
        for i, order in enumerate(orders):
            if order:
                chain = delay_chain(order)
                states = np.linalg.solve(s * loop.delay[i] * np.eye(order) - chain.A, chain.b)
                late[i, i] = chain.c @ states
                if read:
                    rows = [k for k, state in enumerate(loop.states) if state.startswith(f"{loop.inputs[i]}_delay_")]
                    model[:, i] = K[:, rows] @ states
        resolvent = np.linalg.inv(s * np.eye(len(plant)) - A + L @ C)
        by_angle = K[:, plant] @ resolvent @ L
        for integral, column in (("int_t", 0), ("int_a", 1)):
            if integral in loop.states:
                by_angle[:, column] -= K[:, at(integral)] / s
        back = np.linalg.inv(np.eye(2) + model + K[:, plant] @ resolvent @ B @ late)
        wanted = back @ by_angle @ C @ np.linalg.solve(s * np.eye(len(plant)) - A, B)
        np.testing.assert_allclose(open_response(point, s), wanted, rtol=1e-7, atol=1e-10 * np.abs(wanted).max())
        noise = [made.disturbances.index(n) for n in ("dt_noise", "da_noise")]
        still = open_response(point, s, "G")[:, noise]
        np.testing.assert_allclose(still, back @ by_angle, rtol=1e-7, atol=1e-10 * np.abs(still).max())


def _same_poles(ours, theirs, rtol):
    """Every eigenvalue has its partner, whatever their order."""
    left = list(theirs)
    assert len(ours) == len(left)
    for value in ours:
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        assert abs(left[nearest] - value) <= rtol * abs(value), (value, left[nearest])
        left.pop(nearest)


@pytest.mark.parametrize("name", PROMPT)
def test_separation(name):
    """The poles are those of ``A - B K`` and those of ``A - L C``."""
    loop, found, made = observed(name)
    for index in np.ndindex(2, 4):
        apart = np.concatenate([np.linalg.eigvals(loop.closed[index]), found.poles[index]])
        _same_poles(np.linalg.eigvals(made.closed[index]), apart, 1e-8)


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from(PROMPT), st.integers(0, 7), st.floats(-8.0, -3.0), st.floats(-6.0, -1.0), st.floats(-12.0, -8.0),
    st.floats(0.0, 4.0),
)  # fmt: skip
def test_separation_whatever_the_noise(name, flat, tab, aileron, angle, recovery):
    loop = full_state(name).take(np.unravel_index(flat, (2, 4)))
    found = kalman_filter(loop, NoiseModel(10.0**tab, 10.0**aileron, 10.0**angle, 3e-10, (), 10.0**recovery - 1.0))
    assert found.outcomes.ok.all()
    made = with_kalman_filter(loop, found)
    # In states x and x - z the closed loop is block triangular, which says the same without eigenvalues that coincide.
    n, k = len(loop.states), len(found.states)
    apart = np.eye(n + k)
    apart[n:, [loop.states.index(state) for state in found.states]] = np.eye(k)
    apart[n:, n:] = -np.eye(k)
    triangular = apart @ made.closed @ np.linalg.inv(apart)
    size = np.abs(made.closed).max()
    plant = [loop.states.index(state) for state in found.states]
    C = np.eye(k)[[found.states.index("dt"), found.states.index("da")]]
    np.testing.assert_allclose(triangular[:n, :n], loop.closed, atol=1e-12 * size)
    np.testing.assert_allclose(triangular[n:, :n], 0.0, atol=1e-12 * size)
    np.testing.assert_allclose(triangular[n:, n:], loop.A[np.ix_(plant, plant)] - found.L @ C, atol=1e-12 * size)
    np.testing.assert_allclose((apart @ made.reference_input)[n:], 0.0, atol=1e-12 * size)


@pytest.mark.parametrize(("name", "order"), [("modelled_delay", 3), ("late", DELAY_STATES)])
def test_separation_with_delays_that_are_what_the_filter_takes_them_for(name, order):
    """With the filter's own approximant in the place of each delay; its models decay as they please beside that."""
    loop, found, made = observed(name)
    for index in [(0, 0), (1, 3)]:
        apart = [np.linalg.eigvals(without_delay(loop, order).closed[index]), found.poles[index]]
        if name == "late":
            apart += [np.linalg.eigvals(delay_chain(order).A) / delay for delay in loop.delay]
        _same_poles(np.linalg.eigvals(without_delay(made, order).closed[index]), np.concatenate(apart), 1e-6)


@pytest.mark.parametrize("name", ["lagged", "unsteady", "modelled_delay", "late"])
def test_references_are_followed_as_with_the_full_state(name):
    """A reference makes no error of the estimate: the response is that of the full-state loop, with its delays."""
    loop, _, made = observed(name)
    omega = np.array([0.0, 1.0, 10.0, 60.0, 200.0])
    ours, theirs = (
        closed_system(one, one.references, one.outputs).response(np.tile(omega, (2, 4, 1))) for one in (made, loop)
    )
    tolerance = 1e-8 if name in PROMPT else 1e-3
    np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance * np.abs(theirs).max())


@pytest.mark.parametrize("name", PROMPT)
def test_errors_spread_as_the_filter_says(name):
    """Covariance of ``x - z`` in the closed loop under all its noise, by Lyapunov's equation: P."""
    loop, found, made = observed(name)
    intensity = np.diag([NOISE.tab_torque, NOISE.aileron_torque, NOISE.tab_angle, NOISE.aileron_angle])
    plant = [loop.states.index(state) for state in found.states]
    n = len(loop.states)
    for index in [(0, 0), (1, 3)]:
        drive = made.disturbance_input[index]
        spread = scipy.linalg.solve_continuous_lyapunov(made.closed[index], -drive @ intensity @ drive.T)
        error = spread[np.ix_(plant, plant)] - spread[plant, n:] - spread[n:, plant] + spread[n:, n:]
        scale = np.maximum(found.error_rms[index], 1e-5)
        np.testing.assert_allclose(error / np.outer(scale, scale), found.P[index] / np.outer(scale, scale), atol=1e-5)


@pytest.mark.parametrize("name", CASES)
def test_no_command_takes_noise_at_once(name):
    _, _, made = observed(name)
    system = closed_system(made, ("dt_noise", "da_noise"), ("tab", "aileron"))
    assert not system.D.any()
    assert not made.M.any()
    for stage, actuator in zip(made.stages, made.inputs, strict=True):
        np.testing.assert_array_equal(stage.A, made.cut(actuator).A)


@pytest.mark.parametrize("name", ["ideal", "lagged", "unsteady"])
def test_recovery_brings_the_full_state_loop_back(name):
    """``L(jw)`` tends to that of the full-state feedback as the noise on the commands grows (Doyle and Stein 1979)."""
    loop = full_state(name)
    omega = np.geomspace(1.0, 300.0, 12)
    wanted = [open_response(loop.take(POINT), 1j * w) for w in omega]
    apart = []
    for rho in (0.0, 1e3, 1e6, 1e9, 1e12):
        noise = NoiseModel(NOISE.tab_torque, NOISE.aileron_torque, NOISE.tab_angle, NOISE.aileron_angle, recovery=rho)
        made = with_kalman_filter(loop, kalman_filter(loop, noise)).take(POINT)
        found = [open_response(made, 1j * w) for w in omega]
        apart.append(max(np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in zip(found, wanted, strict=True)))
    assert all(later < 0.5 * before for before, later in pairwise(apart))
    assert apart[-1] < 0.01


def test_states_of_every_case():
    assert observed("lagged")[2].states[-6:] == (
        "est_dt", "est_dt_rate", "est_da", "est_da_rate", "est_tab_torque", "est_aileron_torque",
    )  # fmt: skip
    assert observed("unsteady")[2].states[-2:] == ("est_lag_1", "est_lag_2")
    modelled = observed("modelled_delay")[2].states
    assert modelled[: len(full_state("modelled_delay").states)] == full_state("modelled_delay").states
    assert not any(state.startswith("est") and "delay" in state for state in modelled)
    models = tuple(f"{actuator}_delay_{k}" for actuator in ("tab", "aileron") for k in range(1, DELAY_STATES + 1))
    assert observed("late")[2].states[5:-4] == models


@pytest.mark.parametrize("name", CASES)
def test_grid_equals_points(name):
    loop, _, made = observed(name)
    for index in [(0, 0), (1, 3)]:
        alone = loop.take(index)
        same_numbers(made.take(index), with_kalman_filter(alone, kalman_filter(alone, NOISE)))


def test_points_without_a_filter_stay_without():
    loop, mask = with_holes(full_state("late"))
    made = with_kalman_filter(loop, kalman_filter(loop, NOISE))
    whole = observed("late")[2]
    for field in FIELDS:
        assert np.isnan(getattr(made, field)[~mask]).all()
        np.testing.assert_array_equal(getattr(made, field)[mask], getattr(whole, field)[mask])


def test_what_is_refused():
    loop, found, made = observed("ideal")
    with pytest.raises(ValueError, match="over"):
        with_kalman_filter(loop.take(0), found)
    with pytest.raises(ValueError, match="the filter estimates"):
        with_kalman_filter(full_state("lagged"), found)
    for again in (made, with_rate_filters(loop, 100.0)):
        with pytest.raises(ValueError, match="works out states already"):
            with_kalman_filter(again, found)
