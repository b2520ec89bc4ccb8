"""The JSBSim system: loaded and flown by JSBSim where it is installed, its XML read in any case."""

import importlib.util
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from model.flight import GridAxis
from schedules.files import write_schedule
from schedules.fill import filled
from schedules.interpolate import interpolate
from schedules.wire_names import axis_name
from tests.schedules.hostile_schedules import NAMES, hostile, points_around

_LENGTHS = "".join(
    f'<{name} unit="{unit}">{value}</{name}>'
    for name, unit, value in [
        ("wingarea", "FT2", 100), ("wingspan", "FT", 30), ("chord", "FT", 4), ("htailarea", "FT2", 0),
        ("htailarm", "FT", 0), ("vtailarea", "FT2", 0), ("vtailarm", "FT", 0),
    ]
)  # fmt: skip
_AT = '<location name="{}" unit="IN"><x>0</x><y>0</y><z>0</z></location>'
AIRCRAFT = f"""<?xml version="1.0"?>
<fdm_config name="aircraft" version="2.0" release="ALPHA">
 <fileheader><author>x</author><filecreationdate>2020-01-01</filecreationdate><version>1</version></fileheader>
 <metrics>{_LENGTHS}{_AT.format("AERORP")}{_AT.format("EYEPOINT")}{_AT.format("VRP")}</metrics>
 <mass_balance><ixx unit="SLUG*FT2">100</ixx><iyy unit="SLUG*FT2">100</iyy><izz unit="SLUG*FT2">100</izz>
  <emptywt unit="LBS">1000</emptywt>{_AT.format("CG")}</mass_balance>
 <ground_reactions/><propulsion/><system file="schedule"/>
 <aerodynamics><axis name="LIFT"/></aerodynamics>
</fdm_config>
"""

#: Reads the work from standard input, writes the answers as the last line: JSBSim prints banners before.
FLOWN = """
import json, sys
import jsbsim
work = json.load(sys.stdin)
fdm = jsbsim.FGFDMExec(work["root"])
fdm.set_debug_level(0)
fdm.set_aircraft_path("aircraft")
fdm.load_model("aircraft")
rows = []
for point in work["points"]:
    for name, value in point.items():
        fdm[name] = value
    fdm.run_ic()
    rows.append([fdm[name] for name in work["read"]])
print(json.dumps(rows))
"""


@pytest.fixture
def jsbsim(tmp_path):
    """Fly an aircraft with the system: properties set at each point, properties read."""
    if importlib.util.find_spec("jsbsim") is None:
        if os.environ.get("CI", "").lower() in ("1", "true"):
            pytest.fail("jsbsim is not installed: under CI this test must run")
        pytest.skip("jsbsim is not installed: the system was not flown")
    systems = tmp_path / "aircraft" / "aircraft" / "Systems"
    systems.mkdir(parents=True)
    (systems.parent / "aircraft.xml").write_text(AIRCRAFT)

    def fly(content, points, read):
        (systems / "schedule.xml").write_bytes(content)
        work = json.dumps({"root": str(tmp_path), "points": points, "read": read})
        done = subprocess.run(
            [sys.executable, "-c", FLOWN], input=work, capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        return np.array(json.loads(done.stdout.splitlines()[-1]))

    return fly


def without_inputs(schedule, content):
    """The system with its axes as plain properties, to be set from outside."""
    text = content.decode("ascii")
    start, end = text.index(" <channel name="), text.index(" </channel>\n") + len(" </channel>\n")
    name = ET.fromstring(content).get("name")
    axes = "".join(f' <property value="0.0">gainfield/{name}/{axis_name(a)}</property>\n' for a in schedule.axes)
    return (text[:start] + axes + text[end:]).encode("ascii")


def flown_at(jsbsim, schedule, points, content):
    name = ET.fromstring(content).get("name")
    names = [f"gainfield/{name}/{axis_name(axis)}" for axis in schedule.axes]
    settings = [dict(zip(names, map(float, point), strict=True)) for point in points]
    read = [f"gainfield/{name}/{gain.name}" for gain in schedule.gains]
    return jsbsim(without_inputs(schedule, content), settings, read)


@pytest.mark.parametrize("shape", [(4, 6), (5,), (1, 6), (4, 1), (1, 1), (2, 3, 4), (3, 1, 2), (1, 2, 3), (3, 2, 1)])
def test_jsbsim_looks_up_what_the_schedule_interpolates(make_schedule, jsbsim, shape):
    schedule = make_schedule(shape)
    points = points_around(schedule)
    found = flown_at(jsbsim, schedule, points, write_schedule(schedule, "xml"))
    expected = interpolate(schedule, tuple(points.T))
    assert np.any(expected.clipped)
    for column, gain in zip(found.T, expected.gains, strict=True):
        np.testing.assert_allclose(column, gain.values, rtol=1e-12, atol=1e-13 * np.max(np.abs(gain.values)))


def test_hostile_texts_and_filled_points(make_schedule, jsbsim):
    schedule = hostile(make_schedule((3, 4), failed=[(1, 2)]))
    complete = filled(schedule, "nearest_ok")
    points = points_around(schedule)
    content = write_schedule(schedule, "xml", "nearest_ok")
    found = flown_at(jsbsim, schedule, points, content)
    expected = interpolate(complete.complete, tuple(points.T))
    for column, gain in zip(found.T, expected.gains, strict=True):
        np.testing.assert_allclose(column, gain.values, rtol=1e-12, atol=1e-12)
    mark = type(schedule.gains[0])("filled", "1", complete.filled.astype(float))
    marked = replace(complete.complete, gains=(mark,))
    weights = flown_at(jsbsim, marked, points, content)[:, 0]
    np.testing.assert_allclose(weights, interpolate(marked, tuple(points.T)).gains[0].values, atol=1e-14)
    assert 0 < np.count_nonzero(weights) < len(points)


FLIGHT_AXES = {
    "dynamic_pressure_pa": GridAxis("dynamic_pressure", "Pa", (500.0, 2000.0, 9000.0)),
    "airspeed_m_s": GridAxis("airspeed", "m/s", (30.0, 60.0, 120.0)),
    "mach": GridAxis("mach", "1", (0.1, 0.2, 0.4)),
}


@pytest.mark.parametrize("axis", FLIGHT_AXES)
def test_axes_are_worked_out_in_flight(make_schedule, jsbsim, axis):
    """Altitude, speed, Mach and dynamic pressure of the standard atmosphere, as this product has them."""
    from model.flight import flight_condition

    schedule = make_schedule((3, 3))
    schedule = replace(schedule, axes=(GridAxis("altitude", "m", (0.0, 3000.0, 9000.0)), FLIGHT_AXES[axis]))
    points = [(h, v) for h in (500.0, 4000.0, 10000.0) for v in (40.0, 100.0)]
    geometric = [6356766.0 * h / (6356766.0 - h) for h, _ in points]
    settings = [
        {"ic/h-sl-ft": h / 0.3048, "ic/vt-fps": v / 0.3048, "ic/gamma-deg": 0.0}
        for h, (_, v) in zip(geometric, points, strict=True)
    ]
    names = ["altitude_m", axis, *(gain.name for gain in schedule.gains)]
    found = jsbsim(write_schedule(schedule, "xml"), settings, [f"gainfield/main/{name}" for name in names])
    altitude, speed = np.array(points).T
    np.testing.assert_allclose(found[:, 0], altitude, rtol=1e-6)
    air = flight_condition(altitude, "airspeed", speed)
    expected = {"dynamic_pressure_pa": air.dynamic_pressure, "airspeed_m_s": speed, "mach": air.mach}[axis]
    np.testing.assert_allclose(found[:, 1], expected, rtol=2e-3)
    gains = interpolate(schedule, tuple(found[:, :2].T)).gains
    np.testing.assert_allclose(found[:, 2:], np.stack([g.values for g in gains], axis=-1), rtol=1e-12, atol=1e-12)


def test_the_xml_without_jsbsim(make_schedule):
    schedule = hostile(make_schedule((2, 3), failed=[(1, 2)]))
    content = write_schedule(schedule, "xml", "nearest_ok")
    assert content.isascii()
    system = ET.fromstring(content)
    assert (system.tag, system.get("name")) == ("system", "rate_loop_2")
    names = [f.get("name") for f in system.iter("fcs_function")]
    written = ["altitude_m", "dynamic_pressure_pa", *NAMES, "filled"]
    assert names == [f"gainfield/rate_loop_2/{name}" for name in written]
    (table,) = system.findall(".//fcs_function[@name='gainfield/rate_loop_2/L_dt_rate_da']//table")
    assert [v.get("lookup") for v in table.findall("independentVar")] == ["row", "column"]
    rows = [[float(x) for x in line.split()] for line in table.find("tableData").text.strip().splitlines()]
    assert rows[0] == list(schedule.axes[1].values)
    values = filled(schedule, "nearest_ok").complete.gains[1].values
    np.testing.assert_array_equal([row[0] for row in rows[1:]], schedule.axes[0].values)
    np.testing.assert_array_equal([row[1:] for row in rows[1:]], values)


def test_refuses_what_jsbsim_cannot_look_up(make_schedule):
    schedule = make_schedule((2, 3))
    axis = GridAxis("temperature", "K", schedule.axes[0].values)
    with pytest.raises(ValueError, match="JSBSim knows no temperature_k; it knows altitude_m"):
        write_schedule(replace(schedule, axes=(axis, schedule.axes[1])), "xml")
    four = (*make_schedule((2, 2, 2)).axes, GridAxis("airspeed", "m/s", (1.0, 2.0)))
    values = np.zeros((2, 2, 2, 2))
    gains = (replace(schedule.gains[0], values=values),)
    outcomes = type(schedule.outcomes).all_ok(values.shape)
    with pytest.raises(ValueError, match="at most 3 axes, this one 4"):
        write_schedule(replace(schedule, axes=four, gains=gains, outcomes=outcomes), "xml")
    with pytest.raises(ValueError, match="is no table"):
        write_schedule(make_schedule(()), "xml")
