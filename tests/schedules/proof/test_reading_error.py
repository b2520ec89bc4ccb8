"""The scheduling-signal error margin: what is proved of it is never contradicted, what is exact is really the edge."""

import numpy as np
import pytest

from schedules.proof.cells import cells
from schedules.proof.control_loops import control_loops
from schedules.proof.decay import slowest
from schedules.proof.family import family
from schedules.proof.flight_box import Flight
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.reading_error import LARGEST_ERROR, reading_margins, true_by_read
from schedules.study import GridRequest


@pytest.fixture(scope="module")
def margins(example_a):
    study, envelope = example_a
    return {
        name: reading_margins(prove(study, envelope.plant, envelope.controller(name), ProofRequest(decay=0.0)))
        for name in ("nf", "lqr")
    }


@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_the_envelopes_margin_is_the_least_of_its_cells(margins, name):
    found = margins[name]
    assert len(found.cells) == 3
    for quantity in ("proved", "low", "high"):
        assert getattr(found.envelope, quantity) == min(getattr(cell, quantity) for cell in found.cells)
    for cell in found.cells:
        assert 0.1 < cell.proved <= min(cell.low, cell.high) <= LARGEST_ERROR


@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_no_error_within_the_proved_margin_makes_a_loop_unstable(margins, example_a, loops_at, name):
    study, envelope = example_a
    e, rng = margins[name].envelope.proved, np.random.default_rng(0)
    h, s = rng.uniform(0.0, 3000.0, 20000), rng.uniform(245.0, 1531.25, 20000)
    read = s * (1.0 + rng.uniform(-e, e, 20000))
    assert np.min(slowest(loops_at(study, envelope, envelope.controller(name), h, s, read))) > 0.0


def test_the_exact_margin_is_the_edge(margins, example_a, loops_at):
    study, envelope = example_a
    for cell, margin in zip(cells(envelope.plant.grid.axes), margins["nf"].cells, strict=True):
        h, s = (x.ravel() for x in np.meshgrid(*(np.linspace(*e, 5) for e in (cell.box.altitude, cell.box.speed))))
        for error in (-margin.low, margin.high):
            if abs(error) == LARGEST_ERROR:
                continue

            def rate(e, h=h, s=s):
                return np.min(slowest(loops_at(study, envelope, envelope.controller("nf"), h, s, s * (1.0 + e))))

            assert rate(error * 1.002) <= 0.0 < rate(error * 0.998)


def test_a_clipped_table_bears_any_reading(envelope_of, only_lqr):
    """Of one breakpoint the gains are constant: no reading changes them."""
    study, envelope = envelope_of(grid=GridRequest((0.0, 1000.0), "dynamic_pressure", (600.0,)), controllers=only_lqr)
    found = reading_margins(prove(study, envelope.plant, envelope.controllers[0])).envelope
    assert (found.low, found.high) == (LARGEST_ERROR, LARGEST_ERROR)


@pytest.mark.parametrize("speed", [("airspeed", (20.0, 30.0, 45.0)), ("mach", (0.06, 0.09, 0.14))])
def test_other_speed_axes(envelope_of, only_lqr, loops_at, speed):
    study, envelope = envelope_of(grid=GridRequest((0.0, 3000.0), *speed), controllers=only_lqr)
    found = reading_margins(prove(study, envelope.plant, envelope.controllers[0])).envelope
    assert found.proved > 0.05
    rng = np.random.default_rng(1)
    h, s = rng.uniform(0.0, 3000.0, 5000), rng.uniform(speed[1][0], speed[1][-1], 5000)
    read = s * (1.0 + rng.uniform(-found.proved, found.proved, 5000))
    assert np.min(slowest(loops_at(study, envelope, envelope.controllers[0], h, s, read))) > 0.0


def test_an_unstable_schedule_bears_no_error(example_a, with_gains):
    study, envelope = example_a
    tables = {gain.name: -gain.values for gain in envelope.controller("lqr").gains}
    bad = with_gains(study, envelope, envelope.controller("lqr"), tables)
    found = reading_margins(prove(study, envelope.plant, bad, ProofRequest(most_pieces=1))).envelope
    assert (found.proved, found.low, found.high) == (0.0, 0.0, 0.0)


def test_compressibility_stops_the_proof_at_mach_one(airliner):
    study, envelope = airliner
    found = reading_margins(prove(study, envelope.plant, envelope.controllers[0]))
    assert all(np.isfinite([cell.proved, cell.low, cell.high]).all() for cell in found.cells)


def test_loops_that_cannot_be_taken_apart_have_no_margin(envelope_of, only_lqr, wind_tunnel_study):
    from dataclasses import replace

    virtual = replace(wind_tunnel_study.aerodynamics, virtual_inertia=True)
    study, envelope = envelope_of(controllers=only_lqr, aerodynamics=virtual)
    proof = prove(study, envelope.plant, envelope.controllers[0])
    with pytest.raises(ValueError, match="mass matrix"):
        reading_margins(proof)


def test_loops_of_every_error_lie_between_the_control_loops(example_a, loops_at, in_hull):
    """At random errors, the speed read inside the cell: the mixture is found by linear programming."""
    study, envelope = example_a
    designed, cell = envelope.controller("nf"), cells(envelope.plant.grid.axes)[1]
    made = family(study, envelope.plant, designed)
    flight = Flight(envelope.plant.system, "dynamic_pressure", 0.0)
    hull = control_loops(made, flight, cell.box, cell.corners(made.tables), true_by_read(0.3))
    rng = np.random.default_rng(0)
    h, read = (rng.uniform(*ends, 12) for ends in (cell.box.altitude, cell.box.speed))
    errors = np.append([0.3, -0.3], rng.uniform(-0.3, 0.3, 10))
    for loop in loops_at(study, envelope, designed, h, read / (1.0 + errors), read):
        assert in_hull(hull, loop)
    read[:] = cell.box.speed[1], *cell.box.speed[:1] * 11
    for error, k in ((-0.4, 0), (0.4, 1)):
        assert not in_hull(hull, loops_at(study, envelope, designed, h, read / (1.0 + error), read)[k])
