"""A study in parts: made anywhere, in any order, the same design to the last bit; wrong parts are refused."""

import json
import pickle
from dataclasses import asdict, replace

import numpy as np
import pytest

import schedules.part as room
from design.classical.controller import ClassicalController
from design.lqr.controller import LqrController
from design.lqr.measurement import KalmanMeasurement
from design.lqr.power_weights import PowerBalancedWeights, ReferenceStep
from design.lqr.weights import ExplicitWeights, WeightsRefused
from design.outcome import Outcome
from design.sampling import Sampling
from design.specs import Spec
from schedules.analysis import analyse
from schedules.designed import ControllerRefused
from schedules.exact_bytes import written
from schedules.parts import Part, Synthesised, parts, synthesise
from schedules.run import design, run
from schedules.study import GridRequest
from schedules.synthesised import PartDesign
from service.examples import example
from service.presenters.design import design_document
from service.schemas.requests import DesignRequest
from service.to_domain.study_of import study as study_of
from service.wire.answering import encode

#: More damping than the tab can give at any point, and only at some of them, the first ones among them.
IMPOSSIBLE = (Spec("damping_ratio", "min", 0.999),)
TIGHT = (Spec("damping_ratio", "min", np.linspace(0.99, 0.4, 8).reshape(2, 4)),)
KALMAN = KalmanMeasurement(0.01, 0.05, 2e-5, 2e-5)


@pytest.fixture
def blocks_of_three(monkeypatch):
    """Parts of three points: the grid of 2 x 4 is cut within its rows and across their ends."""
    monkeypatch.setattr(room, "POINTS", 3)
    monkeypatch.setattr(room, "DELAYED_POINTS", 3)


def _late(study, controllers, delay=0.002):
    tab, aileron = (replace(one, delay=delay) for one in (study.tab_actuator, study.aileron_actuator))
    return replace(study, tab_actuator=tab, aileron_actuator=aileron, controllers=controllers)


def _balanced(lqr):
    return PowerBalancedWeights(lqr.weights, 8.0, None, ReferenceStep(np.deg2rad(10.0), 1.0))


STUDIES = {
    "classical and lqr": lambda s: s,
    "none and some feasible": lambda s: replace(
        s,
        controllers=(
            replace(s.controllers[1], name="none", specs=IMPOSSIBLE),
            replace(s.controllers[1], name="some", specs=TIGHT),
        ),
    ),
    "sampled, with a delay": lambda s: _late(
        s, (replace(s.controllers[1], specs=(Spec("damping_ratio", "min", 0.3),), sampling=Sampling(0.004, 0.001)),)
    ),
    "a reference of limited rate": lambda s: replace(s, reference=replace(s.reference, rate_limit=1.0)),
    "smooth": lambda s: replace(s, controllers=(replace(s.controllers[0], smoothness=0.1),)),
    "lqr with delays": lambda s: _late(s, (replace(s.controllers[2], delay_states=2),)),
    "lqr of estimates with delays": lambda s: _late(
        s, (replace(s.controllers[2], delay_states=2, measurement=KALMAN),)
    ),
    "lqr too late": lambda s: _late(s, (s.controllers[2],), 0.02),
    "lqr of balanced powers": lambda s: replace(
        s, controllers=(replace(s.controllers[2], weights=_balanced(s.controllers[2])),)
    ),
    "sampled lqr of balanced powers": lambda s: replace(
        s,
        controllers=(replace(s.controllers[2], weights=_balanced(s.controllers[2]), sampling=Sampling(0.004, 0.0)),),
    ),
}
#: Points with gains, of studies in which that matters most.
PARTLY = {"classical and lqr": [8, 8, 8], "none and some feasible": [0, 4], "lqr too late": [0]}


def _bits(envelope):
    """All that a design holds, gains, loops, figures and certificates; and the document that is answered."""
    document = encode(design_document("an id", {}, "a time", envelope))
    return [document, *(written(PartDesign.of(controller)) for controller in envelope.controllers)]


@pytest.mark.parametrize("kind", STUDIES)
def test_made_elsewhere_is_the_same_to_the_last_bit(wind_tunnel_study, kind, blocks_of_three):
    study = STUDIES[kind](wind_tunnel_study)
    pieces = parts(study)
    assert len(pieces) >= 3
    kept = [synthesise(study, part).to_bytes() for part in pieces]
    for content, part in zip(kept, pieces, strict=True):
        assert Synthesised.from_bytes(content).part == part
        assert Synthesised.from_bytes(content).to_bytes() == content
    wanted = run(study)
    ok = [one.outcomes.ok.sum() for one in wanted.controllers]
    assert ok == PARTLY[kind] if kind in PARTLY else min(ok) > 0
    done = [Synthesised.from_bytes(content) for content in reversed(kept)]
    assert _bits(run(study, done)) == _bits(wanted)
    assert _bits(run(study, done[1:])) == _bits(wanted)


def test_nothing_is_searched_again(wind_tunnel_study, blocks_of_three, monkeypatch):
    import schedules.run as run_room

    study = STUDIES["smooth"](wind_tunnel_study)
    done = [synthesise(study, part) for part in parts(study)]
    monkeypatch.setattr(run_room, "design_classical", None)
    envelope = run(study, done)
    assert envelope.controllers[0].smoothed is not None
    with pytest.raises(TypeError):
        run(study, done[1:])


@pytest.mark.parametrize("kind", ["classical and lqr", "none and some feasible", "lqr with delays"])
def test_cutting_changes_no_more_than_last_bits(wind_tunnel_study, kind, blocks_of_three):
    """The grid designed at once, as for a controller that is not the study's own."""
    study = STUDIES[kind](wind_tunnel_study)
    plant = analyse(study)
    for cut in run(study).controllers:
        whole = design(study, plant, cut.request)
        assert cut.outcomes.codes.tolist() == whole.outcomes.codes.tolist()
        for one, other in zip(cut.gains, whole.gains, strict=True):
            np.testing.assert_allclose(one.values, other.values, rtol=1e-6)
        for one, other in zip(cut.verdicts, whole.verdicts, strict=True):
            np.testing.assert_allclose(one.values, other.values, rtol=1e-5, atol=1e-9)
            np.testing.assert_array_equal(one.passed, other.passed)
        if cut.infeasibility is not None:
            np.testing.assert_array_equal(cut.infeasibility != None, whole.infeasibility != None)  # noqa: E711


def _cheap(study):
    """Controllers that have no parts: gains that are given and vary, regulators as they run and of estimates."""
    lqr = study.controllers[2]
    gains = {"K_f": np.linspace(0.2, 0.4, 8).reshape(2, 4), "K_i": 2.0}
    return replace(
        study,
        controllers=(
            ClassicalController("given", "positive_feedback", gains=gains),
            lqr,
            replace(lqr, name="code", sampling=Sampling(0.004, 0.0)),
            replace(lqr, name="estimates", measurement=KALMAN),
        ),
    )


def test_a_large_grid_is_computed_block_by_block(wind_tunnel_study, monkeypatch):
    study = _cheap(wind_tunnel_study)
    assert parts(study) == ()
    whole = run(study)
    assert all(np.any(one.outcomes.ok) for one in whole.controllers)
    monkeypatch.setattr(room, "AT_ONCE", 3)
    assert parts(study) == ()
    for cut, wanted in zip(run(study).controllers, whole.controllers, strict=True):
        assert cut.outcomes.codes.tolist() == wanted.outcomes.codes.tolist()
        for one, other in zip(cut.gains, wanted.gains, strict=True):
            np.testing.assert_allclose(one.values, other.values, rtol=1e-12)
        assert [one.spec for one in cut.verdicts] == [one.spec for one in wanted.verdicts]
        for one, other in zip(cut.verdicts, wanted.verdicts, strict=True):
            np.testing.assert_allclose(one.values, other.values, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(cut.assessment.poles, wanted.assessment.poles, rtol=1e-9)


def test_no_more_points_are_judged_at_once_than_memory_holds(wind_tunnel_study, monkeypatch):
    import schedules.run as run_room

    seen = []
    judged = run_room.judged

    def counted(study, plant, *rest):
        seen.append(plant.outcomes.codes.size)
        return judged(study, plant, *rest)

    monkeypatch.setattr(run_room, "judged", counted)
    grid = GridRequest(tuple(np.linspace(0.0, 3000.0, 51)), "dynamic_pressure", tuple(np.linspace(245.0, 1500.0, 50)))
    run(replace(wind_tunnel_study, grid=grid, controllers=wind_tunnel_study.controllers[2:]))
    assert seen == [2500, 50]


def test_limits_and_gains_that_vary_over_the_grid_go_to_their_points(wind_tunnel_study, blocks_of_three):
    limit = np.linspace(0.35, 0.6, 8).reshape(2, 4)
    given = np.linspace(0.2, 0.5, 4)[None]  # the same at both altitudes
    request = ClassicalController(
        "pf", "positive_feedback", (Spec("damping_ratio", "min", limit),), gains={"K_f": given}
    )
    study = replace(wind_tunnel_study, controllers=(request,))
    found = run(study, [synthesise(study, part) for part in parts(study)]).controllers[0]
    assert found.outcomes.ok.any()
    for index in map(tuple, np.argwhere(found.outcomes.ok)):
        alone = replace(
            request,
            specs=(Spec("damping_ratio", "min", float(limit[index])),),
            gains={"K_f": float(given[0, index[1]])},
        )
        grid = replace(study.grid, altitude=study.grid.altitude[index[0] :][:1], speed=study.grid.speed[index[1] :][:1])
        single = run(replace(study, grid=grid, controllers=(alone,))).controllers[0]
        for one, other in zip(found.gains, single.gains, strict=True):
            np.testing.assert_allclose(one.values[index], other.values[0, 0], rtol=1e-6)
    np.testing.assert_allclose(
        found.gains[0].values[found.outcomes.ok], np.broadcast_to(given, (2, 4))[found.outcomes.ok]
    )


@pytest.mark.parametrize("controller", [0, 2])
def test_parts_without_any_point_inside_the_model(wind_tunnel_study, blocks_of_three, controller):
    request = wind_tunnel_study.controllers[controller]
    grid = GridRequest((0.0,), "mach", (1.05, 1.1, 1.2, 1.3, 1.4, 1.5))
    outside = replace(_late(wind_tunnel_study, (request,), 0.0005), grid=grid)
    assert not run(outside).controllers[0].outcomes.ok.any()
    mixed = replace(outside, grid=replace(grid, speed=(0.06, 0.08, 0.1, 1.1, 1.2, 1.3, 1.4)))
    found = run(mixed, [synthesise(mixed, part) for part in parts(mixed)]).controllers[0]
    assert found.outcomes.codes.tolist() == [[Outcome.OK] * 3 + [Outcome.OUTSIDE_MODEL] * 4]
    assert np.isnan(found.loop.K[0, 3:]).all()
    assert np.isnan(found.assessment.margins[0].gain_ratio[0, 3:]).all()
    alone = run(replace(mixed, grid=replace(grid, speed=(0.06, 0.08, 0.1)))).controllers[0]
    assert found.assessment.poles[:, :3].tobytes() == alone.assessment.poles.tobytes()


def test_what_is_cut_is_a_matter_of_the_study_alone(wind_tunnel_study):
    nf, pf, lqr = wind_tunnel_study.controllers
    given = ClassicalController("given", "positive_feedback", gains={"K_f": 0.3, "K_i": 2.0})
    grid = GridRequest(tuple(np.linspace(0.0, 3000.0, 5)), "dynamic_pressure", tuple(np.linspace(245.0, 1500.0, 12)))
    study = replace(wind_tunnel_study, grid=grid, controllers=(nf, given, lqr))
    assert parts(study) == (Part("nf", 0, 25), Part("nf", 25, 50), Part("nf", 50, 60))
    late = parts(_late(study, (lqr, replace(lqr, name="code", sampling=Sampling(0.01, 0.0)))))
    assert {part.controller for part in late} == {"lqr"}
    np.testing.assert_array_equal(np.concatenate([part.points for part in late]), np.arange(60))
    balanced = replace(lqr, weights=_balanced(lqr))
    assert len(parts(replace(study, controllers=(balanced, pf)))) == 6
    square = replace(grid, speed=grid.speed[:5])
    assert len(parts(replace(study, grid=square, controllers=(nf,)))) == 1


def test_a_part_goes_to_json_and_back():
    part = Part("nf", 25, 50)
    assert Part(**json.loads(json.dumps(asdict(part)))) == part
    assert len({part, Part("nf", 25, 50), Part("pf", 25, 50)}) == 2
    for wrong in ((3, 3), (4, 3), (-1, 3)):
        with pytest.raises(ValueError, match="a part begins"):
            Part("nf", *wrong)


def test_wrong_parts_are_refused(wind_tunnel_study, blocks_of_three):
    study = replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[1:])
    first, second, _ = (synthesise(study, part) for part in parts(study))
    with pytest.raises(ValueError, match="given twice"):
        run(study, [first, second, first])
    with pytest.raises(ValueError, match="not a part"):
        run(study, [replace(first, part=Part("nobody", 0, 3))])
    with pytest.raises(ValueError, match="not a part"):
        run(study, [replace(first, part=Part("pf", 1, 4))])
    with pytest.raises(ValueError, match="not a part"):
        run(study, [replace(first, part=Part("lqr", 0, 3))])
    with pytest.raises(ValueError, match="has 2 points"):
        replace(first, part=Part("pf", 0, 2))
    for part in (Part("nobody", 0, 3), Part("pf", 1, 4), Part("pf", 0, 8), Part("lqr", 0, 3)):
        with pytest.raises(ValueError, match="not a part"):
            synthesise(study, part)


@pytest.mark.parametrize(
    "other",
    [
        lambda s: replace(s, reference=replace(s.reference, aileron=0.1)),
        lambda s: replace(s, tab_actuator=replace(s.tab_actuator, delay=1e-3)),
        lambda s: replace(s, trim=replace(s.trim, alpha=0.01)),
        lambda s: replace(s, grid=replace(s.grid, speed=(246.0, *s.grid.speed[1:]))),
        lambda s: replace(s, aerodynamics=replace(s.aerodynamics, damping="quasi_steady")),
        lambda s: replace(s, controllers=(replace(s.controllers[0], specs=TIGHT),)),
        lambda s: replace(s, controllers=(replace(s.controllers[0], gains={"K_i": np.full((2, 4), 1.0)}),)),
    ],
)
def test_parts_of_another_study_are_refused(wind_tunnel_study, other):
    study = replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[1:2])
    done = [synthesise(study, part) for part in parts(study)]
    with pytest.raises(ValueError, match="another study"):
        run(other(study), done)


def test_parts_serve_a_study_that_differs_in_what_they_do_not_depend_on(wind_tunnel_study):
    study = replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[1:2])
    done = [synthesise(study, part) for part in parts(study)]
    wider = replace(wind_tunnel_study, name="another", spec_pack=())
    assert _bits(run(wider, done)) == _bits(run(wider))


def test_weights_that_work_nowhere_are_refused_cut_or_whole(wind_tunnel_study, blocks_of_three):
    lqr = wind_tunnel_study.controllers[2]
    blind = replace(lqr, delay_states=2, weights=ExplicitWeights(np.diag([1.0, 0.0, 1.0, 0.0, 0.0]), np.eye(2)))
    study = _late(wind_tunnel_study, (blind,))
    with pytest.raises(ControllerRefused) as whole:
        design(study, analyse(study), blind)
    done = [Synthesised.from_bytes(synthesise(study, part).to_bytes()) for part in parts(study)]
    for given in ([], done, done[1:]):
        with pytest.raises(ControllerRefused) as cut:
            run(study, given)
        assert str(cut.value) == str(whole.value)
        assert cut.value.refused.matrix == whole.value.refused.matrix == "Q"
        assert cut.value.refused.eigenvalue == whole.value.refused.eigenvalue
    assert all(np.all(one.design.outcomes.codes == Outcome.INFEASIBLE) for one in done)
    wrong = replace(blind, weights=ExplicitWeights(np.eye(5), np.diag([1.0, -1.0])))
    with pytest.raises(ControllerRefused, match="R is not positive definite"):
        synthesise(_late(wind_tunnel_study, (wrong,)), parts(study)[0])


def test_weights_that_fail_at_a_part_only_leave_the_others(wind_tunnel_study, blocks_of_three, monkeypatch):
    """Where the weights are blind at all points of one part, these are infeasible, each for a reason of its own."""
    import schedules.run as run_room
    from design.lqr.weights import WeightsRefused

    real = run_room.state_feedback

    def blind_below(study, plant, request):
        q = plant.grid.condition.dynamic_pressure[plant.outcomes.ok]
        if q.size and np.all(q < 1000.0):
            raise WeightsRefused("Q", 0j, f"no weight sees the mode at {q[0]:.0f}")
        return real(study, plant, request)

    monkeypatch.setattr(run_room, "state_feedback", blind_below)
    lqr: LqrController = wind_tunnel_study.controllers[2]
    found = run(_late(wind_tunnel_study, (replace(lqr, delay_states=2),))).controllers[0]
    assert found.outcomes.codes.ravel().tolist() == [Outcome.INFEASIBLE] * 3 + [Outcome.OK] * 5
    assert found.outcomes.reasons[0, 1] == "no weight sees the mode at 551"
    assert np.isnan(found.assessment.poles[0, :3]).all()
    assert np.isfinite(found.gains[0].values.ravel()[3:]).all()


@pytest.mark.parametrize("name", ["wind_tunnel", "wind_tunnel_23012", "airliner_aileron"])
def test_shipped_requests(name):
    study = study_of(DesignRequest.model_validate(example(name)))
    done = [Synthesised.from_bytes(synthesise(study, part).to_bytes()) for part in parts(study)]
    assert _bits(run(study, done)) == _bits(run(study))


def test_what_is_refused_comes_back_from_another_process() -> None:
    refused = ControllerRefused("lqr", WeightsRefused("Q", -1.0 + 0.0j, "negative"))
    again = pickle.loads(pickle.dumps(refused))
    assert (str(again), again.controller) == (str(refused), "lqr")
    assert (again.refused.matrix, again.refused.eigenvalue) == ("Q", -1.0 + 0.0j)
