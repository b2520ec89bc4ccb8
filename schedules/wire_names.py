"""Names with their unit, as the service and the files spell them: ``altitude`` in m is ``altitude_m``.

The one table of unit suffixes. Inside the product a quantity has a name and a unit side by side
(`model.flight.GridAxis`); wherever a number leaves it, the name ends in the unit.
"""

from __future__ import annotations

from model.flight import GridAxis

#: Unit as the product writes it -> ending of a name. A quantity without a unit has no ending.
UNIT_SUFFIXES: dict[str, str] = {
    "1": "",
    "m": "_m",
    "m/s": "_m_s",
    "kg": "_kg",
    "kg/m^3": "_kg_m3",
    "kg m^2": "_kg_m2",
    "Pa": "_pa",
    "Pa s": "_pa_s",
    "K": "_k",
    "N m": "_n_m",
    "rad/s": "_rad_s",
    "Hz": "_hz",
    "s": "_s",
    "1/s": "_1_s",
    "deg": "_deg",
    "deg/s": "_deg_s",
    "deg/s^2": "_deg_s2",
    "W": "_w",
    "J": "_j",
    "dB": "_db",
}


def wire_name(name: str, unit: str) -> str:
    """Name of a quantity outside the product: ``wire_name("airspeed", "m/s") == "airspeed_m_s"``.

    Raises
    ------
    ValueError : the unit is not one of `UNIT_SUFFIXES`
    """
    return name + _suffix(unit)


def inner_name(wire: str, unit: str) -> str:
    """Inverse of `wire_name`: ``inner_name("airspeed_m_s", "m/s") == "airspeed"``.

    Raises
    ------
    ValueError : the unit is unknown, or the name does not end in it, or nothing stands before it
    """
    suffix = _suffix(unit)
    name = wire.removesuffix(suffix)
    if name + suffix != wire or not name:
        raise ValueError(f"the name {wire!r} does not end in {suffix!r}, as its unit {unit!r} asks")
    return name


def axis_name(axis: GridAxis) -> str:
    """Name of a grid axis outside the product: ``altitude_m``, ``dynamic_pressure_pa``, ``mach``."""
    return wire_name(axis.name, axis.unit)


def _suffix(unit: str) -> str:
    try:
        return UNIT_SUFFIXES[unit]
    except KeyError:
        raise ValueError(f"unit {unit!r} has no suffix; there are {', '.join(UNIT_SUFFIXES)}") from None
