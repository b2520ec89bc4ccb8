"""The schedule as a MATLAB script, for MATLAB and GNU Octave, that also makes Simulink's lookup-table objects.

The script defines what the MAT-file holds: every axis and gain by its name, ``ok``, the matrices ``K`` and ``N`` of an
LQR, the struct ``lookup`` where an axis has one breakpoint, and the struct ``gainfield`` with the words. Where Simulink
is there, ``K_p_lookup`` is a ``Simulink.LookupTable`` for the n-D Lookup Table block.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from model.arrays import BoolArray, FloatArray, ObjectArray
from schedules.files.checks import NAME
from schedules.files.header import header, units
from schedules.files.matlab_file import gain_matrix, lookup_tables
from schedules.files.plain_text import m_string, number, plain, wrapped
from schedules.files.words import require_multilinear, require_table, words
from schedules.fill import FilledSchedule
from schedules.rules import OutOfRange
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name

ARRAY_ORDER = "ndgrid order: dimension k of every array belongs to axis k of gainfield.axes"

#: MATLAB's and Octave's own words, and names whose meaning the script needs.
_KEYWORDS = """
    break case catch classdef continue do else elseif end end_try_catch end_unwind_protect endfor endfunction endif
    endparfor endswitch endwhile exist for function global if otherwise parfor persistent reshape return spmd switch
    true false try until unwind_protect unwind_protect_cleanup while zeros cell
"""
KEYWORDS = frozenset(_KEYWORDS.split())

#: What interpn and Simulink's block have to be told, by the schedule's rules.
_OUTSIDE: dict[OutOfRange, str] = {
    "clip": """\
% Outside the breakpoints the nearest edge counts. interpn answers NaN there and Simulink's block extrapolates unless
% told otherwise: clip the coordinates first, and set the block's Extrapolation method to Clip.
""",
    "hold": """\
% Outside the breakpoints the last gains that were inside are held. interpn answers NaN there and Simulink's block
% extrapolates: neither has this rule, which is up to what calls them.
""",
    "refuse": """\
% Outside the breakpoints there are no gains. interpn answers NaN there, but Simulink's block extrapolates: what calls
% it has to refuse such coordinates.
""",
}


def write_matlab_script(schedule: FilledSchedule) -> bytes:
    """The script, in ASCII.

    Raises
    ------
    ValueError : a schedule without axes or gains, one that is not multilinear, or a name that the script cannot use
    """
    require_table(schedule)
    require_multilinear(schedule, "Simulink's lookup table")
    designed, complete = schedule.designed, schedule.complete
    names = [axis_name(axis) for axis in designed.axes] + [gain.name for gain in designed.gains]
    _require_names(names, [f"{gain.name}_lookup" for gain in designed.gains])
    lines = [f"% {name}: {plain(text)}" for name, text in words(schedule, ARRAY_ORDER)]
    lines += ["%", *_OUTSIDE[designed.rules.out_of_range].splitlines(), ""]
    for axis in designed.axes:
        lines += _numbers(axis_name(axis), np.asarray(axis.values, dtype=float), axis.unit)
    for gain in complete.gains:
        lines += _numbers(gain.name, gain.values, gain.unit)
    lines += _array("ok", [str(bool(x)).lower() for x in _column_major(designed.outcomes.ok)], designed.shape, "[]")
    lines += ["", *_matrices(complete), *_lookup(complete), *_about(schedule), "", *_simulink(complete)]
    return ("\n".join(lines) + "\n").encode("ascii")


def _require_names(names: list[str], objects: list[str]) -> None:
    for name in names:
        if name in KEYWORDS:
            raise ValueError(f"{name!r} is a word of MATLAB: it cannot be the name of an axis or a gain there")
    for name in objects:
        if name in names or not NAME.fullmatch(name):
            raise ValueError(f"{name!r} cannot be the name of a lookup table in a MATLAB script")


def _numbers(name: str, values: FloatArray, unit: str) -> Iterator[str]:
    """Assignment of an array: a vector along a row, a matrix a row a line, more dimensions by reshape."""
    comment = f" % [{plain(unit)}]"
    if values.ndim == 2:
        yield f"{name} = [{comment}"
        for row in values.tolist():
            yield from _continued([number(x) for x in row], ", ")
        yield "];"
    else:
        lines = list(_array(name, [number(x) for x in _column_major(values)], values.shape, "[]"))
        yield from [*lines[:-1], lines[-1] + comment]


def _array(name: str, items: list[str], shape: tuple[int, ...], brackets: str) -> Iterator[str]:
    """Assignment of an array of any kind from its elements in column-major order."""
    size = " ".join(str(n) for n in ((1, *shape) if len(shape) == 1 else shape))
    yield f"{name} = reshape({brackets[0]} ..."
    lines = list(_continued(items, ", "))
    yield from (line if line.endswith("...") else f"{line} ..." for line in lines)
    yield f"{brackets[1]}, [{size}]);"


def _continued(items: Iterable[str], separator: str) -> Iterator[str]:
    """Lines of one row: all but the last are continued."""
    lines = list(wrapped(items, separator, "    "))
    yield from (f"{line} ..." for line in lines[:-1])
    yield lines[-1]


def _matrices(schedule: GainSchedule) -> Iterator[str]:
    """The matrices of an LQR from its gains: ``K(:, :, input, state)``."""
    grid = ", ".join([":"] * len(schedule.axes))
    size = " ".join(str(n) for n in schedule.shape)
    for symbol in ("K", "N"):
        matrix = gain_matrix(schedule, symbol)
        if matrix is None:
            continue
        rows, columns = matrix.rows, matrix.columns
        yield f"{symbol} = zeros([{size} {len(rows)} {len(columns)}]); % rows {' '.join(rows)}, columns " + " ".join(
            columns
        )
        for i, row in enumerate(rows, start=1):
            for j, column in enumerate(columns, start=1):
                yield f"{symbol}({grid}, {i}, {j}) = {symbol}_{row}_{column};"
        yield ""


def _lookup(schedule: GainSchedule) -> Iterator[str]:
    """The struct `lookup`, when an axis has one breakpoint: two there, the gains repeated."""
    if 1 not in schedule.shape:
        return
    yield "% An axis that has one breakpoint gets a second here, and the gains are repeated along it."
    yield "lookup = struct();"
    for name, values in lookup_tables(schedule).items():
        yield from _array(f"lookup.{name}", [number(x) for x in _column_major(values)], values.shape, "[]")
    yield ""


def _about(schedule: FilledSchedule) -> Iterator[str]:
    designed = schedule.designed
    yield "gainfield = struct();"
    for name, word in header(designed).items():
        yield f"gainfield.{name} = {m_string(word) if isinstance(word, str) else word};"
    yield f"gainfield.axes = {{{', '.join(m_string(axis_name(axis)) for axis in designed.axes)}}};"
    for name, unit in units(designed).items():
        yield f"gainfield.units.{name} = {m_string(unit)};"
    yield f"gainfield.array_order = {m_string(ARRAY_ORDER)};"
    yield f"gainfield.fill = {m_string(schedule.rule or 'none')};"
    yield "gainfield.filled = ~ok;"
    yield from _cells("gainfield.outcomes", designed.outcomes.codes)
    yield from _cells("gainfield.reasons", designed.outcomes.reasons)


def _cells(name: str, texts: ObjectArray) -> Iterator[str]:
    items = ["''" if text is None else m_string(str(text)) for text in _column_major(texts)]
    return _array(name, items, texts.shape, "{}")


def _simulink(schedule: GainSchedule) -> Iterator[str]:
    source = "lookup." if 1 in schedule.shape else ""
    yield "if exist('Simulink.LookupTable', 'class') == 8"
    for gain in schedule.gains:
        table = f"{gain.name}_lookup"
        yield f"    {table} = Simulink.LookupTable;"
        yield f"    {table}.Table.Value = {source}{gain.name};"
        yield f"    {table}.Table.FieldName = '{gain.name}';"
        yield f"    {table}.Table.Unit = {m_string(_simulink_unit(gain.unit))};"
        yield f"    {table}.StructTypeInfo.Name = '{gain.name}_table';"
        for k, axis in enumerate(schedule.axes, start=1):
            yield f"    {table}.Breakpoints({k}).Value = {source}{axis_name(axis)};"
            yield f"    {table}.Breakpoints({k}).FieldName = '{axis_name(axis)}';"
            yield f"    {table}.Breakpoints({k}).Unit = {m_string(_simulink_unit(axis.unit))};"
    yield "end"


def _simulink_unit(unit: str) -> str:
    """Unit in Simulink's words: a product has its sign, ``N*m/(rad*s)``."""
    return unit.replace(" ", "*")


def _column_major(values: FloatArray | BoolArray | ObjectArray) -> list[Any]:
    return list(np.ravel(values, order="F").tolist())
