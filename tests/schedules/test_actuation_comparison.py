"""Controllers side by side: against the assessment, python-control, inverse dynamics by hand, and themselves alone."""

from __future__ import annotations

from dataclasses import fields, replace

import control
import numpy as np
import pytest

import schedules.actuation_comparison as compared
from design.actuator_sizing.tab_held import with_tab_held
from design.classical.controller import ClassicalController
from design.lqr.controller import LqrController
from design.manoeuvre import rate_limited_step, step
from design.response.manoeuvre_response import manoeuvre_response
from design.sampling import Sampling
from schedules.actuation_comparison import (
    Actuation,
    rate_limited_actuation,
    samples_needed,
    step_actuation,
    usual_rates,
    why_not_compared,
)
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.run import run
from schedules.study import GridRequest, Study
from schedules.tab_saving import tab_saving

NAMES = ("nf", "pf", "lqr")
FIGURES = [field.name for field in fields(Actuation)]
RATES = np.deg2rad([30.0, 150.0, 900.0])


@pytest.fixture(scope="module")
def envelope(wind_tunnel_study: Study) -> DesignedEnvelope:
    return run(wind_tunnel_study)


def assert_alike(one: Actuation, other: Actuation, rtol: float) -> None:
    for name in FIGURES:
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=rtol, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("name", NAMES)
def test_the_step_is_that_of_the_assessment(envelope: DesignedEnvelope, name: str) -> None:
    controller, reference = envelope.controller(name), envelope.study.reference
    found, assessment = step_actuation(envelope.plant, controller, reference), controller.assessment
    tab = assessment.demand[assessment.actuators.index("tab")]
    np.testing.assert_array_equal(found.tab_peak_torque, tab.peak_torque)
    np.testing.assert_array_equal(found.tab_peak_rate, tab.peak_rate)
    np.testing.assert_array_equal(found.tab_peak_deflection, tab.peak_deflection)
    np.testing.assert_array_equal(found.settling_time, assessment.step.settling_time)
    np.testing.assert_array_equal(found.overshoot, assessment.step.overshoot)
    manoeuvre = step(reference.sizes(controller.loop.references))
    saving = tab_saving(envelope.plant, controller, manoeuvre, reference.duration)
    np.testing.assert_allclose(found.saving.saved, saving.saved, rtol=1e-7)
    assert found.saving.saved_of_the_envelope == pytest.approx(saving.saved_of_the_envelope, rel=1e-7)


@pytest.mark.parametrize("name", NAMES)
def test_the_faster_the_reference_the_more_it_is_the_step(envelope: DesignedEnvelope, name: str) -> None:
    """The same figures from another route: a response by stretches, whose last one begins when the ramp is over."""
    controller, reference = envelope.controller(name), envelope.study.reference
    whole = step_actuation(envelope.plant, controller, reference)
    fast = rate_limited_actuation(envelope.plant, controller, reference, np.array([1e5, 1e7]))
    assert_alike(fast.take((..., 1)), whole, 1e-5)
    for figure in ("settling_time", "tab_peak_rate"):
        first, second = (np.abs(getattr(fast, figure)[..., r] - getattr(whole, figure)).max() for r in (0, 1))
        assert second < 0.1 * first or second < 1e-8


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("point", [(0, 0), (1, 3)])
def test_python_control_agrees(envelope: DesignedEnvelope, name: str, point: tuple[int, ...]) -> None:
    """Responses of `forced_response`; the torque with the tab held from them by the rows of the linear model."""
    controller, study, model = envelope.controller(name), envelope.study, envelope.plant.model.take(point)
    found = rate_limited_actuation(envelope.plant, controller, study.reference, RATES).take(point)
    loop = controller.loop.take(point)
    A, E = loop.closed, loop.reference_input
    # J_aa da'' - (J A)_a [da, da'] in the rows of the rates: J inverse of B there
    rows = [1, 3]
    J = np.linalg.inv(model.B[rows])
    held = -(J @ model.A[rows])[1]
    surfaces = [loop.states.index(x) for x in ("da", "da_rate")]
    C, D = np.zeros(A.shape[0]), J[1, 1] * E[surfaces[1]]
    C += J[1, 1] * A[surfaces[1]]
    C[surfaces] += held[2:4]
    outputs, feed = np.vstack([loop.closed_outputs, C]), np.vstack([loop.reference_feedthrough, D])
    system = control.ss(A, E, outputs, feed)
    trim = np.append(loop.offset, model.input_offset[1])
    for r, rate in enumerate(RATES):
        manoeuvre = rate_limited_step(study.reference.sizes(loop.references), float(rate))
        arrives = float(manoeuvre.times[-1])
        fine = arrives / np.ceil(arrives / 2e-5)  # the end of the ramp is a sample
        time = fine * np.arange(int(np.floor((arrives + study.reference.duration) / fine * (1.0 + 1e-12))) + 1)
        y = control.forced_response(system, time, manoeuvre.at(time).T).outputs + trim[:, None]
        peak = dict(zip((*loop.outputs, "held"), np.abs(y).max(axis=-1), strict=True))
        assert found.tab_held_peak_torque[r] == pytest.approx(peak["held"], rel=1e-4)
        assert found.tab_peak_torque[r] == pytest.approx(peak["T_t"], rel=1e-4)
        assert found.tab_peak_rate[r] == pytest.approx(peak["dt_rate"], rel=1e-4)
        assert found.tab_peak_deflection[r] == pytest.approx(peak["dt"], rel=1e-6)
        assert found.aileron_peak_torque[r] == pytest.approx(peak["T_a"], rel=1e-4)
        final = np.deg2rad(10.0) if "int_a" in loop.states or name != "lqr" else y[0, -1]
        part = (y[loop.outputs.index("da")] - trim[loop.outputs.index("da")]) / final
        outside = np.flatnonzero(np.abs(part - 1.0) > 0.02)
        if outside[-1] == time.size - 1:
            assert np.isnan(found.settling_time[r])
        else:
            assert found.settling_time[r] == pytest.approx(time[outside[-1]], abs=2.0 * time[1])
        assert found.overshoot[r] == pytest.approx(max(part.max() - 1.0, 0.0), abs=1e-6)


def test_a_slow_reference_saves_torque_and_loses_time(envelope: DesignedEnvelope) -> None:
    """Seed Fig 5.20: the slower, the less torque of either actuator; and what is left is what holds the aileron."""
    rates = usual_rates(envelope.study.reference)
    np.testing.assert_allclose(np.rad2deg(rates), [20.0, 40.0, 80.0, 160.0, 320.0, 640.0])
    found = rate_limited_actuation(envelope.plant, envelope.controller("lqr"), envelope.study.reference, rates)
    for peak in (found.aileron_peak_torque, found.tab_peak_torque, found.tab_peak_rate):
        assert np.all(np.diff(peak, axis=-1) >= -1e-9)
    assert np.all(np.diff(found.settling_time, axis=-1) < 0.0)
    envelope_saved = [found.saving.take((..., r)).saved_of_the_envelope for r in range(len(rates))]
    assert (
        envelope_saved[0]
        > step_actuation(
            envelope.plant, envelope.controller("lqr"), envelope.study.reference
        ).saving.saved_of_the_envelope
    )


def test_a_point_among_others_is_as_it_is_alone(
    wind_tunnel_study: Study, envelope: DesignedEnvelope, monkeypatch: pytest.MonkeyPatch
) -> None:
    controllers = (envelope.study.controllers[2],)
    whole = rate_limited_actuation(envelope.plant, envelope.controller("lqr"), envelope.study.reference, RATES)
    grid = wind_tunnel_study.grid
    for i, j in ((0, 1), (1, 2)):
        alone = GridRequest((grid.altitude[i],), grid.speed_axis, (grid.speed[j],))
        single = run(replace(wind_tunnel_study, grid=alone, controllers=controllers))
        found = rate_limited_actuation(single.plant, single.controllers[0], single.study.reference, RATES)
        assert_alike(found.take((0, 0)), whole.take((i, j)), 1e-7)
    monkeypatch.setattr(compared, "AT_ONCE", 3)
    parts = rate_limited_actuation(envelope.plant, envelope.controller("lqr"), envelope.study.reference, RATES)
    assert_alike(parts, whole, 1e-7)
    in_parts = step_actuation(envelope.plant, envelope.controller("lqr"), envelope.study.reference)
    monkeypatch.undo()
    assert_alike(in_parts, step_actuation(envelope.plant, envelope.controller("lqr"), envelope.study.reference), 1e-7)


def failing(controller: DesignedController, where: np.ndarray) -> DesignedController:
    return replace(controller, outcomes=controller.outcomes.failing(where, "infeasible", lambda index: "none"))


def test_a_point_without_a_design_breaks_no_other(envelope: DesignedEnvelope) -> None:
    where = np.zeros(envelope.plant.grid.shape, dtype=bool)
    where[1, 2] = True
    controller = failing(envelope.controller("nf"), where)
    study = envelope.study
    for found, whole in (
        (
            rate_limited_actuation(envelope.plant, controller, study.reference, RATES),
            rate_limited_actuation(envelope.plant, envelope.controller("nf"), study.reference, RATES),
        ),
        (
            step_actuation(envelope.plant, controller, study.reference),
            step_actuation(envelope.plant, envelope.controller("nf"), study.reference),
        ),
    ):
        assert_alike(found.take(~where), whole.take(~where), 1e-7)
        assert all(np.isnan(getattr(found, name)[where]).all() for name in FIGURES)


def test_what_is_not_compared_says_why(wind_tunnel_study: Study, envelope: DesignedEnvelope) -> None:
    lqr = next(c for c in wind_tunnel_study.controllers if isinstance(c, LqrController))
    study = replace(
        wind_tunnel_study,
        controllers=(
            replace(lqr, name="rests", reference="none"),
            replace(lqr, name="coded", sampling=Sampling(0.002, 0.002)),
        ),
    )
    others = run(study)
    nowhere = failing(envelope.controller("lqr"), np.ones(envelope.plant.grid.shape, dtype=bool))
    for controller, word in (
        (others.controller("rests"), "no reference"),
        (others.controller("coded"), "runs as code"),
        (nowhere, "no point"),
    ):
        assert word in str(why_not_compared(controller))
        assert samples_needed(controller, study.reference, RATES) == 0
        with pytest.raises(ValueError, match=word):
            step_actuation(others.plant, controller, study.reference)
        with pytest.raises(ValueError, match=word):
            rate_limited_actuation(others.plant, controller, study.reference, RATES)
    assert why_not_compared(envelope.controller("nf")) is None
    with pytest.raises(ValueError, match="rate"):
        rate_limited_actuation(envelope.plant, envelope.controller("nf"), study.reference, np.array([0.0]))
    assert rate_limited_actuation(
        envelope.plant, envelope.controller("nf"), study.reference, np.array([])
    ).settling_time.shape == (2, 4, 0)


def test_the_work_is_known_before(envelope: DesignedEnvelope) -> None:
    study, counted = envelope.study, 0
    for controller in envelope.controllers:
        loop = with_tab_held(controller.loop, envelope.plant.model)
        for manoeuvre in (
            step(study.reference.sizes(loop.references)),
            *(rate_limited_step(study.reference.sizes(loop.references), rate) for rate in RATES),
        ):
            response = manoeuvre_response(loop, manoeuvre, manoeuvre.times[-1] + study.reference.duration, 2)
            counted += sum(part.values.size for part in response.driven.signals(response.rows[..., :1, :]))
    assert sum(samples_needed(c, study.reference, RATES) for c in envelope.controllers) == counted


def test_light_damping_settles_late_and_is_followed_in_parts(wind_tunnel_study: Study) -> None:
    """A response of many parts settles when that of the assessment does, which has one mesh from beginning to end."""
    nf = next(c for c in wind_tunnel_study.controllers if isinstance(c, ClassicalController))
    gains = {"K_d": 0.002, "K_p": 0.6, "K_i": 20.0}
    study = replace(
        wind_tunnel_study,
        controllers=(replace(nf, gains=gains, specs=()),),
        reference=replace(wind_tunnel_study.reference, duration=40.0),
        grid=replace(wind_tunnel_study.grid, altitude=(0.0,), speed=(1531.25,)),
    )
    envelope = run(study)
    (controller,) = envelope.controllers
    assert samples_needed(controller, study.reference, np.array([])) > 10_000
    whole = step_actuation(envelope.plant, controller, study.reference)
    fast = rate_limited_actuation(envelope.plant, controller, study.reference, np.array([1e6]))
    assert_alike(fast.take((..., 0)), whole, 1e-4)
    assert whole.settling_time[0, 0] > 0.5
