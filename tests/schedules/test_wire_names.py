import pytest

from model.flight import SPEED_UNITS, GridAxis
from schedules.wire_names import UNIT_SUFFIXES, axis_name, inner_name, wire_name


@pytest.mark.parametrize(
    ("name", "unit", "wire"),
    [
        ("altitude", "m", "altitude_m"),
        ("dynamic_pressure", "Pa", "dynamic_pressure_pa"),
        ("airspeed", "m/s", "airspeed_m_s"),
        ("mach", "1", "mach"),
        ("inertia", "kg m^2", "inertia_kg_m2"),
        ("tab_torque", "N m", "tab_torque_n_m"),
        ("rate", "deg/s", "rate_deg_s"),
    ],
)
def test_name_with_unit_and_back(name, unit, wire):
    assert wire_name(name, unit) == wire
    assert inner_name(wire, unit) == name
    assert axis_name(GridAxis(name, unit, (1.0,))) == wire


def test_every_axis_a_grid_may_have_has_a_name():
    names = {wire_name(name, unit) for name, unit in SPEED_UNITS.items()}
    assert names == {"dynamic_pressure_pa", "airspeed_m_s", "mach"}


def test_different_units_have_different_suffixes():
    assert len(set(UNIT_SUFFIXES.values())) == len(UNIT_SUFFIXES)


def test_refuses_an_unknown_unit_and_a_name_without_its_unit():
    with pytest.raises(ValueError, match="'ft' has no suffix"):
        wire_name("altitude", "ft")
    with pytest.raises(ValueError, match="does not end in '_m'"):
        inner_name("altitude_pa", "m")
    with pytest.raises(ValueError, match="does not end in '_m'"):
        inner_name("_m", "m")
