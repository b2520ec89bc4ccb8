"""Units of the wire, read off the end of a field's name: ``chord_m`` is in m, ``peak_rate_deg_s`` in deg/s."""

from __future__ import annotations

from typing import Any

from schedules.wire_names import UNIT_SUFFIXES

#: Endings that do not belong to the unit: ``settling_time_s_max`` is in s.
_SENSES = ("_min", "_max")
#: Percent is a unit on the wire only.
_SUFFIXES = {suffix: unit for unit, suffix in UNIT_SUFFIXES.items() if suffix} | {"_percent": "%"}


def unit_of(field: str) -> str:
    """Unit that the name of a numeric field ends in; ``1`` when it ends in none."""
    return _SUFFIXES.get(_ending(field), "1")


def without_unit(field: str) -> str:
    """The same name without its unit; a sense stays: ``settling_time_s_max`` becomes ``settling_time_max``."""
    sense = _sense(field)
    return field.removesuffix(sense).removesuffix(_ending(field)) + sense


def _sense(field: str) -> str:
    return next((sense for sense in _SENSES if field.endswith(sense)), "")


def _ending(field: str) -> str:
    """The suffix that tells the unit; nothing when there is none."""
    field = field.removesuffix(_sense(field))
    return max((suffix for suffix in _SUFFIXES if field.endswith(suffix)), key=len, default="")


def state_units(schema: dict[str, Any]) -> None:
    """Write into the JSON schema of an object the ``unit`` of each numeric property that names none."""
    for name, node in schema.get("properties", {}).items():
        if _is_number(node):
            node.setdefault("unit", unit_of(name))


def _is_number(node: dict[str, Any]) -> bool:
    """Whether values of this schema, or what their arrays hold in the end, are numbers with a fraction."""
    if node.get("type") == "array":
        return _is_number(node.get("items", {}))
    branches = node.get("anyOf", []) + node.get("oneOf", [])
    return node.get("type") == "number" or any(_is_number(branch) for branch in branches)
