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
    for sense in _SENSES:
        field = field.removesuffix(sense)
    endings = [suffix for suffix in _SUFFIXES if field.endswith(suffix)]
    return _SUFFIXES[max(endings, key=len)] if endings else "1"


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
