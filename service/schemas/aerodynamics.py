"""Aerodynamics on the wire: where hinge moments come from, and the corrections on them."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, Tag, model_validator

from model.hinge_moments.camber import ALLOWED_SECTIONS, mean_line
from model.hinge_moments.mean_line_table import MAX_POINTS, mean_line_of_points
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.hinge_tables import CsvText, Fit, Rows, Taylor, WhereRows
from service.schemas.wire import Request, refusal

Coefficient = Annotated[float, Field(ge=-100.0, le=100.0)]
Slope = Annotated[float, Field(ge=-1000.0, le=1000.0, json_schema_extra={"unit": "1/rad"})]
ReferenceAngle = Annotated[float, Field(ge=-60.0, le=60.0)]


def known_section(name: str) -> str:
    """Name of a section, refused unless its mean line is known."""
    try:
        mean_line(name)
    except ValueError:
        raise refusal(f"there is no mean line for {name!a}", ALLOWED_SECTIONS) from None
    return name


def smooth_mean_line(points: list[list[float]]) -> list[list[float]]:
    """Points of a mean line, refused unless a smooth line from the leading to the trailing edge goes through them."""
    x, z = np.array(points).T
    try:
        mean_line_of_points(x, z)
    except ValueError as error:
        raise refusal(str(error), f"4 to {MAX_POINTS} points [x, z], x increasing from 0 to 1, z within 0.5") from None
    return points


Ordinate = Annotated[float, Field(ge=-1.0, le=1.0)]
MeanLinePoint = Annotated[list[Ordinate], Field(min_length=2, max_length=2)]
SectionName = Annotated[str, Field(max_length=32), AfterValidator(known_section), Tag("string")]
MeanLinePoints = Annotated[
    list[MeanLinePoint],
    Field(min_length=4, max_length=MAX_POINTS),
    AfterValidator(smooth_mean_line),
    Tag("array"),
]


class Corrections(Request):
    """What every source of hinge moments has beside it: damping model and corrections."""

    damping: Literal["thesis", "quasi_steady", "unsteady"] = Field(
        default="thesis",
        description="`thesis`: equations 2.2.12 and 2.2.13; `quasi_steady`: thin-aerofoil rates; `unsteady`: "
        "Theodorsen's lag in Jones's approximation, two more states",
    )
    virtual_inertia: bool = Field(default=False, description="Add the inertia of the air moved by the surfaces")
    compressibility: Literal["none", "prandtl_glauert"] = Field(
        default="none", description="Correction of the hinge-moment coefficients for Mach number"
    )


class ThinAerofoil(Corrections):
    """Closed-form thin-aerofoil theory for two hinges."""

    source: Literal["thin_aerofoil"] = Field(description="Closed-form thin-aerofoil theory for two hinges")
    section: Annotated[SectionName | MeanLinePoints, BY_JSON_TYPE] = Field(
        default="symmetric",
        description="Camber: `symmetric`, a NACA section of four or five digits such as `NACA 23012`, or the mean "
        "line as points `[x, z]` in fractions of the chord",
        examples=["NACA 23012"],
    )


class ReferenceAngles(Request):
    """Angles that given coefficients belong to."""

    alpha_deg: ReferenceAngle = 0.0
    aileron_deg: ReferenceAngle = 0.0
    tab_deg: ReferenceAngle = 0.0


class Derivatives(Corrections):
    """Given numbers: ``C_H = C_H_0 + C_H_alpha alpha + C_H_da da + C_H_dt dt``, angles from the reference ones.

    Restoring, by wing chord squared and unit span, trailing edge up, the tab relative to the aileron.
    """

    source: Literal["derivatives"] = Field(description="Eight numbers: coefficients and their derivatives per radian")
    C_Ha_0: Coefficient = Field(description="Aileron's coefficient at the reference angles")
    C_Ha_alpha: Slope
    C_Ha_da: Slope
    C_Ha_dt: Slope
    C_Ht_0: Coefficient = Field(description="Tab's coefficient at the reference angles")
    C_Ht_alpha: Slope
    C_Ht_da: Slope
    C_Ht_dt: Slope
    reference: ReferenceAngles = Field(
        default_factory=ReferenceAngles, description="Angles at which `C_Ha_0` and `C_Ht_0` hold"
    )


class Table(Corrections):
    """Rows of measured or computed coefficients, and how they are fitted."""

    source: Literal["table"] = Field(description="Rows from a wind tunnel, Xfoil or another flow computation")
    rows: Rows | None = Field(
        default=None,
        description="Rows `[alpha_deg, aileron_deg, tab_deg, C_Ha, C_Ht]`, or objects with these fields, in any order; "
        "a coefficient may be null. Restoring, by wing chord squared and unit span, trailing edge up, the tab relative "
        "to the aileron. Give either `rows` or `csv`",
    )
    csv: CsvText | None = Field(
        default=None,
        description="The rows as comma-separated text with a header line: `alpha_deg`, `da_deg` (or `da_up_deg`), "
        "`dt_deg` (or `dt_up_rel_deg`), `C_Ha`, `C_Ht`; other columns and lines that begin with `#` are passed over",
    )
    where: WhereRows = Field(
        default_factory=dict,
        description="Rows of `csv` to take, by the value of other columns",
        json_schema_extra={"unit": "that of the column"},
    )
    fit: Fit = Field(default=Taylor(method="taylor"), description="How the rows are fitted; order 1 by default")

    @model_validator(mode="after")
    def one_table(self) -> Self:
        """Refuse no table, two of them, or a choice among rows that have no other columns."""
        given = [name for name in ("rows", "csv") if getattr(self, name) is not None]
        if len(given) != 1:
            raise refusal(f"a table is given once, not {len(given)} times", "one of rows, csv", at="/rows")
        if self.where and self.csv is None:
            raise refusal("rows are chosen by the columns of `csv` only", "an empty object with `rows`", at="/where")
        return self


Aerodynamics = Annotated[ThinAerofoil | Derivatives | Table, Field(discriminator="source")]
