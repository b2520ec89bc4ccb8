"""Numbers and names as people write them."""

from __future__ import annotations

from typing import Any

from service.wire.units import unit_of, without_unit

#: For what does not exist.
NONE = "—"
#: Units of the API that are written otherwise.
_WRITTEN = {"1": "", "kg m^2": "kg m²", "kg/m^3": "kg/m³", "deg/s^2": "deg/s²"}


def number(value: float | None) -> str:
    """Four significant digits; a dash for what does not exist."""
    return NONE if value is None else f"{value:.4g}"


def quantity(value: float | None, unit: str) -> str:
    """A number with its unit."""
    written = _WRITTEN.get(unit, unit)
    return number(value) if value is None or not written else f"{number(value)} {written}"


def unit_in(field: str) -> str:
    """The unit that a field's name ends in; nothing when it has none."""
    return _WRITTEN.get(unit_of(field), unit_of(field))


def words(field: str) -> str:
    """A field's name without its unit, in words."""
    return without_unit(field).replace("_", " ")


def place(point: int | None, axes: list[dict[str, Any]]) -> str:
    """A flat grid point by its coordinates."""
    if point is None:
        return NONE
    columns = len(axes[1]["values"])
    at = (point // columns, point % columns)
    spoken = [
        f"{words(axis['name'])} {axis['values'][i]:g} {unit_in(axis['name'])}" for axis, i in zip(axes, at, strict=True)
    ]
    return ", ".join(one.strip() for one in spoken)
