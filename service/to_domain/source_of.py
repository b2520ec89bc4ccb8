"""From the wire to a source of hinge moments; what the model refuses about a table names the field."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import radians

import numpy as np

from model.hinge_moments.camber import MeanLine, mean_line
from model.hinge_moments.derivatives import Derivatives
from model.hinge_moments.expansion import Angles, HingeMomentSource
from model.hinge_moments.fit_report import require_deflections
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.mean_line_table import mean_line_of_points
from model.hinge_moments.read_table import read_table
from model.hinge_moments.table import HingeMomentTable, table_of_rows
from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from service.schemas import aerodynamics, section
from service.schemas.hinge_tables import Taylor
from service.wire.refusals import FieldRefusal, InvalidRequest

#: What a table must be to be taken, whatever the fit.
WORKING_ROWS = "rows with both coefficients, of at least two tab and two aileron angles"
WORKING_FITS = (
    "taylor: at least as many rows as terms, tab and aileron deflected independently; cubic and multilinear: a row "
    "for every combination of the angles"
)


def hinge_moment_source(
    wire: aerodynamics.Aerodynamics, hinges: section.HingeGeometry, about: Angles
) -> HingeMomentSource:
    """The source that a request names; a table is expanded about the angles `about`.

    Raises
    ------
    InvalidRequest : a table that cannot be read or fitted
    """
    if isinstance(wire, aerodynamics.ThinAerofoil):
        return ThinAerofoil(hinges.aileron_hinge, hinges.tab_hinge, camber(wire.section))
    if isinstance(wire, aerodynamics.Derivatives):
        return derivatives(wire)
    rows = table(wire)
    with model_refuses("/aerodynamics/fit", WORKING_FITS):
        if not isinstance(wire.fit, Taylor):
            return fit_interpolant(rows, wire.fit.method)
        window = None
        if wire.fit.window_deg is not None:
            width = radians(wire.fit.window_deg)
            window = Angles(width, width, width)
        return fit_taylor(rows, wire.fit.order, about, window)


def camber(wire: str | list[list[float]]) -> MeanLine:
    """Mean line by the section's name, or through points."""
    if isinstance(wire, str):
        return mean_line(wire)
    x, z = np.array(wire, dtype=float).T
    return mean_line_of_points(x, z)


def derivatives(wire: aerodynamics.Derivatives) -> Derivatives:
    """The eight numbers, reference angles in radians."""
    return Derivatives(
        C_Ha_0=wire.C_Ha_0,
        C_Ha_alpha=wire.C_Ha_alpha,
        C_Ha_da=wire.C_Ha_da,
        C_Ha_dt=wire.C_Ha_dt,
        C_Ht_0=wire.C_Ht_0,
        C_Ht_alpha=wire.C_Ht_alpha,
        C_Ht_da=wire.C_Ht_da,
        C_Ht_dt=wire.C_Ht_dt,
        alpha0=radians(wire.reference.alpha_deg),
        da0=radians(wire.reference.aileron_deg),
        dt0=radians(wire.reference.tab_deg),
    )


def table(wire: aerodynamics.Table) -> HingeMomentTable:
    """The rows, cleaned; a null coefficient is a gap.

    Raises
    ------
    InvalidRequest : the text is no such table, or the rows do not move both surfaces
    """
    with model_refuses("/aerodynamics/rows" if wire.csv is None else "/aerodynamics/csv", WORKING_ROWS):
        found = read_table(wire.csv, wire.where) if wire.csv is not None else _table_of_lists(wire)
        require_deflections(found.angles)
    return found


def _table_of_lists(wire: aerodynamics.Table) -> HingeMomentTable:
    alpha, aileron, tab, C_Ha, C_Ht = np.array(wire.rows, dtype=float).T
    return table_of_rows(alpha=np.deg2rad(alpha), da=np.deg2rad(aileron), dt=np.deg2rad(tab), C_Ha=C_Ha, C_Ht=C_Ht)


@contextmanager
def model_refuses(pointer: str, allowed: str) -> Iterator[None]:
    """Turn what the model refuses within into a refused field."""
    try:
        yield
    except ValueError as error:
        raise InvalidRequest(f"{pointer}: {error}", FieldRefusal(pointer, str(error), None, allowed)) from None
