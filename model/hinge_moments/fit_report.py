"""How well a fit represents its table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.arrays import FloatArray
from model.hinge_moments.table import RowCount

#: ``residual``: fit minus row. ``left_out``: each row between others predicted by its neighbours alone.
ErrorKind = Literal["residual", "left_out"]


@dataclass(frozen=True)
class FitError:
    """Error of one coefficient.

    Attributes
    ----------
    largest, rms : largest and root-mean-square error [-]; nan when nothing could be compared
    value_range : largest minus smallest coefficient of the rows used [-]
    """

    largest: float
    rms: float
    value_range: float

    @property
    def percent_of_range(self) -> float:
        """Largest error in per cent of the range (the thesis quotes five, seed 2.3); zero for a constant."""
        return 100.0 * self.largest / self.value_range if self.value_range > 0 else 0.0

    @property
    def rms_percent_of_range(self) -> float:
        """Root-mean-square error in per cent of the range; zero for a constant."""
        return 100.0 * self.rms / self.value_range if self.value_range > 0 else 0.0


@dataclass(frozen=True)
class FitReport:
    """Errors of a fit and what became of the table's rows.

    Attributes
    ----------
    C_Ht, C_Ha : error of each coefficient
    kind : what the errors are; an interpolant goes through its rows, so it reports rows left out in turn
    rows_used : rows that the fit was made of
    rows_outside_window : rows of the table left out because they are too far from the point of expansion
    count : rows given, averaged and dropped when the table was made
    notes : what the fit could not do, in words
    """

    C_Ht: FitError
    C_Ha: FitError
    kind: ErrorKind
    rows_used: int
    rows_outside_window: int
    count: RowCount
    notes: tuple[str, ...]


def fit_errors(errors: FloatArray, coefficients: FloatArray) -> tuple[FitError, FitError]:
    """Errors of [C_Ht, C_Ha] from differences (m, 2) and the coefficients of the rows used (n, 2)."""
    span = np.ptp(coefficients, axis=0)
    if len(errors) == 0:
        return FitError(float("nan"), float("nan"), float(span[0])), FitError(
            float("nan"), float("nan"), float(span[1])
        )
    largest, rms = np.max(np.abs(errors), axis=0), np.sqrt(np.mean(errors**2, axis=0))
    tab, aileron = (FitError(float(largest[k]), float(rms[k]), float(span[k])) for k in range(2))
    return tab, aileron


def require_deflections(angles: FloatArray) -> None:
    """Refuse rows (n, 3) in which the tab or the aileron stands still: its derivatives would be made up.

    Raises
    ------
    ValueError : fewer than two values of the tab or the aileron angle
    """
    for column, name in ((1, "tab"), (2, "aileron")):
        if np.ptp(angles[:, column]) == 0:
            at = np.rad2deg(angles[0, column])
            raise ValueError(
                f"the rows have one {name} angle only ({at:.6g} deg): the derivatives by it cannot be known; "
                f"give rows of at least two"
            )


def one_incidence_note(table_angles: FloatArray) -> tuple[str, ...]:
    """A note when there is one incidence only: nothing that moves depends on its derivative."""
    if np.ptp(table_angles[:, 0]) > 0:
        return ()
    at = np.rad2deg(table_angles[0, 0])
    return (
        f"the rows have one incidence only ({at:.6g} deg): derivatives by incidence are zero, and only trims at "
        f"that incidence are covered",
    )
