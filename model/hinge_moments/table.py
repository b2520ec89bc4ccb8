"""Tables of hinge moments, as Xfoil, flow computations and wind tunnels give them: rows, cleaned and counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, GridArrays
from model.hinge_moments.levels import level_index

#: No table may have more rows; it bounds the time and the memory of reading and fitting.
MAX_ROWS = 1_000_000
#: Angles beyond it are refused: most likely degrees taken for radians [rad].
LARGEST_ANGLE = np.pi / 2.0

COEFFICIENTS = ("C_Ht", "C_Ha")
ANGLES = ("alpha", "dt", "da")


@dataclass(frozen=True)
class RowCount:
    """What became of the rows of a table.

    Attributes
    ----------
    given : rows that came in
    without_coefficients : rows dropped because a coefficient is missing (nan): gaps
    merged : rows averaged into another row of the same angles
    C_Ht_disagreement, C_Ha_disagreement : largest distance of such a row from its average [-]
    """

    given: int
    without_coefficients: int
    merged: int
    C_Ht_disagreement: float
    C_Ha_disagreement: float


@dataclass(frozen=True, eq=False)
class HingeMomentTable(GridArrays):
    """Measured or computed hinge moments: one row for each set of angles, sorted, nothing missing.

    Signs and units as in `HingeMoments`: restoring, by wing chord squared and per unit span, trailing edge
    up positive, the tab angle relative to the aileron. Made by `table_of_rows` or `read_table`.

    Attributes
    ----------
    angles : (n, 3) order [alpha, dt, da] [rad]
    coefficients : (n, 2) order [C_Ht, C_Ha] [-]
    count : what became of the rows given
    """

    angles: FloatArray
    coefficients: FloatArray
    count: RowCount


def table_of_rows(
    *, alpha: FloatArray, da: FloatArray, dt: FloatArray, C_Ha: FloatArray, C_Ht: FloatArray
) -> HingeMomentTable:
    """Clean rows of a table, in any order.

    Rows without both coefficients (nan) are dropped, rows of the same angles averaged (angles within 1e-9 rad
    are the same); `HingeMomentTable.count` says how many there were.

    Parameters
    ----------
    alpha, da, dt : (n,) incidence, aileron angle, tab angle relative to the aileron [rad]
    C_Ha, C_Ht : (n,) coefficients [-], nan where there is none

    Raises
    ------
    ValueError : columns of different lengths, no row with both coefficients, more than `MAX_ROWS` rows, an angle
        that is not finite or beyond a right angle, an infinite coefficient; rows are counted from 1
    """
    columns = {"alpha": alpha, "dt": dt, "da": da, "C_Ht": C_Ht, "C_Ha": C_Ha}
    arrays = {name: np.asarray(column, float) for name, column in columns.items()}
    _check(arrays)
    coefficients = np.stack([arrays[name] for name in COEFFICIENTS], axis=-1)
    measured = ~np.isnan(coefficients).any(axis=-1)
    if not np.any(measured):
        raise ValueError("no row of the table has both C_Ha and C_Ht")
    angles = np.stack([arrays[name][measured] for name in ANGLES], axis=-1)
    return _merged(angles, coefficients[measured], len(measured))


def _check(columns: dict[str, FloatArray]) -> None:
    shapes = {name: column.shape for name, column in columns.items()}
    if len(set(shapes.values())) > 1 or len(shapes["alpha"]) != 1:
        raise ValueError(f"the columns of the table must be lists of one length, not of shapes {shapes}")
    rows = shapes["alpha"][0]
    if rows > MAX_ROWS:
        raise ValueError(f"the table has {rows} rows; at most {MAX_ROWS} are allowed")
    for name in ANGLES:
        wrong = ~(np.abs(columns[name]) <= LARGEST_ANGLE)
        if np.any(wrong):
            row = int(np.argmax(wrong))
            raise ValueError(f"row {row + 1}: {name} is {columns[name][row]:.6g} rad; it must lie within +/-pi/2 rad")
    for name in COEFFICIENTS:
        wrong = np.isinf(columns[name])
        if np.any(wrong):
            raise ValueError(f"row {int(np.argmax(wrong)) + 1}: {name} is infinite; leave out what was not measured")


def _merged(angles: FloatArray, coefficients: FloatArray, given: int) -> HingeMomentTable:
    """One row for each set of angles, sorted by alpha, dt, da; repeated ones averaged."""
    identity = np.zeros(len(angles), dtype=np.int64)
    snapped = np.empty_like(angles)
    for k in range(3):
        levels, index = level_index(angles[:, k])
        identity = identity * len(levels) + index
        snapped[:, k] = levels[index]
    _, first, group, repeats = np.unique(identity, return_index=True, return_inverse=True, return_counts=True)
    sums = [np.bincount(group, weights=coefficients[:, k]) for k in range(2)]
    average = np.stack(sums, axis=-1) / repeats[:, None]
    away = np.max(np.abs(coefficients - average[group]), axis=0)
    count = RowCount(given, given - len(angles), len(angles) - len(first), float(away[0]), float(away[1]))
    return HingeMomentTable(snapped[first], average, count)
