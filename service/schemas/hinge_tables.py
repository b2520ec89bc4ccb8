"""Tables of hinge moments on the wire: their rows, and how they are fitted."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, Tag

from model.hinge_moments.taylor import MAX_ORDER
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.wire import Request, refusal

#: Order of the numbers of a row that is written as a list.
COLUMNS = ("alpha_deg", "aileron_deg", "tab_deg", "C_Ha", "C_Ht")
LARGEST_ANGLE = 90.0
LARGEST_COEFFICIENT = 100.0

TableAngle = Annotated[float, Field(ge=-LARGEST_ANGLE, le=LARGEST_ANGLE)]
TableCoefficient = Annotated[float, Field(ge=-LARGEST_COEFFICIENT, le=LARGEST_COEFFICIENT)]
Cell = Annotated[float, Field(ge=-LARGEST_COEFFICIENT, le=LARGEST_COEFFICIENT)]


class TableRow(Request):
    """One row: angles, and the coefficients there; null where a coefficient was not obtained."""

    alpha_deg: TableAngle
    aileron_deg: TableAngle
    tab_deg: TableAngle
    C_Ha: TableCoefficient | None
    C_Ht: TableCoefficient | None


def row_of_angles(row: list[float | None]) -> list[float | None]:
    """A row, refused unless its three angles are there and within a right angle."""
    for place, name in enumerate(COLUMNS[:3]):
        angle = row[place]
        if angle is None or abs(angle) > LARGEST_ANGLE:
            words = "null" if angle is None else f"{angle:g}"
            raise refusal(
                f"{name} cannot be {words}", f">= -{LARGEST_ANGLE:g} and <= {LARGEST_ANGLE:g}", at=f"/{place}"
            )
    return row


def listed(row: TableRow) -> list[float | None]:
    """The row as a list, so that both ways of writing a table are one request."""
    return [row.alpha_deg, row.aileron_deg, row.tab_deg, row.C_Ha, row.C_Ht]


ListedRow = Annotated[
    list[Cell | None],
    Field(min_length=len(COLUMNS), max_length=len(COLUMNS)),
    AfterValidator(row_of_angles),
    Tag("array"),
]
Row = Annotated[ListedRow | Annotated[TableRow, AfterValidator(listed), Tag("object")], BY_JSON_TYPE]
Rows = Annotated[
    list[Row], Field(fail_fast=True, min_length=1, json_schema_extra={"unit": "angles in deg, coefficients 1"})
]

CsvText = Annotated[str, Field(min_length=1)]
ColumnName = Annotated[str, Field(min_length=1, max_length=100)]
CellNumber = Annotated[float, Tag("number")]
CellText = Annotated[str, Field(max_length=100), Tag("string")]
WhereRows = dict[ColumnName, Annotated[CellNumber | CellText, BY_JSON_TYPE]]


class Taylor(Request):
    """All monomials of the angles' deviations to a total order, by least squares (seed 2.2.9, 2.2.10)."""

    method: Literal["taylor"]
    order: Annotated[int, Field(ge=1, le=MAX_ORDER)] = Field(default=1, description="Total order of the expansion")
    window_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = Field(
        default=None,
        description="Fit only the rows whose every angle lies within this of the trim (of `about` for hinge moments "
        "alone; an angle that the trim solves for counts as zero); null: all rows",
    )


class Cubic(Request):
    """A smooth interpolant through every row, which must fill a grid of angles."""

    method: Literal["cubic"]


class Multilinear(Request):
    """Straight lines between the rows, which must fill a grid of angles; the gradient jumps at the rows."""

    method: Literal["multilinear"]


Fit = Annotated[Taylor | Cubic | Multilinear, Field(discriminator="method")]
