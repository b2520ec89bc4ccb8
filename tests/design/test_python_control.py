"""The door to python-control: named systems, its own figures of every kind of loop, and schedules that it flies."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import control as ct
import numpy as np
import pytest

import design.python_control as door
from design.delay.with_pade import without_delay
from design.loop import Loop
from design.python_control import (
    control_margins,
    control_poles,
    control_step,
    model_state_space,
    opened_state_space,
    optimal_gain,
    to_state_space,
)
from schedules.cross_check import Checked, cross_check
from schedules.designed import DesignedEnvelope
from schedules.interpolate import interpolate
from schedules.run import run
from schedules.schedule import GainSchedule, Provenance
from schedules.schedule_of import schedule_of
from schedules.to_control import gain_scheduled_system
from service.documentation.design_examples import design_requests
from service.schemas.requests import DesignRequest
from service.to_domain import study_of

WHERE = Provenance("0" * 32, "test", "0" * 64, "0", "2026-01-01T00:00:00Z")
POINTS = [(0, 0), (1, 3)]


def designed(name: str) -> DesignedEnvelope:
    return run(study_of.study(DesignRequest.model_validate(design_requests()[name][1])))


@pytest.fixture(scope="module")
def envelope(wind_tunnel_envelope: DesignedEnvelope) -> DesignedEnvelope:
    return wind_tunnel_envelope


@pytest.fixture(scope="module")
def structures() -> DesignedEnvelope:
    return designed("lqr_structures")


def schedule(envelope: DesignedEnvelope, name: str) -> GainSchedule:
    return schedule_of(envelope, envelope.controller(name), WHERE)


def test_control_is_not_imported_before_it_is_asked_for() -> None:
    """Neither the domain nor the whole service waits for it at their start."""
    code = "import sys, service.app, schedules.to_control; assert 'control' not in sys.modules, 'control is imported'"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[2], timeout=120)


def test_models_have_their_names(envelope: DesignedEnvelope) -> None:
    model = envelope.plant.model
    system = model_state_space(model, (1, 2))
    assert (system.state_labels, system.input_labels) == (["dt", "dt_rate", "da", "da_rate"], ["T_t", "T_a"])
    assert system.output_labels == ["dt", "da"]
    np.testing.assert_array_equal(system.A, model.A[1, 2])
    np.testing.assert_array_equal(system.B, model.B[1, 2])


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_closed_loops_answer_as_python_control_closes_them(envelope: DesignedEnvelope, name: str) -> None:
    """Of all outputs, those that take rates of states too: from the reference, and from a torque on the aileron."""
    loop = envelope.controller(name).loop
    for index in POINTS:
        system, here = to_state_space(loop, index), loop.take(index)
        assert system.input_labels == list(loop.references)
        assert system.output_labels == list(loop.outputs)
        plant = ct.ss(here.A, np.hstack([here.B, here.E]), np.eye(len(here.A)), 0.0)
        law = ct.ss([], [], [], np.hstack([here.K, -here.N]))
        omega = 37.0
        at = plant(1j * omega).reshape(len(here.A), -1)
        m = here.B.shape[1]
        K, N = law.D[:, :-1], -law.D[:, -1:]
        x = np.linalg.solve(np.eye(len(here.A)) + at[:, :m] @ K, at[:, :m] @ N + at[:, m:])
        u = N - K @ x
        y = here.C @ x + 1j * omega * here.F @ x + here.D @ u + 1j * omega * here.H @ u
        np.testing.assert_allclose(np.asarray(system(1j * omega)).reshape(-1, 1), y, rtol=1e-9, atol=1e-12)
    some = to_state_space(loop, (0, 0), ("T_a_disturbance",), ("da", *loop.inputs))
    assert (some.ninputs, some.output_labels) == (1, ["da", *loop.inputs])
    with pytest.raises(ValueError, match="no output or command"):
        to_state_space(loop, (0, 0), outputs=("nothing",))


def test_delays_become_chains_and_opened_loops_keep_those_of_others(structures: DesignedEnvelope) -> None:
    loop = structures.controller("aileron").loop.take((0, 1))
    assert max(loop.delay) > 0.0
    chained = without_delay(loop)
    assert to_state_space(loop).state_labels == list(chained.states)
    omega = np.array([3.0, 70.0, 400.0])
    turn = np.exp(-1j * omega * loop.delay[0])
    n = len(loop.A)
    whole = loop.K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(n) - loop.A, loop.B + 0j)
    # the aileron's loop with the tab's closed, late as it is
    by_hand = whole[:, 1, 1] - whole[:, 1, 0] * turn / (1.0 + whole[:, 0, 0] * turn) * whole[:, 0, 1]
    cut = opened_state_space(loop, "aileron")
    np.testing.assert_allclose(cut(1j * omega), by_hand, rtol=1e-9)
    # that of the tab is left to who asks: the transfer does not hold it
    by_hand = whole[:, 0, 0] - whole[:, 0, 1] / (1.0 + whole[:, 1, 1]) * whole[:, 1, 0]
    np.testing.assert_allclose(opened_state_space(loop, "tab")(1j * omega), by_hand, rtol=1e-9)


def test_optimal_gain_minimises_with_a_cross_term() -> None:
    rng = np.random.default_rng(2)
    A, B = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    R, N = np.diag([2.0, 0.5]), 0.1 * rng.normal(size=(4, 2))
    Q = np.eye(4) + N @ np.linalg.solve(R, N.T)
    K = optimal_gain(A, B, 1e3 * Q, 1e3 * R, 1e3 * N, discrete=False)  # symmetric up to rounding only
    assert np.linalg.eigvals(A - B @ K).real.max() < 0.0

    def cost(K: np.ndarray) -> float:
        F, W = A - B @ K, Q + K.T @ R @ K - N @ K - K.T @ N.T
        return float(np.trace(ct.lyap(F.T, 0.5 * (W + W.T))))

    best = cost(K)
    for _ in range(20):
        assert cost(K + 1e-3 * rng.normal(size=K.shape)) > best


EXAMPLES = ["given_gains", "lqr_structures", "lqr_measured", "lqr_sampled", "lqr_power", "four_classical_controllers"]


@pytest.mark.parametrize("name", ["wind_tunnel", *EXAMPLES])
def test_every_kind_of_controller_agrees(name: str) -> None:
    """Digital ones, delays, filters, observers, sampled gains, weights of power: each figure within its tolerance."""
    envelope = designed(name)
    for controller in envelope.controllers:
        (index, *_) = np.argwhere(controller.outcomes.ok)
        found = cross_check(envelope, controller, tuple(index))
        disagreeing = [each for group in found.groups().values() for each in group if not each.agrees]
        assert not disagreeing, (controller.request.name, disagreeing)
        groups = found.groups()
        assert groups["poles"]
        assert len(found.margins) == len(controller.assessment.actuators)
        assert bool(groups["gains"]) == (controller.request.kind == "lqr")
        if not groups["step"]:
            assert [each.figure for each in found.left_out][-1] == "step"
        if not groups["gains"]:
            assert found.left_out[0].figure == "gains"


@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_a_wrong_figure_is_found(envelope: DesignedEnvelope, name: str) -> None:
    """One part in ten thousand of a gain, a pole, a margin or a settling time does not pass."""
    controller, index = envelope.controller(name), (1, 1)
    assert cross_check(envelope, controller, index).agrees
    found = controller.assessment
    margins = tuple(replace(each, phase_margin=each.phase_margin * 1.0001) for each in found.margins)
    step = replace(found.step, settling_time=found.step.settling_time + 2e-4)
    wrong = {
        "poles": replace(found, poles=found.poles * (1.0 + 1e-4)),
        "margins": replace(found, margins=margins),
        "step": replace(found, step=step),
    }
    for group, assessment in wrong.items():
        checked = cross_check(envelope, replace(controller, assessment=assessment), index)
        assert {kind for kind, each in checked.groups().items() if not all(x.agrees for x in each)} == {group}
    if name == "lqr":
        gains = tuple(replace(each, values=each.values * (1.0 + 1e-4)) for each in controller.gains)
        checked = cross_check(envelope, replace(controller, gains=gains), index)
        assert [each.agrees for each in checked.gains] == [False] * 10
        assert not checked.agrees


def test_without_gains_there_is_nothing_to_check(envelope: DesignedEnvelope) -> None:
    controller = envelope.controller("lqr")
    with pytest.raises(ValueError, match="no gains"):
        cross_check(envelope, replace(controller, assessment=None), (0, 0))


def test_what_python_control_refuses_is_left_out(envelope: DesignedEnvelope, monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(*args: object) -> None:
        raise ct.ControlArgument("not today")

    monkeypatch.setattr(door, "optimal_gain", refusing)
    monkeypatch.setattr(door, "control_margins", refusing)
    found = cross_check(envelope, envelope.controller("lqr"), (0, 0))
    assert {each.figure: each.reason for each in found.left_out}["margins"].endswith("not today")
    assert not found.gains
    assert not found.margins
    assert found.agrees


def test_two_figures_that_do_not_exist_agree() -> None:
    from schedules.cross_check import _absolute

    assert _absolute("x", "1", np.inf, np.inf, 0.1).agrees
    assert _absolute("x", "1", np.nan, np.nan, 0.1).agrees
    assert not _absolute("x", "1", np.inf, 3.0, 0.1).agrees
    assert not _absolute("x", "1", np.nan, 3.0, 0.1).agrees
    assert not Checked("x", "1", 1.0, 2.0, np.nan, 0.1).agrees


def one_state(pole: float, gain: float, delay: float = 0.0) -> Loop:
    """``gain / (s - pole)`` under unity feedback."""
    one, none = np.eye(1), np.zeros((1, 0))
    return Loop(
        A=pole * one, B=one, E=np.zeros((1, 1)), G=none, K=gain * one, N=gain * one, M=none, C=one, F=0.0 * one,
        D=0.0 * one, H=0.0 * one, offset=np.zeros(1), states=("da",), inputs=("tab",), references=("r_a",),
        outputs=("da",), disturbances=(), stages=(), delay=(delay,),
    )  # fmt: skip


def test_margins_in_closed_form() -> None:
    """k/s with a delay; k/(s - 1), which a smaller gain destabilises at zero frequency."""
    k, delay = 7.0, 0.03
    (found,) = control_margins(one_state(0.0, k, delay))
    assert found.gain_margin_up_db == pytest.approx(20.0 * np.log10(np.pi / (2.0 * k * delay)), abs=1e-5)
    assert found.phase_margin == pytest.approx(np.pi / 2 - k * delay, abs=1e-7)
    (found,) = control_margins(one_state(1.0, k))
    assert found.gain_margin_down_db == pytest.approx(-20.0 * np.log10(k), abs=1e-9)
    assert found.gain_margin_up_db == np.inf
    assert found.phase_margin == pytest.approx(np.arccos(1.0 / k), abs=1e-7)
    np.testing.assert_allclose(control_poles(one_state(1.0, k)), [1.0 - k])


def test_step_in_closed_form() -> None:
    found = control_step(one_state(-1.0, 3.0), np.array([0.1]), 3.0)
    assert found.steady_state_value == pytest.approx(0.075)
    assert found.settling_time == pytest.approx(np.log(50.0) / 4.0, abs=2.0 * found.resolution)
    assert found.rise_time == pytest.approx(np.log(9.0) / 4.0, abs=2.0 * found.resolution)
    assert found.overshoot == pytest.approx(0.0, abs=1e-12)
    long = control_step(one_state(-1.0, 3.0), np.array([0.1]), 1e4)  # samples are where something moves
    assert long.resolution < 1e-3
    assert long.settling_time == pytest.approx(np.log(50.0) / 4.0, abs=2.0 * long.resolution)
    with pytest.raises(ValueError, match="90 %"):
        control_step(one_state(-1.0, 3.0), np.array([0.1]), 0.1)


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_a_schedule_flies_as_its_loop_does(envelope: DesignedEnvelope, name: str) -> None:
    """At a grid point, connected to the model and the servo by python-control: the loop's own step response."""
    table, study, index = schedule(envelope, name), envelope.study, (1, 2)
    request = envelope.controller(name).request
    system = gain_scheduled_system(table, getattr(request, "rate_filter", None) if name == "nf" else None)
    coordinates = [axis.values[i] for axis, i in zip(table.axes, index, strict=True)]
    loop = envelope.controller(name).loop.take(index)
    time = np.linspace(0.0, 0.2, 401)
    if name == "lqr":
        model = envelope.plant.model.take(index)
        plant = ct.ss(model.A, model.B, np.eye(4), 0.0, inputs=["T_t", "T_a"], outputs=list(model.states), name="plant")
        systems = [plant, system]
    else:
        own = [i for i, state in enumerate(loop.states) if state not in ("int_a", "da_filtered")]
        A, B = loop.A[np.ix_(own, own)], loop.B[own]
        da = np.eye(len(loop.states))[[loop.states.index("da")]][:, own]
        systems = [ct.ss(A, B, da, 0.0, inputs=["dt_command"], outputs=["da"], name="plant"), system]
    inputs = ["r_a", "altitude_m", "dynamic_pressure_pa"]
    whole = ct.interconnect(systems, inputs=inputs, outputs=["da"], check_unused=False)
    u = np.vstack([np.full(time.size, study.reference.aileron), *(np.full(time.size, c) for c in coordinates)])
    found = ct.input_output_response(whole, time, u, solve_ivp_kwargs={"rtol": 1e-7, "atol": 1e-10}).outputs.ravel()
    wanted = ct.forced_response(to_state_space(loop, outputs=("da",)), time, u[0]).outputs.ravel()
    np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max() + 1e-8)


def test_a_schedule_keeps_its_rule_between_the_points(envelope: DesignedEnvelope) -> None:
    table = schedule(envelope, "lqr")
    system = gain_scheduled_system(table)
    assert system.input_labels == ["dt", "dt_rate", "da", "da_rate", "r_a", "altitude_m", "dynamic_pressure_pa"]
    assert (system.state_labels, system.output_labels) == (["int_a"], ["T_t", "T_a"])
    here = (1234.0, 700.0)
    gains = {gain.name: float(gain.values) for gain in interpolate(table, here).gains}
    u = system.output(0.0, [0.3], [0.0, 0.0, 0.2, 0.0, 0.1, *here])
    wanted = [
        gains[f"N_{t}_r_a"] * 0.1 - gains[f"K_{t}_da"] * 0.2 - gains[f"K_{t}_int_a"] * 0.3 for t in ("T_t", "T_a")
    ]
    np.testing.assert_allclose(u, wanted, rtol=1e-12)
    # outside the grid the edge counts
    edge = system.output(0.0, [0.3], [0.0, 0.0, 0.2, 0.0, 0.1, 9e3, 245.0])
    np.testing.assert_array_equal(edge, system.output(0.0, [0.3], [0.0, 0.0, 0.2, 0.0, 0.1, 3e3, 100.0]))


@pytest.mark.parametrize(
    ("example", "name", "said"),
    [
        ("lqr_sampled", "at_500_hz", "T_t_1"),
        ("lqr_structures", "both", "tab_delay_1"),
        ("lqr_measured", "estimated", "L_"),
    ],
)
def test_states_of_the_controllers_own_are_refused(example: str, name: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        gain_scheduled_system(schedule(designed(example), name))


def test_rate_filters_where_they_belong(envelope: DesignedEnvelope) -> None:
    for name, cutoff in (("lqr", 600.0), ("pf", 600.0), ("nf", -1.0), ("nf", np.inf)):
        with pytest.raises(ValueError, match="rate filter"):
            gain_scheduled_system(schedule(envelope, name), cutoff)
    assert "da_rate" in gain_scheduled_system(schedule(envelope, "nf")).input_labels
    assert "da_rate" not in gain_scheduled_system(schedule(envelope, "nf"), 600.0).input_labels
    rate = gain_scheduled_system(schedule(designed("four_classical_controllers"), "negative_rate"), 600.0)
    assert rate.output_labels == ["dt_rate_command"]
    assert "dt" in rate.input_labels
