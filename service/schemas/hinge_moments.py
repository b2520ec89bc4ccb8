"""Answers about hinge moments alone."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.wire import Answer


class Derivatives(Answer):
    """Coefficients at the angles `about` and their derivatives there; angles relative, trailing edge up, in radians."""

    C_Ha_0: float
    C_Ha_alpha: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ha_da: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ha_dt: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_0: float
    C_Ht_alpha: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_da: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_dt: float = Field(json_schema_extra={"unit": "1/rad"})


class StateMoments(Answer):
    """Coefficients at one state, restoring, by chord squared and unit span; pressure is lower minus upper.

    Null where the angles lie outside the rows of a table.
    """

    C_Ha: float | None
    C_Ht: float | None
    pressure_difference: list[float] | None
    covered: bool


class FitError(Answer):
    """Error of one coefficient; null when nothing could be compared."""

    max: float | None
    rms: float | None
    range: float
    max_percent_of_range: float | None = Field(json_schema_extra={"unit": "%"})
    rms_percent_of_range: float | None = Field(json_schema_extra={"unit": "%"})


class FittedRows(Answer):
    """What became of the rows of a table.

    `dropped` lack a coefficient, `averaged` repeat the angles of another row and are averaged with it: the
    disagreement is the largest distance from the average.
    """

    given: int
    used: int
    outside_window: int
    dropped: int
    averaged: int
    C_Ha_disagreement: float
    C_Ht_disagreement: float


class HingeMomentFit(Answer):
    """How well a fit represents its table.

    Errors are fit minus row (`residual`); an interpolant has none at its rows, so each row that lies between others is
    left out in turn and predicted from the rest (`left_out`).
    """

    method: Literal["taylor", "cubic", "multilinear"]
    errors: Literal["residual", "left_out"]
    C_Ha: FitError
    C_Ht: FitError
    rows: FittedRows
    domain: str
    notes: list[str]


class HingeMoments(Answer):
    """Coefficients of the section, and at each state asked for; derivatives are null outside the rows of a table."""

    derivatives: Derivatives | None
    reason: str | None
    states: list[StateMoments]
    hinge_moment_fit: HingeMomentFit | None
