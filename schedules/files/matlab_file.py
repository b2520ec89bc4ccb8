"""The schedule as a MATLAB 5 MAT-file, for MATLAB and GNU Octave.

Variables: every axis by its name with unit (``altitude_m``), every gain by its name, ``ok`` and, for an LQR,
the matrices ``K`` and ``N``; the struct ``gainfield`` says what they are. The arrays are in ndgrid order,
``K_p(i, j)`` at ``altitude_m(i)`` and ``dynamic_pressure_pa(j)``, so that ``interpn(altitude_m,
dynamic_pressure_pa, K_p, h, q)`` is the multilinear rule once h and q are clipped to the breakpoints.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.io import savemat

from design.gains import Gain
from model.arrays import FloatArray, ObjectArray
from model.linear_model import INPUTS
from schedules.files.header import FORMAT, header, object_array, units
from schedules.files.proof_words import proof_members
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name

ARRAY_ORDER = (
    "ndgrid order: dimension k of every array belongs to axis k of gainfield.axes; K(..., input, state) and "
    "N(..., input, reference) have the grid's dimensions first. MATLAB drops trailing dimensions of length 1"
)
MISSING = (
    "NaN, and ok is false there; interpn may answer NaN anywhere in a cell that touches such a point, "
    "the cell's edges and corners included"
)
LOOKUP = (
    "interpn needs two breakpoints an axis: in the struct lookup, an axis that has only one gets a second "
    "above it, and the gains are repeated along it. lookup serves any coordinate clipped to its axes"
)

#: Text of the file's first 116 bytes. The usual one holds the time of writing and the machine's system.
_DESCRIPTION = f"MATLAB 5.0 MAT-file, {FORMAT}, schema version "
_DESCRIPTION_LENGTH = 116


def write_matlab(schedule: GainSchedule) -> bytes:
    """The schedule as a compressed MAT-file of version 5; the same schedule gives the same bytes."""
    variables: dict[str, Any] = {axis_name(a): np.asarray(a.values, dtype=float) for a in schedule.axes}
    variables |= {gain.name: gain.values for gain in schedule.gains}
    variables["ok"] = schedule.outcomes.ok
    about = _about(schedule)
    for symbol in ("K", "N"):
        matrix = gain_matrix(schedule, symbol)
        if matrix is not None:
            variables[symbol] = matrix.values
            about[f"{symbol}_rows"] = _cells(matrix.rows)
            about[f"{symbol}_columns"] = _cells(matrix.columns)
    if 1 in schedule.shape:
        variables["lookup"] = lookup_tables(schedule)
        about["lookup"] = LOOKUP
    variables["gainfield"] = about
    content = io.BytesIO()
    # The stubs know of paths only; savemat writes to open files as well.
    savemat(content, variables, do_compression=True, oned_as="row", long_field_names=True)  # type: ignore[arg-type]
    description = f"{_DESCRIPTION}{schedule.schema_version}".encode("ascii").ljust(_DESCRIPTION_LENGTH)
    return description + content.getvalue()[_DESCRIPTION_LENGTH:]


@dataclass(frozen=True)
class GainMatrix:
    """Gains of a schedule put together as a matrix at every grid point.

    Attributes
    ----------
    values : (*G, n_rows, n_columns), nan where the point carries no gain
    rows : the inputs, ``T_t T_a``
    columns : the states of ``K``, the references of ``N``
    """

    values: FloatArray
    rows: tuple[str, ...]
    columns: tuple[str, ...]


def gain_matrix(schedule: GainSchedule, symbol: str) -> GainMatrix | None:
    """The matrix whose entries are the gains ``<symbol>_<input>_<column>``, rows and columns as they occur.

    None unless the schedule is of kind ``lqr`` and has every entry of the matrix.
    """
    entries: dict[tuple[str, str], Gain] = {}
    for gain in schedule.gains:
        parts = re.fullmatch(rf"{symbol}_({'|'.join(INPUTS)})_(\w+)", gain.name)
        if parts:
            entries[parts[1], parts[2]] = gain
    rows = tuple(dict.fromkeys(row for row, _ in entries))
    columns = tuple(dict.fromkeys(column for _, column in entries))
    if schedule.kind != "lqr" or not entries or len(entries) != len(rows) * len(columns):
        return None
    flat = np.stack([entries[row, column].values for row in rows for column in columns], axis=-1)
    return GainMatrix(flat.reshape(*schedule.shape, len(rows), len(columns)), rows, columns)


def _about(schedule: GainSchedule) -> dict[str, Any]:
    words = {name: _char(w) if isinstance(w, str) else float(w) for name, w in header(schedule).items()}
    proof = proof_members(schedule)
    return words | {
        "proof": json.dumps(proof["proof"]),
        "proof_reason": proof["proof_reason"] or "",
        "axes": _cells([axis_name(axis) for axis in schedule.axes]),
        "units": {name: _char(unit) for name, unit in units(schedule).items()},
        "array_order": ARRAY_ORDER,
        "missing": MISSING,
        "outcomes": _cells(schedule.outcomes.codes),
        "reasons": _cells(schedule.outcomes.reasons),
    }


def lookup_tables(schedule: GainSchedule) -> dict[str, FloatArray]:
    """Axes and gains by name, every axis with two breakpoints at least: the gains are repeated along a second one."""
    table: dict[str, FloatArray] = {}
    for axis in schedule.axes:
        values = axis.values
        doubled = (values[0], values[0] + max(1.0, abs(values[0])))
        table[axis_name(axis)] = np.asarray(doubled if len(values) == 1 else values, dtype=float)
    for gain in schedule.gains:
        table[gain.name] = np.tile(gain.values, [2 if n == 1 else 1 for n in schedule.shape])
    return table


def _cells(items: Sequence[str] | ObjectArray) -> ObjectArray:
    """Cell array of texts, of the shape of `items`; None becomes the empty text."""
    array = np.asarray(items, dtype=object)
    return object_array(["" if item is None else _char(str(item)) for item in array.ravel()], array.shape)


def _char(text: str) -> str:
    r"""Text in ASCII, the other characters as escapes (``\xfc``): readers cut off what they do not count."""
    return text.encode("ascii", "backslashreplace").decode("ascii")
