"""Values that are one number, or vary over the grid: along one of its axes, or in its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

from pydantic import Field, Tag

from service.schemas.flight import Axis, Grid, Span
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.wire import Request, refusal

AxisName = Literal["altitude_m", "dynamic_pressure_pa", "airspeed_m_s", "mach"]

N = TypeVar("N")
V = TypeVar("V")
Part = TypeVar("Part", bound=Request)

Row = Annotated[list[N], Field(fail_fast=True, min_length=1, max_length=10_000), Tag("array")]
#: One number a breakpoint, or one row a breakpoint of the first axis.
Values = Annotated[
    list[Annotated[Annotated[N, Tag("number")] | Row[N], BY_JSON_TYPE]],
    Field(fail_fast=True, min_length=1, max_length=10_000),
]
#: One number N everywhere, or V, an `OverGrid` of such numbers.
Varying = Annotated[Annotated[N, Tag("number")] | Annotated[V, Tag("object")], BY_JSON_TYPE]


class OverGrid(Request):
    """Values over the grid. Each kind of number has its own class, which gives `values` their range and unit."""

    axis: AxisName | None = Field(
        default=None,
        description="Axis of the grid that the value varies along, staying the same along the other; null: `values` "
        "are in the grid's shape",
    )
    values: list[float | list[float]]


@dataclass(frozen=True)
class GridAxes:
    """Wire names of the grid's two axes, and how many breakpoints each has."""

    names: tuple[str, str]
    counts: tuple[int, int]

    @classmethod
    def of(cls, grid: Grid) -> GridAxes:
        """Axes of a grid of a request."""
        name, speed = grid.speed_axis
        return cls(("altitude_m", name), (_count(grid.altitude_m), _count(speed)))


def _count(axis: Axis) -> int:
    return axis.count if isinstance(axis, Span) else len(axis)


def fields_on_grid(part: Part, axes: GridAxes, at: str) -> Part:
    """A part of a request with each of its values over the grid in its simplest form (`on_grid`).

    Parameters
    ----------
    at : where the part stands, as a pointer that names the branches of unions too
    """
    found = {name: on_grid(value, axes, f"{at}/{name}/object") for name, value in part if isinstance(value, OverGrid)}
    return part.model_copy(update=found) if found else part


def on_grid(value: OverGrid, axes: GridAxes, at: str) -> float | OverGrid:
    """The value in its simplest form, so that all its spellings are one request; refused unless it fits the grid.

    A value that is the same everywhere is one number, one that varies along a single axis has one number a
    breakpoint.
    """
    columns: list[tuple[float, ...]] = list(zip(*_rows(value, axes, at), strict=True))
    same_along_first = all(len(set(column)) == 1 for column in columns)
    same_along_second = len(set(columns)) == 1
    if same_along_first and same_along_second:
        return columns[0][0]
    if same_along_first:
        return value.model_copy(update={"axis": axes.names[1], "values": [column[0] for column in columns]})
    if same_along_second:
        return value.model_copy(update={"axis": axes.names[0], "values": list(columns[0])})
    return value


def _rows(value: OverGrid, axes: GridAxes, at: str) -> list[list[float]]:
    """The value at every point of the grid, a row for each breakpoint of the first axis."""
    rows, columns = axes.counts
    if value.axis is None:
        return _in_shape(value.values, axes, at)
    along = _along_axis(value, axes, at)
    return [[number] * columns for number in along] if value.axis == axes.names[0] else [along] * rows


def _along_axis(value: OverGrid, axes: GridAxes, at: str) -> list[float]:
    if value.axis not in axes.names:
        raise refusal(f"the grid has no axis {value.axis}", f"one of {', '.join(axes.names)}, or null", f"{at}/axis")
    count = axes.counts[axes.names.index(value.axis)]
    numbers = [number for number in value.values if isinstance(number, float)]
    if len(numbers) < len(value.values):
        raise refusal("with an axis, values are one number a breakpoint", f"a list of {count} numbers", f"{at}/values")
    if len(numbers) != count:
        detail = f"{len(numbers)} values along {value.axis}, which has {count} breakpoints"
        raise refusal(detail, f"a list of {count} numbers", f"{at}/values")
    return numbers


def _in_shape(values: list[float | list[float]], axes: GridAxes, at: str) -> list[list[float]]:
    rows, columns = axes.counts
    allowed = f"{rows} lists of {columns} numbers, by {' and '.join(axes.names)}; or a list along an axis that is named"
    found = [row for row in values if isinstance(row, list)]
    if len(found) < len(values):
        raise refusal("without an axis, values are in the grid's shape, a list a row", allowed, f"{at}/values")
    if len(found) != rows:
        raise refusal(f"{len(found)} rows of values on a grid of {rows} by {columns} points", allowed, f"{at}/values")
    for place, row in enumerate(found):
        if len(row) != columns:
            detail = f"{len(row)} values in a row on a grid of {rows} by {columns} points"
            raise refusal(detail, f"a list of {columns} numbers", f"{at}/values/{place}")
    return found
