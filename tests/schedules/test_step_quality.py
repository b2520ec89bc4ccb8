"""Settling and overshoot of many loops: what `step_metrics` says of each alone, on the mesh that it has alone."""

from dataclasses import replace

import control
import numpy as np
import pytest

import schedules.step_quality as room
from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.frequency.poles import poles
from design.response.step_metrics import step_metrics
from design.response.step_response import step_response
from model.actuators import Actuator
from schedules.analysis import analyse
from schedules.carried_loop import carried_loop
from schedules.perturbations import Uncertainty, drawn_cases, perturbed_model
from schedules.step_quality import step_quality
from tests.schedules.flown_cases import NF, PF, given

STEP, DURATION = 0.17, 0.6
POINTS = np.arange(60) % 8


def _loops(study, request=NF):
    """Stable loops of all damping ratios, from sluggish to next to none."""
    plant = analyse(study)
    designed = given(study, plant, request)
    names = ("C_Ha_da", "C_Ha_dt", "aileron_inertia")
    cases = drawn_cases([Uncertainty(name, 0.8) for name in names], len(POINTS), 3)
    loop = carried_loop(study, plant, designed, perturbed_model(plant, POINTS, names, cases.factors), POINTS)
    return loop.take(poles(loop.closed).real.max(axis=-1) < 0.0)


@pytest.mark.parametrize("request_", [NF, PF], ids=["nf", "pf"])
def test_each_loop_is_what_it_is_alone(wind_tunnel_study, request_):
    loop = _loops(wind_tunnel_study, request_)
    found = step_quality(loop, STEP, DURATION)
    assert len(loop.A) > 40
    for i in range(len(loop.A)):
        alone = loop.take(slice(i, i + 1))
        wanted = step_metrics(alone, step_response(alone, np.array([STEP]), DURATION, 2))
        np.testing.assert_allclose(found.settling_time[i], wanted.settling_time[0], rtol=1e-12)
        np.testing.assert_allclose(found.overshoot[i], wanted.overshoot[0], rtol=1e-12, atol=1e-13)
    assert np.isnan(found.settling_time).any()
    assert np.isfinite(found.settling_time).any()


@pytest.mark.parametrize("duration", [DURATION, 9.0, 70.0])
def test_every_loop_is_grouped_by_the_mesh_that_it_would_have(wind_tunnel_study, duration):
    loop = _loops(wind_tunnel_study).take(slice(0, 30))
    intervals, blocks = room._mesh(poles(loop.closed), duration)
    assert len(set(intervals)) > 3
    assert duration == DURATION or len(set(blocks)) > 1
    for i in range(len(loop.A)):
        alone = step_response(loop.take(slice(i, i + 1)), np.array([STEP]), duration, 2).graded
        assert (alone.intervals, alone.blocks) == (intervals[i], blocks[i])


def test_groups_do_not_matter(wind_tunnel_study, monkeypatch):
    loop = _loops(wind_tunnel_study)
    whole = step_quality(loop, STEP, DURATION)
    monkeypatch.setattr(room, "GROUP_BYTES", 1)
    alone = step_quality(loop, STEP, DURATION)
    for name in ("settling_time", "overshoot"):
        np.testing.assert_allclose(getattr(alone, name), getattr(whole, name), rtol=1e-12, atol=1e-13)


def test_groups_stay_small(wind_tunnel_study, monkeypatch):
    loop = _loops(wind_tunnel_study)
    monkeypatch.setattr(room, "GROUP_BYTES", 1_000_000)
    groups = list(room._groups(loop, DURATION))
    assert sorted(np.concatenate(groups)) == list(range(len(loop.A)))
    for group in groups:
        states = step_response(loop.take(group), np.array([STEP]), DURATION, 2).graded.states
        assert states.nbytes <= 1_000_000 or len(group) == 1


def test_against_python_control(wind_tunnel_study):
    loop = _loops(wind_tunnel_study)
    found = step_quality(loop, STEP, DURATION)
    time = np.linspace(0.0, DURATION, 6001)
    for i in (0, 7, 21):
        b, c = loop.reference_input[i], loop.closed_outputs[i, :1]
        system = control.ss(loop.closed[i], b, c, 0.0)
        y = control.step_response(system, time).outputs / float(control.dcgain(system))
        outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
        settled = np.nan if outside[-1] == len(time) - 1 else time[outside[-1]]
        assert found.settling_time[i] == pytest.approx(settled, abs=3e-4, nan_ok=True)
        assert found.overshoot[i] == pytest.approx(max(0.0, y.max() - 1.0), abs=1e-5)


def test_delays(wind_tunnel_study):
    study = replace(wind_tunnel_study, tab_actuator=replace(wind_tunnel_study.tab_actuator, delay=0.002))
    loop = _loops(study).take(slice(0, 20))
    found = step_quality(loop, STEP, DURATION)
    for i in (0, 3, 19):
        alone = loop.take(slice(i, i + 1))
        response = delayed_step_response(alone, np.array([STEP]), DURATION, 2)
        wanted = step_metrics(without_delay(alone), response)
        np.testing.assert_allclose(found.settling_time[i], wanted.settling_time[0], rtol=1e-9)
        np.testing.assert_allclose(found.overshoot[i], wanted.overshoot[0], rtol=1e-9, atol=1e-12)


def test_no_loops_and_loops_that_do_not_move(wind_tunnel_study):
    loop = _loops(replace(wind_tunnel_study, tab_actuator=Actuator()))
    assert step_quality(loop.take(slice(0, 0)), STEP, DURATION).overshoot.shape == (0,)
    still = replace(loop, E=np.zeros_like(loop.E), N=np.zeros_like(loop.N))
    assert np.isnan(step_quality(still, STEP, DURATION).settling_time).all()
