"""The loop of every structure as it is flown: references met, feed-forward alone, drives, disturbances, names."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest
import scipy.linalg

from design.assess import assess
from design.delay.pade import delay_chain
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import gains, lqr_loop
from design.lqr.tracking import steady_state
from design.outcome import Outcome, Outcomes
from design.response.step_response import step_response
from model.actuators import Actuator
from tests.design.delay.method_of_steps import outputs
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

WEIGHTS = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.01)
REFERENCES = ("none", "aileron", "aileron_and_tab")
LAGGED = Actuator(torque_loop_bandwidth=220.0), Actuator(torque_loop_bandwidth=140.0)
DRIVES = {
    "ideal": (Actuator(), Actuator(), 0),
    "lagged": (*LAGGED, 0),
    "delayed": (Actuator(torque_loop_bandwidth=220.0, delay=0.003), Actuator(delay=0.003), 4),
}


def flown(reference, drives="ideal", name="wind_tunnel", **changes):
    model, _ = example(name)
    tab, aileron, states = DRIVES[drives]
    asked = LqrController("lqr", WEIGHTS, reference=reference, delay_states=states, **changes)
    design = design_lqr(model, asked, None, tab, aileron)
    assert design.outcomes.ok.all()
    return model, design, lqr_loop(model, design)


@pytest.mark.parametrize("drives", DRIVES)
@pytest.mark.parametrize("reference", REFERENCES)
def test_shapes_and_names(reference, drives):
    _, design, loop = flown(reference, drives)
    n, p = len(loop.states), len(loop.references)
    assert p == {"none": 0, "aileron": 1, "aileron_and_tab": 2}[reference]
    assert loop.references == ("r_a", "r_t")[:p]
    commands = {"ideal": (), "lagged": ("T_t_command", "T_a_command"), "delayed": ("T_t_command",)}[drives]
    assert loop.outputs == ("da", "dt", "da_rate", "dt_rate", "T_t", "T_a", *commands)
    o = len(loop.outputs)
    shapes = {
        "A": (n, n), "B": (n, 2), "E": (n, p), "G": (n, 6), "K": (2, n), "N": (2, p), "M": (2, 6), "C": (o, n),
        "F": (o, n), "D": (o, 2), "H": (o, 2), "offset": (o,),
    }  # fmt: skip
    for field, shape in shapes.items():
        assert getattr(loop, field).shape == (2, 4, *shape)
    assert loop.delay == ((0.003, 0.003) if drives == "delayed" else (0.0, 0.0))
    names = [gain.name for gain in gains(design)]
    assert len(names) == len(set(names)) == 2 * n + 2 * p
    assert all(name.isidentifier() for name in names)
    by_name = {gain.name: gain for gain in gains(design)}
    np.testing.assert_array_equal(by_name["K_T_a_dt_rate"].values, design.K[..., 1, 1])
    assert by_name["K_T_a_dt_rate"].unit == "N m s/rad"
    if p == 2:
        np.testing.assert_array_equal(by_name["N_T_t_r_t"].values, design.N[..., 0, 1])
        assert by_name["K_T_t_int_t"].unit == "N m/(rad s)"
    if drives == "lagged":
        assert by_name["K_T_t_aileron_torque"].unit == "1"


@pytest.mark.parametrize("drives", ["ideal", "lagged"])
@pytest.mark.parametrize("reference", REFERENCES[1:])
def test_a_simulation_ends_on_the_references(reference, drives):
    """By ct.forced_response over so long that nothing moves any more; torques are then those that hold the angles."""
    model, _, loop = flown(reference, drives)
    p = len(loop.references)
    r = np.deg2rad([10.0, -4.0])[:p]
    for index in [(0, 0), (1, 3)]:
        here = loop.take(index)
        system = ct.ss(here.closed, here.reference_input, here.closed_outputs, here.reference_feedthrough)
        time = np.linspace(0.0, 4.0, 2001)
        found = ct.forced_response(system, time, np.tile(r[:, None], len(time))).outputs[:, -1]
        np.testing.assert_allclose(found[[0, 1][:p]], r, atol=1e-9)
        np.testing.assert_allclose(found[2:4], 0.0, atol=1e-9)
        torque = -model.stiffness[index] @ found[[1, 0]]
        np.testing.assert_allclose(found[4:6], torque, atol=1e-8 * np.abs(torque).max())
        np.testing.assert_allclose(found[6:], torque[: len(found) - 6], atol=1e-8 * np.abs(torque).max())


@pytest.mark.parametrize("drives", ["ideal", "lagged"])
@pytest.mark.parametrize("reference", REFERENCES[1:])
def test_feed_forward_alone_ends_on_the_references(reference, drives):
    """The gains on the integrals set to zero: the loop still ends there, and gets there by itself."""
    _, design, loop = flown(reference, drives)
    integrals = [i for i, name in enumerate(loop.states) if name.startswith("int")]
    K = design.K.copy()
    K[..., integrals] = 0.0
    kept = [i for i in range(len(loop.states)) if i not in integrals]
    closed = (loop.A - loop.B @ K)[..., np.ix_(kept, kept)[0], np.ix_(kept, kept)[1]]
    assert np.linalg.eigvals(closed).real.max() < 0
    r = np.deg2rad([10.0, -4.0])[: len(loop.references)]
    index, time = (0, 2), 8.0
    drive = (loop.B @ loop.N)[index][kept] @ r
    n = len(kept)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = closed[index], drive
    end = scipy.linalg.expm(whole * time)[:n, n]
    np.testing.assert_allclose(end[[2, 0]][: len(r)], r, atol=1e-9)


def test_integrals_make_up_for_a_model_that_is_wrong():
    """Stiffness off by a fifth and a steady torque on both surfaces: both angles end on their references."""
    model, design, _ = flown("aileron_and_tab", "lagged")
    A = model.A.copy()
    A[..., 1::2, 0::2] *= 1.2
    loop = lqr_loop(replace(model, A=A), design)
    assert np.linalg.eigvals(loop.closed).real.max() < 0
    push = loop.reference_input @ np.array([0.1, -0.05]) + loop.disturbance_input[..., :2] @ np.array([0.3, -2.0])
    rest = np.linalg.solve(loop.closed, -push[..., None])[..., 0]
    np.testing.assert_allclose(rest[..., 2], 0.1, rtol=1e-9)
    np.testing.assert_allclose(rest[..., 0], -0.05, rtol=1e-9)


def test_the_loop_with_delays_moves_as_simulated_by_hand():
    """Surfaces move by the command of 3 ms ago, the controller's own model of the delay by the command of now.

    Heun's method on the model's matrices, against the method of steps on the loop.
    """
    model, design, loop = flown("aileron", "delayed")
    index, delay, w, r, dt = (0, 2), 0.003, 220.0, 0.1, 1e-5
    A, B, K, N = model.A[index], model.B[index], design.K[index], design.N[index][:, 0]
    chain, late = delay_chain(4), round(delay / dt)
    assert design.states[5:] == ("tab_torque", *(f"{a}_delay_{k}" for a in ("tab", "aileron") for k in (1, 2, 3, 4)))

    def change(x, arriving):
        u, torques = N * r - K @ x, np.array([x[5], arriving[1]])
        chains = [(chain.A @ x[6 + 4 * i : 10 + 4 * i] + chain.b * u[i]) / delay for i in (0, 1)]
        surfaces, lag = A @ x[:4] + B @ torques, w * (arriving[0] - x[5])
        return np.concatenate([surfaces, [r - x[2], lag], *chains])

    steps = 3 * late + late // 2
    states, commands = np.zeros((steps + 1, 14)), np.zeros((steps + 1, 2))
    for k in range(steps):
        commands[k] = N * r - K @ states[k]
        now, then = (commands[j] if j >= 0 else np.zeros(2) for j in (k - late, k + 1 - late))
        if k + 1 == late:  # the jump arrives at the end of this step, not in it
            then = now
        first = change(states[k], now)
        second = change(states[k] + dt * first, then)
        states[k + 1] = states[k] + 0.5 * dt * (first + second)
    found = outputs(loop.take(index), np.array([r]), np.array([steps * dt]))[0] - loop.offset[index]
    np.testing.assert_allclose(found[:4], states[-1, [2, 0, 3, 1]], rtol=2e-4)
    assert found[4] == pytest.approx(states[-1, 5], rel=2e-4)


def test_disturbances_and_noise_enter_where_they_do():
    """A torque on a surface passes no lag; noise on an angle is in its error's integral and in the feedback."""
    model, design, loop = flown("aileron_and_tab", "lagged")
    at, noise = loop.states.index, loop.disturbances.index
    np.testing.assert_array_equal(loop.G[..., :4, :2], model.B)
    np.testing.assert_array_equal(loop.G[..., 4:, :2], 0.0)
    for angle, integral in (("da", "int_a"), ("dt", "int_t")):
        column = noise(f"{angle}_noise")
        np.testing.assert_array_equal(loop.G[..., at(integral), column], -1.0)
        np.testing.assert_array_equal(loop.M[..., column], -design.K[..., at(angle)])
    assert np.count_nonzero(loop.G[0, 0, :, 2:]) == 2


def test_noise_in_the_controllers_model_of_the_delay():
    """Its chains run on the command, noise included: with w in, x' of the chains follows from u alone."""
    _, design, loop = flown("aileron", "delayed")
    random = np.random.default_rng(2)
    x, w, r = random.normal(size=len(loop.states)), random.normal(size=6), np.array([0.3])
    u = -design.K @ x + design.N @ r + loop.M @ w
    change = loop.A @ x + loop.E @ r + loop.G @ w
    chain = delay_chain(4)
    for i, name in enumerate(("tab", "aileron")):
        held = [loop.states.index(f"{name}_delay_{k}") for k in range(1, 5)]
        expected = (chain.A @ x[held] + chain.b * u[..., i, None]) / 0.003
        np.testing.assert_allclose(change[..., held], expected, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("drives", DRIVES)
def test_a_loop_is_judged_in_every_structure(drives):
    for reference in REFERENCES:
        _, _, loop = flown(reference, drives)
        found = assess(loop, np.deg2rad([10.0, -4.0])[: len(loop.references)], 1.0)
        assert np.all(found.largest_real_part < 0)
        if reference == "none":
            assert np.isnan(found.step.settling_time).all()
        else:
            np.testing.assert_allclose(found.step.steady_state_error, 0.0, atol=1e-9)
            assert np.all(found.step.settling_time < 0.5)


def test_ideal_torques_are_the_commands_and_lagged_ones_follow_them():
    _, _, loop = flown("aileron", "lagged")
    response = step_response(loop, np.array([0.1]), 0.5, 4001)
    for name, bandwidth in (("T_t", 220.0), ("T_a", 140.0)):
        torque, command = (response.outputs[..., response.index(n)] for n in (name, f"{name}_command"))
        rate = np.gradient(torque, response.time[0, 0], axis=-1, edge_order=2)
        expected = bandwidth * (command - torque)
        assert np.max(np.abs(rate - expected)[..., 2:-2]) < 1e-3 * np.max(np.abs(expected))
        # Before anything has moved the command jumps and the torque does not.
        trim = loop.offset[..., response.index(name)]
        np.testing.assert_allclose(torque[..., 0], trim, rtol=1e-12)
        assert np.all(np.abs(command[..., 0] - trim) > 0)


@pytest.mark.parametrize("drives", DRIVES)
def test_points_that_are_not_ok_hold_nan_and_grid_equals_points(drives):
    model, _ = example("wind_tunnel")
    tab, aileron, states = DRIVES[drives]
    where = np.zeros((2, 4), dtype=bool)
    where[0, 1] = where[1, 2] = True
    outcomes = Outcomes.all_ok((2, 4)).failing(where, Outcome.EXCLUDED, lambda index: "test")
    asked = LqrController("lqr", WEIGHTS, reference="aileron_and_tab", delay_states=states)
    design = design_lqr(model, asked, outcomes, tab, aileron)
    loop = lqr_loop(model, design)
    alone = lqr_loop(model.take((1, 3)), design.take((1, 3)))
    for name in ("A", "B", "E", "G", "K", "N", "M", "C", "F", "D", "H", "offset"):
        assert np.isnan(getattr(loop, name)[where]).all()
        assert np.isfinite(getattr(loop, name)[~where]).all()
        np.testing.assert_array_equal(getattr(loop, name)[1, 3], getattr(alone, name))


def test_the_tab_goes_where_its_reference_says_whatever_the_allocation():
    model, design, _ = flown("aileron_and_tab", tab_allocation="least_power")
    np.testing.assert_array_equal(design.N, flown("aileron_and_tab")[1].N)
    rest = steady_state(model, "least_power", design.structure)
    np.testing.assert_array_equal(rest.N_x[..., 0, :], np.broadcast_to([0.0, 1.0], (2, 4, 2)))
