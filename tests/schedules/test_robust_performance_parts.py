"""Cases flown some at a time: every cutting gives the same figures, to the last bit, and wrong pieces are refused."""

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest

import schedules.perturbed_cases as room
from design.specs import Spec
from schedules.flown_figures import FlownFigures
from schedules.perturbations import Uncertainty, corner_cases, drawn_cases
from schedules.perturbed_cases import FlownCases, case_blocks, fly_cases
from schedules.robust_performance import assemble, corners, flight_of, monte_carlo
from schedules.run import run
from tests.schedules.flown_cases import NF, given

OF_ALL = [Uncertainty(p, 0.3) for p in ("C_Ha_da", "C_Ha_dt", "C_Ht_da", "C_Ht_dt", "aileron_inertia", "tab_inertia")]
SPECS = (Spec("overshoot", "max", 0.2), Spec("phase_margin", "min", 0.3))
DRAWS = 43


@pytest.fixture(scope="module")
def study(wind_tunnel_study):
    return replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[2:])


@pytest.fixture(scope="module")
def envelope(study):
    return run(study)


@pytest.fixture(scope="module")
def designs(study, envelope):
    ok = np.ones(envelope.plant.grid.shape, dtype=bool)
    ok[0, 1] = False
    return {"nf": given(study, envelope.plant, NF, ok=ok), "lqr": envelope.controllers[0]}


@pytest.fixture(scope="module")
def late(study):
    """The state feedback with delays in both actuators: its loops share meshes."""
    tab, aileron = (replace(one, delay=1e-3) for one in (study.tab_actuator, study.aileron_actuator))
    found = replace(study, tab_actuator=tab, aileron_actuator=aileron)
    return found, run(found)


def _bits(figures):
    return {field.name: getattr(figures, field.name).tobytes() for field in fields(FlownFigures)}


def _cut(places, total):
    return list(pairwise([0, *places, total]))


@pytest.mark.parametrize("kind", ["nf", "lqr"])
@pytest.mark.parametrize("places", [(), (7, 14, 22, 42), tuple(range(1, DRAWS))])
def test_every_cutting_gives_the_same_bits(study, envelope, designs, kind, places, monkeypatch):
    """Specs are such that some of the cases hold and others do not."""
    monkeypatch.setattr(room, "LOOPS", 56)
    of = study, envelope.plant, designs[kind]
    wanted = monte_carlo(*of, OF_ALL, DRAWS, 4, SPECS)
    cases, flight = drawn_cases(OF_ALL, DRAWS, 4), flight_of(study, designs[kind], SPECS)
    assert len(case_blocks(designs[kind], cases)) > 5
    kept = [fly_cases(*of, cases, flight, *piece).to_bytes() for piece in reversed(_cut(places, DRAWS))]
    done = [FlownCases.from_bytes(content) for content in kept]
    assert [one.to_bytes() for one in done] == kept
    found = assemble(*of, cases, SPECS, flight, done)
    assert _bits(found.figures) == _bits(wanted.figures)
    assert _bits(found.nominal) == _bits(wanted.nominal)
    np.testing.assert_array_equal(found.held, wanted.held)
    assert 0.0 < np.mean(found.held[found.flown]) < 1.0
    assert np.isfinite(found.figures.phase_margin[found.figures.stable]).all()


def test_loops_with_delays_share_meshes_and_still_do_not_depend_on_the_cutting(late, monkeypatch):
    study, envelope = late
    monkeypatch.setattr(room, "DELAYED_LOOPS", 24)
    of = study, envelope.plant, envelope.controllers[0]
    cases, flight = drawn_cases(OF_ALL, 7, 1), flight_of(study, envelope.controllers[0])
    assert case_blocks(of[2], cases) == ((0, 3), (3, 6), (6, 7))
    wanted = monte_carlo(*of, OF_ALL, 7, 1)
    for places in ((), (1, 2, 3, 4, 5, 6)):
        done = [fly_cases(*of, cases, flight, *piece) for piece in _cut(places, 7)]
        assert _bits(assemble(*of, cases, (), flight, done).figures) == _bits(wanted.figures)


def test_corners_in_pieces(study, envelope, designs):
    of = study, envelope.plant, designs["lqr"]
    cases, flight = corner_cases(OF_ALL[:3]), flight_of(study, designs["lqr"], margins=True)
    wanted = corners(*of, OF_ALL[:3], margins=True)
    done = [fly_cases(*of, cases, flight, *piece) for piece in ((0, 3), (3, 8))]
    assert _bits(assemble(*of, cases, (), flight, done).figures) == _bits(wanted.figures)


def test_fewer_draws_are_the_first_of_more(study, envelope, designs, monkeypatch):
    """To the last bit but in the block that the shorter request ends in."""
    monkeypatch.setattr(room, "LOOPS", 80)
    of = study, envelope.plant, designs["lqr"]
    short, long = (monte_carlo(*of, OF_ALL, draws, 4).figures for draws in (35, 60))
    whole = slice(0, 30)
    assert _bits(short.take((..., whole))) == _bits(long.take((..., whole)))
    for name in (field.name for field in fields(FlownFigures)):
        np.testing.assert_allclose(getattr(short, name), getattr(long, name)[..., :35], rtol=1e-10, atol=1e-12)


def test_blocks_are_a_matter_of_the_request_alone(study, envelope, designs):
    cases = drawn_cases(OF_ALL, 2000, 0)
    assert case_blocks(designs["lqr"], cases) == ((0, 512), (512, 1024), (1024, 1536), (1536, 2000))
    assert case_blocks(designs["nf"], cases)[0] == (0, 4096 // 7)
    none = given(study, envelope.plant, NF, ok=np.zeros(envelope.plant.grid.shape, dtype=bool))
    of = study, envelope.plant, none
    found = assemble(*of, cases, (), (flight := flight_of(study, none)), [fly_cases(*of, cases, flight, 0, 2000)])
    assert not found.figures.stable.any()


def test_wrong_pieces_are_refused(study, envelope, designs):
    of = study, envelope.plant, designs["lqr"]
    cases, flight = drawn_cases(OF_ALL, 10, 4), flight_of(study, designs["lqr"], steps=False)
    one, two, three = (fly_cases(*of, cases, flight, *piece) for piece in ((0, 4), (4, 7), (7, 10)))
    for wrong in ([], [one, two], [two, three], [one, three], [one, two, two, three], [one, one, two, three]):
        with pytest.raises(ValueError, match="each once"):
            assemble(*of, cases, (), flight, wrong)
    others = [
        (drawn_cases(OF_ALL, 10, 5), flight, designs["lqr"], study),
        (cases, flight_of(study, designs["lqr"], steps=False, margins=True), designs["lqr"], study),
        (cases, flight, replace(designs["lqr"], gains=designs["lqr"].gains[:-1]), study),
        (cases, flight, designs["lqr"], replace(study, trim=replace(study.trim, alpha=0.01))),
    ]
    for of_cases, asked, designed, in_study in others:
        with pytest.raises(ValueError, match="flown for another"):
            assemble(in_study, envelope.plant, designed, of_cases, (), asked, [one, two, three])
    for start, stop in ((0, 0), (-1, 3), (3, 2), (0, 11), (10, 11)):
        with pytest.raises(ValueError, match="no cases"):
            fly_cases(*of, cases, flight, start, stop)
    with pytest.raises(ValueError, match="do not have figures"):
        replace(one, stop=5)
    with pytest.raises(ValueError, match="not flown cases"):
        FlownCases.from_bytes(room.written(one.figures))
    with pytest.raises(ValueError, match="damaged"):
        FlownCases.from_bytes(one.to_bytes()[:-1])


def test_too_many_loops_are_refused_however_they_are_cut(study, envelope, designs, late, monkeypatch):
    import schedules.flown_figures as figures_room

    monkeypatch.setattr(figures_room, "MOST_LOOPS", 79)
    monkeypatch.setattr(figures_room, "MOST_DELAYED_LOOPS", 15)
    cases = drawn_cases(OF_ALL, 10, 4)
    of, flight = (study, envelope.plant, designs["lqr"]), flight_of(study, designs["lqr"], steps=False)
    with pytest.raises(ValueError, match="80 loops are too many"):
        fly_cases(*of, cases, flight, 0, 1)
    delayed, slow = late
    with pytest.raises(ValueError, match="16 loops are too many"):
        fly_cases(delayed, slow.plant, slow.controllers[0], drawn_cases(OF_ALL, 2, 4), flight, 0, 1)
