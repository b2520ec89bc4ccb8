"""Hinge moments as a multidimensional Taylor expansion fitted to a table (seed 2.2.9 and 2.2.10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray, Floats, IntArray
from model.hinge_moments.blocks import in_blocks
from model.hinge_moments.expansion import Angles, HingeMoments
from model.hinge_moments.fit_report import FitReport, fit_errors, one_incidence_note, require_deflections
from model.hinge_moments.hull import SLACK, Hull, hull_of
from model.hinge_moments.least_squares import least_squares
from model.hinge_moments.levels import level_index
from model.hinge_moments.polynomial import Polynomial, powers_up_to, term_names, term_values
from model.hinge_moments.table import HingeMomentTable

#: Highest order of an expansion; beyond it a polynomial follows the noise of its rows.
MAX_ORDER = 6


@dataclass(frozen=True, eq=False)
class TaylorExpansion:
    """Source of hinge moments: a polynomial in the deviations of the angles from the point of expansion.

    It goes on beyond its rows; `covers` says where they stand behind it.

    Attributes
    ----------
    polynomial : the terms and their coefficients
    hull : hull of the rows it was fitted to
    report : errors and rows
    """

    polynomial: Polynomial
    hull: Hull
    report: FitReport

    def at(self, alpha: Floats, dt: Floats, da: Floats) -> HingeMoments:
        """Coefficients and gradient at incidence and deflections [rad]; see `HingeMomentSource.at`."""
        return in_blocks(self.polynomial.at, alpha, dt, da)

    def covers(self, alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
        """Mask (*G,) of the angles [rad] within the hull of the rows; see `HingeMomentSource.covers`."""
        return self.hull.contains(alpha, dt, da)

    @property
    def domain(self) -> str:
        """The hull, in words and degrees."""
        return str(self.hull)


def fit_taylor(
    table: HingeMomentTable, order: int = 1, about: Angles | None = None, window: Angles | None = None
) -> TaylorExpansion:
    """Fit all monomials of the deviations up to a total order, by least squares over the rows.

    Without a window the polynomial is the same whatever `about` is, only written about another point; with
    one, `about` chooses the rows. An angle of m different values allows powers to m - 1 only: higher ones are
    left out and named in the report. A single incidence is allowed, since nothing in the motion depends on the
    derivative by it; a single tab or aileron angle is not.

    Parameters
    ----------
    table : rows
    order : total order, 1 to `MAX_ORDER`
    about : point of expansion, the trim [rad]; default zero
    window : keep the rows within these distances from `about` [rad]; default all rows

    Raises
    ------
    ValueError : an order out of range, no rows in the window, one tab or aileron angle only, fewer rows than terms,
        or rows that do not tell the terms apart (tab and aileron deflected only together)
    """
    if not 1 <= order <= MAX_ORDER:
        raise ValueError(f"the order of the expansion must be 1 to {MAX_ORDER}, not {order}")
    centre = _array(about or Angles())
    kept = _within(table.angles, centre, window)
    angles, coefficients = table.angles[kept], table.coefficients[kept]
    require_deflections(angles)
    powers = powers_up_to(order, _largest_powers(angles))
    polynomial = _fitted(angles, coefficients, powers).moved_to(centre)
    errors = in_blocks(polynomial.at, *angles.T).value - coefficients
    tab, aileron = fit_errors(errors, coefficients)
    notes = one_incidence_note(angles) + _missing_terms_note(order, powers)
    report = FitReport(tab, aileron, "residual", len(angles), len(kept) - len(angles), table.count, notes)
    return TaylorExpansion(polynomial, hull_of(angles), report)


def _array(angles: Angles) -> FloatArray:
    array = np.array([angles.alpha, angles.dt, angles.da])
    if np.any(np.isnan(array)):
        raise ValueError("the point of expansion and its window must be numbers [rad]")
    return array


def _within(angles: FloatArray, centre: FloatArray, window: Angles | None) -> BoolArray:
    if not np.all(np.isfinite(centre)):
        raise ValueError("the point of expansion must be finite [rad]")
    if window is None:
        return np.ones(len(angles), dtype=bool)
    kept = np.all(np.abs(angles - centre) <= _array(window) + SLACK, axis=-1)
    if not np.any(kept):
        around = ", ".join(f"{x:.6g}" for x in np.rad2deg(centre))
        raise ValueError(f"no row of the table lies in the window about alpha, tab, aileron = {around} deg")
    return np.asarray(kept)


def _largest_powers(angles: FloatArray) -> tuple[int, int, int]:
    """Highest power of each angle that its different values can tell from the lower ones."""
    alpha, dt, da = (len(level_index(column)[0]) - 1 for column in angles.T)
    return alpha, dt, da


def _fitted(angles: FloatArray, coefficients: FloatArray, powers: IntArray) -> Polynomial:
    """Polynomial about the middle of the rows, by least squares on deviations scaled to one.

    Fitted there and moved later, it does not suffer from a point of expansion at the edge of the rows.
    """
    if len(angles) < len(powers):
        raise ValueError(f"{len(angles)} rows cannot determine the {len(powers)} terms of the expansion")
    lower, upper = angles.min(axis=0), angles.max(axis=0)
    middle, scale = 0.5 * (lower + upper), np.where(upper > lower, 0.5 * (upper - lower), 1.0)
    deviations = angles - middle
    found = least_squares(lambda rows: term_values(deviations[rows] / scale, powers), len(powers), coefficients)
    if not found.determined:
        terms = np.array(term_names(powers))[np.abs(found.weakest) > 0.1 * np.max(np.abs(found.weakest))]
        raise ValueError(
            f"the rows do not tell the terms {', '.join(terms)} apart: deflect tab and aileron independently, or "
            f"lower the order"
        )
    return Polynomial(middle, powers, found.solution.T / np.prod(scale**powers, axis=-1))


def _missing_terms_note(order: int, powers: IntArray) -> tuple[str, ...]:
    """A note that names the terms of this order that the rows' different angles cannot determine."""
    present = set(term_names(powers))
    missing = [name for name in term_names(powers_up_to(order, (order, order, order))) if name not in present]
    if not missing:
        return ()
    shown = ", ".join(missing[:6]) + (f" and {len(missing) - 6} more" if len(missing) > 6 else "")
    return (f"too few different angles for the terms {shown}: they are left out",)
