"""Reading a table of hinge moments from CSV text."""

from __future__ import annotations

import csv
import io
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray
from model.hinge_moments.table import MAX_ROWS, HingeMomentTable, table_of_rows

#: What a column may be called; the longer name says sign and reference aloud.
_NAMES = {
    "alpha": ("alpha_deg",),
    "da": ("da_deg", "da_up_deg", "aileron_deg"),
    "dt": ("dt_deg", "dt_up_rel_deg", "tab_deg"),
    "C_Ha": ("C_Ha",),
    "C_Ht": ("C_Ht",),
}


def read_table(text: str, where: Mapping[str, str | float] | None = None) -> HingeMomentTable:
    """Table of hinge moments from comma-separated text with a header line.

    Columns, in any order: ``alpha_deg``, ``da_deg`` (or ``da_up_deg``, ``aileron_deg``), ``dt_deg`` (or
    ``dt_up_rel_deg``, ``tab_deg``), ``C_Ha``, ``C_Ht``; others are ignored. Angles in degrees, trailing edge up
    positive, the tab's relative to the aileron; coefficients restoring, by wing chord squared and per unit
    span. Lines that begin with ``#`` are comments. An empty coefficient (or nan) is a gap: the row is dropped
    and counted.

    Parameters
    ----------
    text : the file
    where : rows to keep, by the value of other columns: ``{"case": "trip", "Re": 1e6}``; numbers are compared
        as numbers

    Raises
    ------
    ValueError : a column is missing or there twice, a row is short or long, a number is none or impossible (with
        the line of the file and the column), no row is kept, there are more than `MAX_ROWS` of them
    """
    reader = csv.reader(_without_comments(text))
    try:
        header = [name.strip() for name in next((row for row in reader if row), [])]
        columns, filters = _columns(header), _filters(header, where or {})
        numbers = _numbers(reader, header, columns, filters)
    except csv.Error as error:
        raise ValueError(f"line {reader.line_num}: the text is no CSV ({error})") from None
    if numbers.shape[1] == 0:
        kept = " with " + ", ".join(f"{k} = {v}" for k, v in where.items()) if where else ""
        raise ValueError(f"the table has no rows{kept}")
    alpha, da, dt = np.deg2rad(numbers[:3])
    return table_of_rows(alpha=alpha, da=da, dt=dt, C_Ha=numbers[3], C_Ht=numbers[4])


@dataclass(frozen=True)
class _Column:
    """A column that is read: its header, its place in the line, whether it is an angle."""

    header: str
    place: int
    is_angle: bool

    def number(self, row: list[str], line: int) -> float:
        """The row's number in this column; nan for a coefficient that is missing."""
        text = row[self.place].strip()
        if not text and not self.is_angle:
            return float("nan")
        try:
            value = float(text)
        except ValueError:
            raise ValueError(f"line {line}, column {self.header}: {text!a} is not a number") from None
        if self.is_angle and not abs(value) <= 90.0:
            raise ValueError(f"line {line}, column {self.header}: {text} must lie within +/-90 degrees")
        if value in (float("inf"), float("-inf")):
            raise ValueError(f"line {line}, column {self.header}: {text} is infinite; leave a gap empty")
        return value


@dataclass(frozen=True)
class _Filter:
    """Rows to keep: those that have `wanted` in one column."""

    place: int
    wanted: str | float

    def keeps(self, row: list[str]) -> bool:
        text, wanted = row[self.place].strip(), self.wanted
        try:
            return float(text) == float(wanted)
        except ValueError:
            return text == str(wanted)


def _without_comments(text: str) -> Iterator[str]:
    """Lines of the file; a comment becomes an empty line, so that line numbers hold."""
    for line in io.StringIO(text.removeprefix("\ufeff"), newline=None):
        yield "\n" if line.lstrip().startswith("#") else line


def _columns(header: list[str]) -> list[_Column]:
    columns, missing = [], []
    for names in _NAMES.values():
        places = [place for place, name in enumerate(header) if name in names]
        if len(places) > 1:
            raise ValueError(f"the table has {len(places)} columns for {' or '.join(names)}; one is wanted")
        if places:
            columns.append(_Column(header[places[0]], places[0], names[0].endswith("_deg")))
        else:
            missing.append(" or ".join(names))
    if missing:
        raise ValueError(f"the table lacks columns: {', '.join(missing)}; its header is {','.join(header)[:200]!a}")
    return columns


def _filters(header: list[str], where: Mapping[str, str | float]) -> list[_Filter]:
    for name in where:
        if header.count(name) != 1:
            raise ValueError(f"rows are chosen by column {name!a}, which the table has {header.count(name)} times")
    return [_Filter(header.index(name), wanted) for name, wanted in where.items()]


def _numbers(
    rows: Iterator[list[str]], header: list[str], columns: list[_Column], filters: list[_Filter]
) -> FloatArray:
    """(5, n) numbers of the rows that every filter keeps, in the file's units; `rows` is the csv reader."""
    numbers, kept = [array("d") for _ in columns], 0
    for row in rows:
        if not row:
            continue
        line = rows.line_num  # type: ignore[attr-defined]
        if len(row) != len(header):
            raise ValueError(f"line {line} has {len(row)} columns; the header has {len(header)}")
        if not all(f.keeps(row) for f in filters):
            continue
        kept += 1
        if kept > MAX_ROWS:
            raise ValueError(f"the table has more than {MAX_ROWS} rows")
        for column, values in zip(columns, numbers, strict=True):
            values.append(column.number(row, line))
    return np.array([np.frombuffer(values, dtype=float) if values else [] for values in numbers])
