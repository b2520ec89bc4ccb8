"""The schedule as CSV, long form: one row a grid point, the last axis varying fastest.

Columns: the axes with their unit in the name, ``outcome``, then every gain. A cell is empty where the
point carries no gain: a reader must be told that empty means missing, not zero. The lines
before the column names begin with ``#`` and hold ``name: value`` with the value as JSON; ``header_lines``
among them counts them, for readers that skip lines by number. Why a point failed stands there too (``reason``
with the point's index from 0), because free text in a cell breaks the simpler readers.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.files.header import header, object_array, require_format, schedule_from, units
from schedules.files.proof_words import proof_members
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name, inner_name

_REASON = "reason "


def write_csv(schedule: GainSchedule) -> bytes:
    """The schedule as comma-separated values in ASCII, lines ending in a line feed.

    Numbers are the shortest that read back to the same double.
    """
    names = [axis_name(a) for a in schedule.axes] + ["outcome"] + [g.name for g in schedule.gains]
    lines = [*_comments(schedule), ",".join(names), *_rows(schedule)]
    return ("\n".join(lines) + "\n").encode("ascii")


def read_csv(content: bytes) -> GainSchedule:
    """The schedule of a file that `write_csv` wrote, its comment lines included.

    Raises
    ------
    ValueError : not such a file, another schema version, rows that are not the whole grid in order,
        or a cell that is no number
    """
    text = content.decode("utf-8-sig").splitlines()
    words, reasons = _read_comments([line for line in text if line.startswith("#")])
    require_format(words)
    table = _read_table([line for line in text if line and not line.startswith("#")])
    unit = _units_of(table, words.get("units"))
    axes = tuple(_axis(name, unit[name], table.column(name)) for name in table.axes)
    shape = tuple(len(axis.values) for axis in axes)
    _require_whole_grid(table, axes, shape)
    gains = tuple(Gain(name, unit[name], table.column(name).reshape(shape)) for name in table.gains)
    codes = object_array([Outcome(cell) for cell in table.cells["outcome"]], shape)
    return schedule_from(words, axes, gains, Outcomes(codes, _reason_array(reasons, shape)))


def _comments(schedule: GainSchedule) -> list[str]:
    failed = (tuple(i) for i in np.argwhere(schedule.outcomes.codes != Outcome.OK).tolist())
    reasons = [(i, schedule.outcomes.reasons[i]) for i in failed]
    values: dict[str, Any] = {**header(schedule), **proof_members(schedule), "units": units(schedule)}
    lines = [f"# {name}: {json.dumps(value)}" for name, value in values.items()]
    lines += [f"# {_REASON}{json.dumps(i)}: {json.dumps(why)}" for i, why in reasons if why is not None]
    # The count includes the line that holds it.
    return [lines[0], f"# header_lines: {len(lines) + 1}", *lines[1:]]


def _rows(schedule: GainSchedule) -> Iterator[str]:
    points = product(*([repr(float(x)) for x in axis.values] for axis in schedule.axes))
    columns = [[_cell(x) for x in gain.values.ravel().tolist()] for gain in schedule.gains]
    for n, (point, outcome) in enumerate(zip(points, schedule.outcomes.codes.ravel(), strict=True)):
        yield ",".join([*point, str(outcome), *(column[n] for column in columns)])


def _cell(value: float) -> str:
    return "" if np.isnan(value) else repr(value)


@dataclass(frozen=True)
class _Table:
    """The cells by column; names of the axes and of the gains, which stand left and right of ``outcome``."""

    axes: list[str]
    gains: list[str]
    cells: dict[str, list[str]]

    def column(self, name: str) -> FloatArray:
        """Numbers of a column, one a row; nan for an empty cell."""
        try:
            return np.array([float(cell) if cell else np.nan for cell in self.cells[name]])
        except ValueError as error:
            raise ValueError(f"column {name}: {error}") from None


def _read_comments(lines: list[str]) -> tuple[dict[str, Any], dict[tuple[int, ...], str]]:
    words: dict[str, Any] = {}
    reasons: dict[tuple[int, ...], str] = {}
    for line in lines:
        name, _, value = line.removeprefix("#").strip().partition(": ")
        if name.startswith(_REASON):
            why = _json(value)
            if not isinstance(why, str):
                raise ValueError(f"a reason is text, not {value[:80]!r}")
            reasons[_point(_json(name.removeprefix(_REASON)))] = why
        else:
            words[name] = _json(value)
    return words, reasons


def _json(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError(f"a comment line of a schedule file holds JSON, not {text[:80]!r}") from None


def _point(index: Any) -> tuple[int, ...]:
    if not isinstance(index, list) or any(type(i) is not int for i in index):
        raise ValueError(f"a reason belongs to a point as a list of indices, not {index!r}")
    return tuple(index)


def _read_table(lines: list[str]) -> _Table:
    try:
        names, *rows = list(csv.reader(io.StringIO("\n".join(lines)), strict=True)) or [[]]
    except csv.Error as error:
        raise ValueError(f"not comma-separated values: {error}") from None
    if names.count("outcome") != 1 or len(set(names)) != len(names):
        raise ValueError("the columns must have different names, one of them 'outcome'")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names):
            raise ValueError(f"row {number} has {len(row)} cells for {len(names)} columns")
    split = names.index("outcome")
    cells = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    return _Table(names[:split], names[split + 1 :], cells)


def _units_of(table: _Table, units: Any) -> dict[str, str]:
    if not isinstance(units, dict) or any(not isinstance(units.get(name), str) for name in table.axes + table.gains):
        raise ValueError("the line 'units' must name the unit of every axis and gain")
    return units


def _axis(name: str, unit: str, column: FloatArray) -> GridAxis:
    return GridAxis(inner_name(name, unit), unit, tuple(np.unique(column).tolist()))


def _require_whole_grid(table: _Table, axes: tuple[GridAxis, ...], shape: tuple[int, ...]) -> None:
    if math.prod(shape) != len(table.cells["outcome"]):
        raise ValueError(f"{len(table.cells['outcome'])} rows are not a whole grid {shape}")
    grid = np.meshgrid(*(np.asarray(axis.values) for axis in axes), indexing="ij")
    for name, values in zip(table.axes, grid, strict=True):
        if not np.array_equal(values.ravel(), table.column(name)):
            raise ValueError(f"the rows are not the grid {shape} in row-major order (column {name})")


def _reason_array(reasons: dict[tuple[int, ...], str], shape: tuple[int, ...]) -> Any:
    array = object_array([None] * math.prod(shape), shape)
    for index, why in reasons.items():
        if len(index) != len(shape) or any(not 0 <= i < n for i, n in zip(index, shape, strict=True)):
            raise ValueError(f"reason for a point {list(index)} outside the grid {shape}")
        array[index] = why
    return array
