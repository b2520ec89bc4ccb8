"""Lines and tables read between them."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.flight import GridAxis
from schedules.interpolate import interpolate
from schedules.refine.lines import Lines, read_between, uniform
from schedules.refine.study_on import study_on
from schedules.schedule import GainSchedule, Provenance

NOWHERE = Provenance(design_id="", design_name="", request_digest="", version="", created_at="")


def axis(least=1):
    return st.lists(st.integers(1, 400), min_size=least, max_size=5, unique=True).map(
        lambda values: tuple(sorted(float(value) for value in values))
    )


@given(axis(), axis(), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_tables_are_read_as_a_schedule_is(altitude, speed, parts, seed):
    lines, rng = Lines(altitude, speed), np.random.default_rng(seed)
    table, failed = rng.standard_normal(lines.shape), rng.uniform(size=lines.shape) < 0.2
    table[failed] = np.nan
    outcomes = Outcomes.all_ok(lines.shape).failing(failed, Outcome.INFEASIBLE, str)
    axes = (GridAxis("altitude", "m", altitude), GridAxis("dynamic_pressure", "Pa", speed))
    schedule = GainSchedule("", "lqr", axes, (Gain("K", "1", table),), outcomes, "", NOWHERE)
    mesh = lines.mesh(parts)
    expected = interpolate(schedule, np.meshgrid(mesh.altitude, mesh.speed, indexing="ij")).gains[0].values
    np.testing.assert_allclose(read_between(lines, table, mesh), expected, rtol=1e-12, atol=1e-12)
    both = read_between(lines, np.stack([table, 2.0 * table], axis=-1), mesh)
    np.testing.assert_allclose(both[..., 1], 2.0 * expected, rtol=1e-12, atol=1e-12)


@given(axis(), axis(), st.integers(1, 8))
def test_a_mesh_has_all_lines_and_equal_parts_between_them(altitude, speed, parts):
    lines = Lines(altitude, speed)
    mesh = lines.mesh(parts)
    for k in (0, 1):
        assert set(lines[k]) <= set(mesh[k])
        assert len(mesh[k]) == parts * (len(lines[k]) - 1) + 1
        assert mesh[k] == tuple(sorted(set(mesh[k])))


def test_lines_are_added_and_taken_away():
    lines = Lines((0.0, 3000.0), (1.0, 2.0, 4.0))
    assert lines.points == 6
    assert lines.interior() == [(1, 2.0)]
    assert lines.added(0, 100.0).altitude == (0.0, 100.0, 3000.0)
    assert lines.added(1, 3.0).without(1, 3.0) == lines
    assert uniform(lines, (3, 4)) == Lines((0.0, 1500.0, 3000.0), (1.0, 2.0, 3.0, 4.0))
    assert uniform(Lines((5.0,), (1.0, 2.0)), (1, 2)).altitude == (5.0,)


def test_what_is_given_point_by_point_is_read_on_other_lines(wind_tunnel_study):
    grid = wind_tunnel_study.grid
    ramp = np.add.outer(np.asarray(grid.altitude) / 3000.0, np.asarray(grid.speed) / 1000.0)
    nf = wind_tunnel_study.controllers[0]
    varied = replace(nf, specs=(replace(nf.specs[0], limit=ramp), *nf.specs[1:]), gains={"K_i": ramp, "K_p": 1.0})
    other = study_on(wind_tunnel_study, varied, Lines((750.0,), (300.0, 900.0)))
    (request,) = other.controllers
    np.testing.assert_allclose(request.specs[0].limit, [[0.55, 1.15]], rtol=1e-12)
    np.testing.assert_allclose(request.gains["K_i"], [[0.55, 1.15]], rtol=1e-12)
    assert request.gains["K_p"] == 1.0
    assert request.specs[1] == nf.specs[1]
    assert other.grid.speed == (300.0, 900.0)
