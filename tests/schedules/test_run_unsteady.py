"""Unsteady damping through a whole study, and the reduced frequency that says when it is needed."""

from dataclasses import replace

import numpy as np
import pytest

from design.lqr.weights import ExplicitWeights
from model.reduced_frequency import QUASI_STEADY_LIMIT
from schedules.analysis import analyse
from schedules.files.json_file import read_json, write_json
from schedules.files.matlab_file import gain_matrix
from schedules.run import run
from schedules.schedule import Provenance
from schedules.schedule_of import schedule_of
from schedules.study import GridRequest

PROVENANCE = Provenance("d", "d", "sha256:0", "0.1.0", "2026-01-02T03:04:05Z")
STATES = ("dt", "dt_rate", "da", "da_rate", "int_a", "lag_1", "lag_2")


def _with(study, **options):
    return replace(study, aerodynamics=replace(study.aerodynamics, **options))


@pytest.fixture(scope="module")
def unsteady(wind_tunnel_study):
    return run(_with(wind_tunnel_study, damping="unsteady", virtual_inertia=True))


def test_every_controller_is_designed_and_judged(unsteady):
    assert [c.request.name for c in unsteady.controllers] == ["nf", "pf", "lqr"]
    for controller in unsteady.controllers:
        assert controller.outcomes.ok.all()
        assert all(np.isfinite(g.values).all() for g in controller.gains)
        assert np.all(controller.assessment.poles.real < 0)
        assert np.isfinite(controller.assessment.step.bandwidth).all()
        assert controller.loop.states[-2:] == ("lag_1", "lag_2")
        asked = [v for v in controller.verdicts if v.spec.source == "request"]
        assert all(v.passed.all() for v in asked)


def test_gains_that_leave_are_the_ones_that_stabilise(unsteady):
    """Closed loop rebuilt from the named gains and the model alone."""
    plant, lqr = unsteady.plant, unsteady.controller("lqr")
    gains = {g.name: g.values for g in lqr.gains}
    assert list(gains)[:7] == [f"K_T_t_{x}" for x in STATES]
    own = [STATES.index(name) for name in plant.model.states]
    for index in np.ndindex(plant.grid.shape):
        A, B = np.zeros((7, 7)), np.zeros((7, 2))
        A[np.ix_(own, own)], B[own], A[4, 2] = plant.model.A[index], plant.model.B[index], -1.0
        K = np.array([[gains[f"K_{u}_{x}"][index] for x in STATES] for u in ("T_t", "T_a")])
        poles = np.linalg.eigvals(A - B @ K)
        assert np.max(poles.real) < 0
        found = np.sort(lqr.assessment.poles[index].real)
        np.testing.assert_allclose(np.sort(poles.real), found, rtol=1e-6, atol=1e-6)


def test_tab_only_gains_stabilise_the_transfer_function(unsteady):
    """Positive feedback, from the servo-tab's transfer function, the servo and the gains alone."""
    plant, pf = unsteady.plant, unsteady.controller("pf")
    gains = {g.name: g.values for g in pf.gains}
    w, z = unsteady.study.tab_actuator.servo_bandwidth, unsteady.study.tab_actuator.servo_damping_ratio
    for index in np.ndindex(plant.grid.shape):
        top, bottom = plant.servo_tab.numerator[index], plant.servo_tab.denominator[index]
        lag = [1.0, 2.0 * z * w, w**2]
        # dt_cmd = -(K_i (r - da)/s + K_f da): s lag bottom - w^2 top (K_i - K_f s) = 0.
        closed = np.polyadd(
            np.polymul([1.0, 0.0], np.polymul(lag, bottom)),
            -(w**2) * np.polymul(top, [-gains["K_f"][index], gains["K_i"][index]]),
        )
        found = np.sort_complex(pf.assessment.poles[index])
        np.testing.assert_allclose(np.sort_complex(np.roots(closed)), found, rtol=1e-5)


def test_lag_changes_the_gains(unsteady, wind_tunnel_study):
    quasi = run(_with(wind_tunnel_study, damping="quasi_steady", virtual_inertia=True))
    for one, other in zip(unsteady.controllers[:2], quasi.controllers[:2], strict=True):
        assert np.all(np.abs(one.gains[-1].values / other.gains[-1].values - 1.0) > 0.01)


def test_schedule_files_hold_the_lag_gains(unsteady):
    schedule = schedule_of(unsteady, unsteady.controller("lqr"), PROVENANCE)
    back = read_json(write_json(schedule))
    assert [g.name for g in back.gains] == [g.name for g in schedule.gains]
    assert {g.unit for g in back.gains if "lag" in g.name} == {"N m/rad"}
    assert gain_matrix(schedule, "K").columns == STATES


def test_explicit_weights_of_seven_states(wind_tunnel_study):
    weights = ExplicitWeights(np.diag([30.0, 0.02, 800.0, 0.08, 3e5, 0.0, 0.0]), np.diag([4.0, 0.25]))
    lqr = replace(wind_tunnel_study.controllers[2], weights=weights)
    found = run(_with(replace(wind_tunnel_study, controllers=(lqr,)), damping="unsteady"))
    assert found.controllers[0].outcomes.ok.all()


def test_point_by_point_equals_the_grid(unsteady):
    study = unsteady.study
    one = run(replace(study, grid=replace(study.grid, altitude=(3000.0,), speed=(980.0,))))
    for alone, whole in zip(one.controllers, unsteady.controllers, strict=True):
        for g, h in zip(alone.gains, whole.gains, strict=True):
            assert g.values[0, 0] == pytest.approx(h.values[1, 2], rel=1e-6)
        assert alone.reduced_frequency[0, 0] == pytest.approx(whole.reduced_frequency[1, 2], rel=1e-6)


def test_quasi_steady_damping_warns_of_fast_loops(wind_tunnel_envelope):
    (warning,) = [w for w in wind_tunnel_envelope.warnings if w.code == "reduced_frequency"]
    assert warning.points == tuple(range(8))
    condition = wind_tunnel_envelope.plant.grid.condition
    for controller in wind_tunnel_envelope.controllers:
        k = controller.reduced_frequency
        assert f"{controller.request.name} {np.max(k):.3g}" in warning.detail
        np.testing.assert_allclose(k, np.abs(controller.fastest_mode) * 0.3 / condition.airspeed, rtol=1e-12)
        # It is one of the closed-loop poles, and no faster than the fastest of them.
        gap = np.abs(controller.assessment.poles - controller.fastest_mode[..., None]).min(axis=-1)
        assert np.all(gap < 1e-6 * np.abs(controller.fastest_mode))


def test_unsteady_damping_needs_no_warning(unsteady):
    assert "reduced_frequency" not in [w.code for w in unsteady.warnings]
    assert all(np.all(c.reduced_frequency > QUASI_STEADY_LIMIT) for c in unsteady.controllers)


def test_only_the_fast_points_are_named(wind_tunnel_study):
    """A heavy section is slow against its air: at the higher speed nothing is to be warned of.

    The weights ask for little, so the closed loop stays about as fast as the open one.
    """
    study = replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[2:])
    body = study.inertia
    heavy = replace(
        body,
        aileron=replace(body.aileron, inertia=body.aileron.inertia * 3e3),
        tab=replace(body.tab, inertia=body.tab.inertia * 3e3),
    )
    study = replace(study, inertia=heavy, grid=GridRequest((0.0,), "airspeed", (5.0, 90.0)))
    envelope = run(study)
    k = envelope.controllers[0].reduced_frequency
    assert k[0, 0] > QUASI_STEADY_LIMIT > k[0, 1]
    (warning,) = [w for w in envelope.warnings if w.code == "reduced_frequency"]
    assert warning.points == (0,)


def test_points_without_a_design_have_no_reduced_frequency(wind_tunnel_study):
    envelope = run(replace(wind_tunnel_study, grid=GridRequest((0.0,), "mach", (0.1, 1.2))))
    for controller in envelope.controllers:
        assert np.isfinite(controller.reduced_frequency[0, 0])
        assert np.isnan(controller.reduced_frequency[0, 1])
    plant = envelope.plant
    assert np.isfinite(plant.reduced_frequency[0, 0])
    assert np.isnan(plant.reduced_frequency[0, 1])


def test_reduced_frequency_of_the_plant_is_that_of_its_fastest_mode(wind_tunnel_study):
    plant = analyse(wind_tunnel_study)
    fastest = np.max(np.abs(np.linalg.eigvals(plant.model.A)), axis=-1)
    np.testing.assert_allclose(plant.reduced_frequency, fastest * 0.3 / plant.grid.condition.airspeed, rtol=1e-9)
    # Proportional to V in speed, so the same at every speed of one altitude.
    np.testing.assert_allclose(plant.reduced_frequency, plant.reduced_frequency[:, :1] * np.ones(4), rtol=1e-9)
