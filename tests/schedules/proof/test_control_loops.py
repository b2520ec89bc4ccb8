"""Boxes: what bounds the plant's terms in them, and the loops between which all loops of a box lie."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.atmosphere import standard_atmosphere
from schedules.interpolate import interpolate
from schedules.proof.cells import cells, corners_of_part, gains_at
from schedules.proof.control_loops import control_loops, control_sizes
from schedules.proof.family import family
from schedules.proof.flight_box import EXPONENTS, Box, Flight, power_controls
from schedules.schedule import GainSchedule
from schedules.study import GridRequest

positive = st.floats(1e-3, 1e6)


@given(positive, positive, st.floats(0.0, 1.0))
def test_chord_and_tangent_hold_the_root(one, other, part):
    low, high = sorted((one, other))
    below, above = power_controls(0.5, low, high)
    s = (1.0 - part) * low + part * high
    lower, upper = ((1.0 - part) * a + part * b for a, b in (below, above))
    assert lower <= np.sqrt(s) * (1.0 + 1e-12)
    assert upper >= np.sqrt(s) * (1.0 - 1e-12)


@given(positive, positive, st.floats(0.0, 1.0), st.sampled_from([0.0, 1.0, 2.0]))
def test_bernstein_coefficients_are_those_of_the_power(low, high, part, exponent):
    coefficients, same = power_controls(exponent, low, high)
    assert coefficients == same
    values = np.array(coefficients)
    while values.size > 1:  # de Casteljau
        values = (1.0 - part) * values[:-1] + part * values[1:]
    assert values[0] == pytest.approx(((1.0 - part) * low + part * high) ** exponent, rel=1e-12)


@pytest.mark.parametrize("axis", ["dynamic_pressure", "airspeed", "mach"])
@pytest.mark.parametrize("altitude", [(0.0, 3000.0), (9000.0, 22000.0), (-500.0, 300.0)])
@pytest.mark.parametrize("reading", [(1.0, 1.0), (0.8, 1.3)])
def test_factors_hold_every_term_of_a_box(airliner, axis, altitude, reading):
    """Terms at random conditions, divided by their power of the speed, lie within the products of the factors' ends."""
    _, envelope = airliner
    flight = Flight(envelope.plant.system, axis, -7.0)
    speed = {"dynamic_pressure": (800.0, 1100.0), "airspeed": (60.0, 110.0), "mach": (0.2, 0.35)}[axis]
    names, box = ("1", "Q", "D", "V"), Box(altitude, speed)
    factors = flight.factors(box, names, reading)
    rng = np.random.default_rng(3)
    h, read = (rng.uniform(*ends, 4000) for ends in (altitude, speed))
    h[:2], read[:2] = altitude, speed
    terms = flight.terms(h, read * rng.uniform(*reading, 4000), names)
    reached = []
    for k, name in enumerate(names):
        ratio = terms[:, k] / read ** EXPONENTS[axis][name]
        low, high = (
            np.prod([end for f in factors if name in f.terms for end in (f.low if k == 0 else f.high,)]) for k in (0, 1)
        )
        assert np.all(ratio >= low * (1.0 - 1e-12))
        assert np.all(ratio <= high * (1.0 + 1e-12))
        reached.append((np.max(ratio) - np.min(ratio)) / (high - low) if high > low else 1.0)
    assert min(reached) > 0.3  # the intervals are not idly wide


def test_density_is_monotone_within_layers():
    """What the intervals rest on: quantities of the air have their extremes at the ends or where layers meet."""
    for offset in (-30.0, 0.0, 30.0):
        for low, high in ((-2000.0, 0.0), (0.0, 11000.0), (11000.0, 20000.0), (20000.0, 32000.0)):
            air = standard_atmosphere(np.linspace(low, high, 400), offset)
            for values in (air.density, air.pressure, air.density * air.speed_of_sound):
                assert np.all(np.diff(values) < 0.0)
            assert np.unique(np.sign(np.round(np.diff(air.speed_of_sound), 12))).size == 1


@pytest.mark.parametrize("axis", ["dynamic_pressure", "airspeed", "mach"])
def test_real_loops_lie_in_the_hull_of_the_control_loops(
    envelope_of, only_lqr, wind_tunnel_study, loops_at, in_hull, axis
):
    speeds = {"dynamic_pressure": (245.0, 980.0), "airspeed": (20.0, 40.0), "mach": (0.06, 0.12)}[axis]
    aerodynamics = replace(wind_tunnel_study.aerodynamics, compressibility="prandtl_glauert")
    study, envelope = envelope_of(
        grid=GridRequest((0.0, 3000.0), axis, speeds), controllers=only_lqr, aerodynamics=aerodynamics
    )
    designed = envelope.controllers[0]
    made, cell = family(study, envelope.plant, designed), cells(envelope.plant.grid.axes)[0]
    flight = Flight(envelope.plant.system, axis, 0.0)
    hull = control_loops(made, flight, cell.box, cell.corners(made.tables))
    rng = np.random.default_rng(0)
    h, s = (rng.uniform(*ends, 12) for ends in (cell.box.altitude, cell.box.speed))
    h[:2], s[:2] = cell.box.altitude, cell.box.speed
    for loop in loops_at(study, envelope, designed, h, s):
        assert in_hull(hull, loop)
    assert not in_hull(hull, loops_at(study, envelope, designed, h[:1], 0.7 * s[:1])[0])


def test_a_part_of_a_cell_has_the_gains_of_the_cell(example_a):
    _, envelope = example_a
    cell = cells(envelope.plant.grid.axes)[1]
    table = np.stack([gain.values for gain in envelope.controller("lqr").gains], axis=-1)
    part = Box((700.0, 2900.0), (600.0, 601.0))
    at_corners = corners_of_part(cell.box, cell.corners(table), part)
    direct = gains_at(envelope.plant.grid.axes, table, np.array(part.altitude)[:, None], np.array(part.speed))
    np.testing.assert_allclose(at_corners, direct, rtol=1e-12)


@pytest.mark.parametrize("shape", [(2, 4), (1, 3), (3, 1), (1, 1)])
def test_gains_between_are_those_of_the_schedule(make_gains, shape):
    axes, schedule, tables = make_gains(shape)
    rng = np.random.default_rng(5)
    h, s = rng.uniform(-200.0, 3300.0, 300), rng.uniform(100.0, 1700.0, 300)
    found = interpolate(schedule, (h, s))
    expected = np.stack([gain.values for gain in found.gains], axis=-1)
    np.testing.assert_allclose(gains_at(axes, tables, h, s), expected, rtol=1e-12)


@pytest.fixture
def make_gains():
    from design.gains import Gain
    from design.outcome import Outcomes
    from model.flight import GridAxis
    from schedules.schedule import Provenance

    def make(shape):
        values = [np.linspace(0.0, 3000.0, shape[0]), np.linspace(245.0, 1531.0, shape[1])]
        axes = tuple(
            GridAxis(n, u, tuple(v.tolist())) for n, u, v in zip(("altitude", "q"), ("m", "Pa"), values, strict=True)
        )
        tables = np.random.default_rng(2).standard_normal((*shape, 3))
        gains = tuple(Gain(f"k{i}", "1", tables[..., i]) for i in range(3))
        origin = Provenance(design_id="", design_name="", request_digest="", version="", created_at="")
        return axes, GainSchedule("", "lqr", axes, gains, Outcomes.all_ok(shape), "", origin), tables

    return make


def test_sizes_are_those_of_the_parts(example_a):
    study, envelope = example_a
    made, cell = family(study, envelope.plant, envelope.controller("nf")), cells(envelope.plant.grid.axes)[0]
    flight = Flight(envelope.plant.system, "dynamic_pressure", 0.0)
    loops, sizes = (f(made, flight, cell.box, cell.corners(made.tables)) for f in (control_loops, control_sizes))
    assert loops.shape == sizes.shape == (8, 6, 6)
    assert np.all(sizes >= np.abs(loops) * (1.0 - 1e-15))
