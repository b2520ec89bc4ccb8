"""The whole way: a study in, a designed envelope out; every gain that leaves it is stabilising."""

from dataclasses import replace

import numpy as np
import pytest

from design.classical.controller import ClassicalController
from design.gains import Gain
from design.lqr.weights import ExplicitWeights
from design.outcome import Outcome
from design.specs import Spec
from schedules.designed import ControllerRefused
from schedules.run import run
from schedules.study import GridRequest


def test_every_controller_of_the_example_is_ok_everywhere(wind_tunnel_envelope):
    assert [c.request.name for c in wind_tunnel_envelope.controllers] == ["nf", "pf", "lqr"]
    for controller in wind_tunnel_envelope.controllers:
        assert controller.outcomes.ok.all()
        assert all(np.isfinite(g.values).all() for g in controller.gains)


def test_gains_that_leave_are_the_ones_that_stabilise(wind_tunnel_envelope):
    """Closed loop rebuilt from the named gains and the model alone, not from the loop that was judged."""
    plant, lqr = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    gains = {g.name: g.values for g in lqr.gains}
    for index in np.ndindex(plant.grid.shape):
        A, B = np.zeros((5, 5)), np.zeros((5, 2))
        A[:4, :4], A[4, 2], B[:4] = plant.model.A[index], -1.0, plant.model.B[index]
        K = [[gains[f"K_{u}_{x}"][index] for x in ("dt", "dt_rate", "da", "da_rate", "int_a")] for u in ("T_t", "T_a")]
        poles = np.linalg.eigvals(A - B @ np.array(K))
        assert np.max(poles.real) < 0
        np.testing.assert_allclose(np.sort(poles.real), np.sort(lqr.assessment.poles[index].real), rtol=1e-6, atol=1e-6)


def test_open_loop_is_unstable_and_the_lower_gain_margin_finite(wind_tunnel_envelope):
    """The coupled plant flutters at every speed: losing enough gain in both actuators must lose stability."""
    plant, lqr = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    assert np.all(np.max(np.linalg.eigvals(plant.model.A).real, axis=-1) > 0)
    for cut, margins in zip(lqr.loop.inputs, lqr.assessment.margins, strict=True):
        down = margins.gain_margin_down_db
        opened = lqr.loop.cut(cut)
        for index in np.argwhere(np.isfinite(down)):
            i = tuple(index)
            ratio = 10.0 ** (down[i] / 20.0)
            growth = [
                np.max(np.linalg.eigvals(opened.closed(k * np.ones_like(down))[i]).real)
                for k in (ratio * (1 + 1e-6), ratio * (1 - 1e-6))
            ]
            assert growth[0] < 0 < growth[1]


def test_verdicts_say_where_the_worst_point_is(wind_tunnel_envelope):
    nf = wind_tunnel_envelope.controller("nf")
    asked = [v for v in nf.verdicts if v.spec.source == "request"]
    assert {v.spec.quantity for v in asked} == {
        "damping_ratio", "gain_margin", "phase_margin", "settling_time", "overshoot"
    }  # fmt: skip
    for verdict in asked:
        assert verdict.passed.all()
        distance = verdict.spec.distance(verdict.values)
        assert distance.flat[verdict.worst] == distance.min()
    assert {v.spec.quantity for v in nf.verdicts if v.spec.source == "limits"} == {
        "tab_deflection", "tab_rate", "tab_torque"
    }  # fmt: skip


def test_tab_only_controllers_warn_of_the_torque_at_trim(wind_tunnel_envelope, wind_tunnel_study):
    assert "aileron_torque_at_trim" in [w.code for w in wind_tunnel_envelope.warnings]
    floating = replace(wind_tunnel_study.trim, tab="zero_aileron_torque")
    found = run(replace(wind_tunnel_study, trim=floating, controllers=wind_tunnel_study.controllers[1:2])).warnings
    assert [w.code for w in found] == ["reduced_frequency"]


def test_points_outside_the_model_carry_nothing_and_lose_no_others(wind_tunnel_study):
    grid = GridRequest((0.0,), "mach", (0.1, 0.2, 1.2))
    envelope = run(replace(wind_tunnel_study, grid=grid))
    for controller in envelope.controllers:
        assert controller.outcomes.codes[0, 2] == Outcome.OUTSIDE_MODEL
        assert controller.outcomes.codes[0, 0] == Outcome.OK
        assert all(np.isnan(g.values[0, 2]) for g in controller.gains)
        assert np.isnan(controller.loop.K[0, 2]).all()
        assert np.isfinite(controller.loop.closed[0, 0]).all()


def test_gains_that_fail_their_specs_on_the_flown_loop_are_withdrawn(wind_tunnel_study, monkeypatch):
    """Were the search ever wrong, its gains would not leave: here it hands over gains ten times too high."""
    import schedules.run as room

    real = room.design_classical

    def wrong(*arguments):
        found = real(*arguments)
        right = [[True] * 3 + [False]] * 2
        return replace(
            found, gains=tuple(Gain(g.name, g.unit, np.where(right, g.values, 10.0 * g.values)) for g in found.gains)
        )

    monkeypatch.setattr(room, "design_classical", wrong)
    controller = run(replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[:1])).controllers[0]
    assert controller.outcomes.codes.tolist() == [["ok"] * 3 + ["not_certified"]] * 2
    assert "real part" in controller.outcomes.reasons[0, 3]
    assert all(np.isnan(g.values[:, 3]).all() and np.isfinite(g.values[:, :3]).all() for g in controller.gains)
    assert np.isnan(controller.loop.K[:, 3]).all()
    assert np.isnan(controller.assessment.poles[:, 3]).all()


def test_infeasible_everywhere(wind_tunnel_study):
    specs = (Spec("damping_ratio", "min", 0.5), Spec("gain_margin", "min", 6.0), Spec("phase_margin", "min", np.pi / 4))
    request = ClassicalController("pf", "positive_feedback", specs)
    controller = run(replace(wind_tunnel_study, controllers=(request,))).controllers[0]
    assert np.all(controller.outcomes.codes == Outcome.INFEASIBLE)
    assert controller.assessment is None
    assert controller.verdicts == ()


def test_weights_that_cannot_work_are_refused(wind_tunnel_study):
    lqr = wind_tunnel_study.controllers[2]
    R = np.diag([1.0, -1.0])
    bad = replace(lqr, weights=ExplicitWeights(np.eye(5), R, None))
    with pytest.raises(ControllerRefused, match="lqr: R") as error:
        run(replace(wind_tunnel_study, controllers=(bad,)))
    assert error.value.controller == "lqr"
    assert error.value.refused.matrix == "R"


def test_a_point_that_cannot_be_judged_is_withdrawn_alone(wind_tunnel_study, monkeypatch):
    import schedules.judging as room

    real = room.assess

    def fails_at_the_fastest(loop, *arguments, **options):
        if np.max(np.sum(np.abs(loop.A), axis=(-1, -2))) >= worst:
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return real(loop, *arguments, **options)

    study = replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[2:])
    worst = np.max(np.sum(np.abs(run(study).controllers[0].loop.A), axis=(-1, -2)))
    monkeypatch.setattr(room, "assess", fails_at_the_fastest)
    outcomes = run(study).controllers[0].outcomes
    assert np.sum(~outcomes.ok) == 1
    assert outcomes.codes[~outcomes.ok][0] == Outcome.NOT_CERTIFIED
    assert "did not converge" in outcomes.reasons[~outcomes.ok][0]


def test_the_same_study_gives_the_same_numbers(wind_tunnel_study, wind_tunnel_envelope):
    again = run(wind_tunnel_study)
    for one, other in zip(wind_tunnel_envelope.controllers, again.controllers, strict=True):
        for g, h in zip(one.gains, other.gains, strict=True):
            np.testing.assert_array_equal(g.values, h.values)


def test_points_that_only_fail_together_are_all_withdrawn(wind_tunnel_study, monkeypatch):
    import schedules.judging as room

    real = room.assess

    def fails_in_company(loop, *arguments, **options):
        if loop.A.ndim > 2:
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return real(loop, *arguments, **options)

    monkeypatch.setattr(room, "assess", fails_in_company)
    controller = run(replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[2:])).controllers[0]
    assert np.all(controller.outcomes.codes == Outcome.NOT_CERTIFIED)
    assert all(np.isnan(g.values).all() for g in controller.gains)
    assert np.isnan(controller.reduced_frequency).all()
