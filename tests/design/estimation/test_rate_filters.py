"""Filtered rates against the block algebra of transfer functions, and the laws that the new loop obeys."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.assess import assess
from design.delay.pade import delay_chain
from design.disturbance.closed_system import closed_system
from design.estimation.rate_filters import with_rate_filters
from model.lag_states import incidence_row, lag_pace
from tests.design.estimation.estimation_cases import (
    CASES,
    FIELDS,
    full_state,
    open_response,
    plant,
    same_numbers,
    with_holes,
)

POINT = (1, 2)
COMPLEX = np.array([0.3j, 4.0j, 37.0j, 210.0j, 1900.0j, 15.0 + 60.0j, -3.0 + 11.0j])


def _angle_gains(loop, index, w, s):
    """What the commands take of the angles at s, (m, 2) order [dt, da], and of the other states, each by transfers."""
    at, K = loop.states.index, loop.K[index]
    rate = w * s / (s + w)
    gains = np.stack(
        [K[:, at("dt")] + rate * K[:, at("dt_rate")], K[:, at("da")] + rate * K[:, at("da_rate")]], axis=-1
    )
    if "lag_1" in loop.states:
        unsteady = plant(True)
        pace, worth = (
            lag_pace(unsteady.system, unsteady.condition)[index],
            incidence_row(unsteady.system, unsteady.condition),
        )
        heard = np.array([worth[index][0] + rate * worth[index][1], worth[index][2] + rate * worth[index][3]])
        for i, lag in enumerate(("lag_1", "lag_2")):
            gains = gains + np.outer(K[:, at(lag)], pace[i] / (s + pace[i]) * heard)
    for integral, column in (("int_t", 0), ("int_a", 1)):
        if integral in loop.states:
            gains[:, column] -= K[:, at(integral)] / s
    return gains


def _delay_answer(loop, index, s):
    """``K_z (sI - A_z)^-1 b`` of the controller's models of delays (m, m): commands come back through them."""
    found = np.zeros((2, 2), dtype=complex)
    for i, actuator in enumerate(loop.inputs):
        rows = [k for k, name in enumerate(loop.states) if name.startswith(f"{actuator}_delay_")]
        if rows:
            chain = delay_chain(len(rows))
            state = np.linalg.solve(s * loop.delay[i] * np.eye(len(rows)) - chain.A, chain.b)
            found[:, i] = loop.K[index][:, rows] @ state
    return found


def _answer(loop, index, w, s):
    """From the measured angles to minus the commands (m, 2), and from measured torques (m, k)."""
    torques = [loop.states.index(name) for name in loop.states if name.endswith("_torque")]
    back = np.linalg.inv(np.eye(2) + _delay_answer(loop, index, s))
    return back @ _angle_gains(loop, index, w, s), back @ loop.K[index][:, torques], torques


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("cutoff", [30.0, 2000.0])
def test_loop_transfer_by_block_algebra(name, cutoff):
    """L from what the controller does with angles and torques, and how the plant alone makes these from commands."""
    loop = full_state(name)
    point = with_rate_filters(loop, cutoff).take(POINT)
    alone = [i for i, state in enumerate(loop.states) if not state.startswith("int_") and "_delay_" not in state]
    A, B = loop.A[POINT][np.ix_(alone, alone)], loop.B[POINT][alone]
    for s in COMPLEX:
        motion = np.zeros((len(loop.states), 2), dtype=complex)
        motion[alone] = np.linalg.solve(s * np.eye(len(alone)) - A, B)
        by_angle, by_torque, torques = _answer(loop, POINT, cutoff, s)
        wanted = by_angle @ motion[[loop.states.index("dt"), loop.states.index("da")]] + by_torque @ motion[torques]
        found = open_response(point, s)
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-11 * np.abs(wanted).max())


@pytest.mark.parametrize("name", CASES)
def test_noise_of_an_angle_reaches_the_commands_as_the_angle_does(name):
    """With the plant held still, what is commanded answers noise alone."""
    loop = full_state(name)
    made = with_rate_filters(loop, 150.0)
    assert made.disturbances == ("T_t_disturbance", "T_a_disturbance", "dt_noise", "da_noise")
    point, columns = made.take(POINT), [made.disturbances.index(f"{angle}_noise") for angle in ("dt", "da")]
    for s in COMPLEX:
        command = point.M[:, columns] - open_response(point, s, "G")[:, columns]
        wanted = -_answer(loop, POINT, 150.0, s)[0]
        np.testing.assert_allclose(command, wanted, rtol=1e-9, atol=1e-11 * np.abs(wanted).max())


@pytest.mark.parametrize("name", CASES)
def test_what_the_plant_does_is_as_before(name):
    """Disturbances, references and commands drive the plant and its outputs as they do in the full-state loop."""
    loop = full_state(name)
    made = with_rate_filters(loop, 150.0)
    n = len(loop.states)
    assert made.states[:n] == loop.states
    lags = ("lag_1_filtered", "lag_2_filtered") if name == "unsteady" else ()
    assert made.states[n:] == ("dt_filtered", "da_filtered", *lags)
    outside = [i for i, state in enumerate(loop.states) if not state.startswith("int_") and "_delay_" not in state]
    np.testing.assert_array_equal(made.A[..., outside, :n], loop.A[..., outside, :])
    for field in ("A", "C", "F"):
        assert not np.any(getattr(made, field)[..., outside if field == "A" else slice(None), n:])
    for field in ("B", "E", "G"):
        torques = slice(2) if field == "G" else slice(None)
        np.testing.assert_array_equal(getattr(made, field)[..., :n, torques], getattr(loop, field)[..., torques])
        assert not np.any(getattr(made, field)[..., n:, torques])
    for field in ("C", "F"):
        np.testing.assert_array_equal(getattr(made, field)[..., :n], getattr(loop, field))
    for field in ("N", "D", "H", "offset"):
        np.testing.assert_array_equal(getattr(made, field), getattr(loop, field))
    at = made.states.index
    for unread in ("dt_rate", "da_rate", "lag_1", "lag_2"):
        if unread in made.states:
            assert not np.any(made.K[..., at(unread)])
            assert not np.any(made.A[..., [i for i in range(len(made.states)) if i not in outside], at(unread)])


@pytest.mark.parametrize("name", CASES)
def test_stages_are_the_cuts(name):
    made = with_rate_filters(full_state(name), 300.0)
    for stage, actuator in zip(made.stages, made.inputs, strict=True):
        np.testing.assert_array_equal(stage.A, made.cut(actuator).A)
        np.testing.assert_allclose(stage.closed(), made.closed, rtol=1e-9, atol=1e-9 * np.abs(made.closed).max())


@pytest.mark.parametrize("name", ["ideal", "lagged", "unsteady"])
def test_fast_filters_are_the_full_state_feedback(name):
    """Every pole of the full-state loop has one near it, the nearer the faster the filters; theirs are at -w."""
    loop = full_state(name)
    poles = np.linalg.eigvals(loop.closed[POINT])
    errors = []
    for cutoff in (1e4, 1e5, 1e6):
        made = np.linalg.eigvals(with_rate_filters(loop, cutoff).closed[POINT])
        errors.append(np.max(np.min(np.abs(made[:, None] - poles), axis=0) / np.abs(poles)))
    assert errors[1] < 0.15 * errors[0]
    assert errors[2] < 0.15 * errors[1]
    assert errors[2] < 1e-3


@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 5.0), st.sampled_from(["ideal", "lagged", "unsteady"]), st.integers(0, 3))
def test_references_are_met_whatever_the_filters(log_cutoff, name, column):
    """At rest a filtered rate is zero: the steady state is that of the full-state feedback."""
    loop = full_state(name).take((0, column))
    made = with_rate_filters(loop, 10.0**log_cutoff)
    for one in (loop, made):
        rest = np.linalg.solve(one.closed, -one.reference_input)
        output = one.closed_outputs @ rest + one.reference_feedthrough
        if one is loop:
            wanted = output
    np.testing.assert_allclose(output, wanted, rtol=1e-7, atol=1e-7 * np.abs(wanted).max())


def test_a_slow_filter_takes_the_damping_away_and_assess_says_so():
    loop = full_state("ideal")
    ratios = [assess(with_rate_filters(loop, w), np.array([0.1]), 0.5).damping_ratio.min() for w in (1e4, 100.0, 10.0)]
    assert ratios[0] > ratios[1] > 0.0 > ratios[2]


def test_a_filter_takes_white_noise_to_the_command_at_once():
    """The direct way from noise to command is K_dt + w K_dt_rate: white noise makes commands of infinite variance."""
    loop = full_state("ideal")
    made = with_rate_filters(loop, 200.0)
    system = closed_system(made, ("dt_noise",), ("tab",))
    wanted = -(loop.K[..., 0, 0] + 200.0 * loop.K[..., 0, 1])
    np.testing.assert_allclose(system.D[..., 0, 0], wanted, rtol=1e-12)


@pytest.mark.parametrize("name", CASES)
def test_grid_equals_points(name):
    loop = full_state(name)
    cutoff = np.linspace(50.0, 900.0, 8).reshape(2, 4)
    made = with_rate_filters(loop, cutoff)
    for index in [(0, 0), (1, 3)]:
        same_numbers(made.take(index), with_rate_filters(loop.take(index), cutoff[index]))


def test_points_without_a_design_stay_without():
    loop, mask = with_holes(full_state("lagged"))
    cutoff = np.linspace(50.0, 900.0, 8).reshape(2, 4)
    made, whole = with_rate_filters(loop, cutoff), with_rate_filters(full_state("lagged"), cutoff)
    for field in FIELDS:
        assert np.isnan(getattr(made, field)[~mask]).all()
        np.testing.assert_array_equal(getattr(made, field)[mask], getattr(whole, field)[mask])
    assert np.isnan(with_rate_filters(loop.take((0, 1)), 100.0).A).all()


@pytest.mark.parametrize("cutoff", [0.0, -1.0, np.inf, np.nan])
def test_a_cutoff_must_be_positive(cutoff):
    with pytest.raises(ValueError, match="cut-off"):
        with_rate_filters(full_state("ideal"), cutoff)


def test_filters_are_made_once():
    made = with_rate_filters(full_state("ideal"), 100.0)
    with pytest.raises(ValueError, match="dt_filtered, da_filtered"):
        with_rate_filters(made, 100.0)
