"""Tables of gains from anywhere: the loop that they fly is the product's, on the axes of the table."""

from dataclasses import replace

import numpy as np
import pytest

from design.classical.tab_loop import tab_loop
from design.lqr.flown import flown_loop
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.outcome import Outcome, Outcomes
from design.sampling import Sampling
from model.flight import GridAxis
from schedules.analysis import analyse
from schedules.interpolate import interpolate
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.result import CellStatus
from schedules.run import run
from schedules.schedule import Provenance
from schedules.schedule_of import schedule_of
from schedules.uploaded_schedule import gain_units, needed_gains, on_axes, state_feedback_of, uploaded_schedule

NOWHERE = Provenance(design_id="", design_name="", request_digest="", version="", created_at="")
NAMES = ("nf", "pf", "lqr")


def table_of(designed):
    return {gain.name: gain.values.copy() for gain in designed.gains}


def finer(envelope, designed):
    """Axes with a line more each, and the same schedule read off there."""
    altitude, speed = envelope.plant.grid.axes
    axes = (
        replace(altitude, values=(0.0, 1000.0, 3000.0)),
        replace(speed, values=(245.0, 400.0, 551.25, 980.0, 1531.25)),
    )
    coordinates = np.meshgrid(*(np.array(axis.values) for axis in axes), indexing="ij")
    found = interpolate(schedule_of(envelope, designed, NOWHERE), coordinates)
    return axes, {gain.name: gain.values for gain in found.gains}


@pytest.mark.parametrize("name", NAMES)
def test_a_designs_own_table_is_the_design(wind_tunnel_study, wind_tunnel_envelope, name):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller(name)
    again = uploaded_schedule(wind_tunnel_study, plant, designed.request, table_of(designed), designed.outcomes)
    assert [(g.name, g.unit) for g in again.gains] == [(g.name, g.unit) for g in designed.gains]
    assert gain_units(wind_tunnel_study, plant.model.states, designed.request) == {
        g.name: g.unit for g in designed.gains
    }
    for array in ("A", "B", "K", "N", "closed"):
        np.testing.assert_array_equal(getattr(again.loop, array), getattr(designed.loop, array))
    first, second = (prove(wind_tunnel_study, plant, one) for one in (designed, again))
    assert [(c.status, c.alpha) for c in first.cells] == [(c.status, c.alpha) for c in second.cells]


@pytest.mark.parametrize("name", NAMES)
def test_on_other_axes_the_plant_is_that_of_the_axes(wind_tunnel_study, wind_tunnel_envelope, name):
    """A finer table of the same schedule: the loops are assembled from models that know nothing of the first grid."""
    designed = wind_tunnel_envelope.controller(name)
    axes, table = finer(wind_tunnel_envelope, designed)
    study = on_axes(wind_tunnel_study, axes)
    plant = analyse(study)
    assert plant.grid.axes == axes
    flown = uploaded_schedule(study, plant, designed.request, table)
    if name == "lqr":
        structure = designed.request.structure(study.tab_actuator, study.aileron_actuator)
        K, N = (
            np.stack([np.stack([table[f"{s}_{u}_{x}"] for x in xs], axis=-1) for u in ("T_t", "T_a")], axis=-2)
            for s, xs in (("K", structure.states(plant.model.states)), ("N", structure.references))
        )
        expected = flown_loop(plant.model, structure, K, N)
    else:
        expected = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, designed.request, table)
    np.testing.assert_array_equal(flown.loop.closed, expected.closed)
    # With the same gains everywhere, a finer grid loses no proof that its parent has at this rate.
    whole = prove(wind_tunnel_study, wind_tunnel_envelope.plant, designed, ProofRequest(decay=1.0))
    assert whole.proved
    assert prove(study, plant, flown, ProofRequest(decay=1.0)).proved


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("nf", "K_d"),
        ("nf", "K_p"),
        ("nf", "K_i"),
        ("pf", "K_f"),
        ("pf", "K_i"),
        ("lqr", "K_T_t_dt"),
        ("lqr", "K_T_a_da_rate"),
        ("lqr", "K_T_a_int_a"),
    ],
)
def test_a_gain_beyond_its_slack_is_refuted_where_the_loop_is_really_unstable(
    wind_tunnel_study, wind_tunnel_envelope, name, changed
):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller(name)
    table = table_of(designed)
    table[changed][1, 1] *= -60.0 if name == "lqr" else 60.0
    flown = uploaded_schedule(wind_tunnel_study, plant, designed.request, table)
    assert flown.outcomes.ok.all(), "nothing is withdrawn: the gains are what is judged"
    proof = prove(wind_tunnel_study, plant, flown, ProofRequest(decay=0.0))
    assert [cell.status is CellStatus.REFUTED for cell in proof.cells] == [True, True, False]
    # The point is in the cell, and a plant made there with the gains read there is as unstable as it says.
    point = proof.cells[0].slowest
    axes = tuple(
        GridAxis(axis.name, axis.unit, (value,))
        for axis, value in zip(plant.grid.axes, (point.altitude, point.speed), strict=True)
    )
    read = interpolate(schedule_of(wind_tunnel_envelope, flown, NOWHERE), (point.altitude, point.speed))
    there = on_axes(wind_tunnel_study, axes)
    alone = uploaded_schedule(
        there, analyse(there), designed.request, {g.name: g.values.reshape(1, 1) for g in read.gains}
    )
    worst = np.max(np.linalg.eigvals(alone.loop.closed).real)
    assert worst > 0.0
    assert worst == pytest.approx(point.eigenvalue.real, rel=1e-6)


def test_feed_forward_may_be_left_out(wind_tunnel_study, wind_tunnel_envelope):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    table = {name: values for name, values in table_of(designed).items() if not name.startswith("N_")}
    assert tuple(table) == needed_gains(gain_units(wind_tunnel_study, plant.model.states, designed.request))
    flown = uploaded_schedule(wind_tunnel_study, plant, designed.request, table)
    assert not np.any(flown.loop.N)
    assert prove(wind_tunnel_study, plant, flown).summary == prove(wind_tunnel_study, plant, designed).summary


def test_no_weights_are_needed(wind_tunnel_study, wind_tunnel_envelope):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    request = state_feedback_of("mine", "aileron")
    flown = uploaded_schedule(wind_tunnel_study, plant, request, table_of(designed))
    np.testing.assert_array_equal(flown.loop.closed, designed.loop.closed)
    with pytest.raises(ValueError, match=r"Q|R"):
        run(replace(wind_tunnel_study, controllers=(request,)))


def test_filtered_rates_are_flown(wind_tunnel_study, wind_tunnel_envelope):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    request = replace(designed.request, measurement=RateFilters(1200.0))
    own = run(replace(wind_tunnel_study, controllers=(request,))).controllers[0]
    flown = uploaded_schedule(
        wind_tunnel_study, plant, state_feedback_of("f", "aileron", RateFilters(1200.0)), table_of(own)
    )
    np.testing.assert_array_equal(flown.loop.closed, own.loop.closed)
    assert flown.loop.closed.shape[-1] > designed.loop.closed.shape[-1]


def test_points_without_gains(wind_tunnel_study, wind_tunnel_envelope):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("nf")
    table = table_of(designed)
    for values in table.values():
        values[0, 3] = np.nan
    flown = uploaded_schedule(wind_tunnel_study, plant, designed.request, table)
    assert flown.outcomes.codes[0, 3] == Outcome.EXCLUDED
    proof = prove(wind_tunnel_study, plant, flown)
    assert [c.status for c in proof.cells] == ["proved", "proved", "undecided"]
    assert proof.cells[2].reason == "grid point [0, 3] is excluded: the table has no gains there"
    said = Outcomes.all_ok((2, 4)).failing(
        np.arange(8).reshape(2, 4) == 3, Outcome.INFEASIBLE, lambda index: "overshoot 40 %"
    )
    flown = uploaded_schedule(wind_tunnel_study, plant, designed.request, table, said)
    assert "infeasible: overshoot 40 %" in prove(wind_tunnel_study, plant, flown).cells[2].reason
    nothing = {name: np.full((2, 4), np.nan) for name in table}
    proof = prove(wind_tunnel_study, plant, uploaded_schedule(wind_tunnel_study, plant, designed.request, nothing))
    assert {c.status for c in proof.cells} == {CellStatus.UNDECIDED}


def test_loops_with_delays_are_judged_at_their_points(wind_tunnel_study):
    """They cannot be proved or sampled: a table that is not stable must not pass for one that merely was not proved."""
    late = replace(
        wind_tunnel_study,
        tab_actuator=replace(wind_tunnel_study.tab_actuator, delay=0.002),
        controllers=wind_tunnel_study.controllers[:1],
    )
    envelope = run(late)
    designed = envelope.controllers[0]
    table = table_of(designed)
    good = uploaded_schedule(late, envelope.plant, designed.request, table)
    assert {c.status for c in prove(late, envelope.plant, good).cells} == {CellStatus.SAMPLED}
    table["K_p"][1, 0] *= 50.0
    bad = uploaded_schedule(late, envelope.plant, designed.request, table)
    assert bad.outcomes.codes[1, 0] == Outcome.NOT_CERTIFIED
    cells = prove(late, envelope.plant, bad).cells
    assert [c.status for c in cells] == ["undecided", "sampled", "sampled"]
    assert "grid point [1, 0] is not_certified" in cells[0].reason
    digital = replace(designed.request, sampling=Sampling(0.003, 0.001))
    flown = uploaded_schedule(wind_tunnel_study, analyse(wind_tunnel_study), digital, table_of(designed))
    assert flown.outcomes.ok.all()
    assert flown.loop.delay == pytest.approx((0.0025,))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.pop("K_p"), "no gain K_p"),
        (lambda t: t.update(K_x=t["K_p"]), "no gain K_x; it has K_d, K_p, K_i"),
        (lambda t: t.update(K_p=t["K_p"][:1]), r"K_p has shape \(1, 4\), the grid has \(2, 4\)"),
        (lambda t: t.update(K_p=np.full((2, 4), np.inf)), "K_p is infinite"),
        (lambda t: t.update(K_p=-t["K_p"]), "K_p must be at least 0"),
    ],
)
def test_tables_that_do_not_fit(wind_tunnel_study, wind_tunnel_envelope, change, words):
    designed = wind_tunnel_envelope.controller("nf")
    table = table_of(designed)
    change(table)
    with pytest.raises(ValueError, match=words):
        uploaded_schedule(wind_tunnel_study, wind_tunnel_envelope.plant, designed.request, table)


def test_controllers_and_axes_that_are_refused(wind_tunnel_study, wind_tunnel_envelope):
    plant, designed = wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr")
    kalman = KalmanMeasurement(1e-3, 1e-3, 1e-5, 1e-5)
    for request in (
        replace(designed.request, sampling=Sampling(0.01, 0.01)),
        replace(designed.request, measurement=kalman),
    ):
        with pytest.raises(ValueError, match="only gains of continuous feedback"):
            uploaded_schedule(wind_tunnel_study, plant, request, table_of(designed))
    altitude, speed = plant.grid.axes
    for axes in ((speed, altitude), (altitude, altitude), (altitude, replace(speed, name="warmth"))):
        with pytest.raises(ValueError, match="axes are altitude and one of"):
            on_axes(wind_tunnel_study, axes)
