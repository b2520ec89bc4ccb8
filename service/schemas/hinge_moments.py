"""Answers about hinge moments alone."""

from __future__ import annotations

from pydantic import Field

from service.schemas.wire import Answer


class Derivatives(Answer):
    """Coefficients at rest and their derivatives; angles relative, trailing edge up, in radians."""

    C_Ha_0: float
    C_Ha_alpha: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ha_da: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ha_dt: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_0: float
    C_Ht_alpha: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_da: float = Field(json_schema_extra={"unit": "1/rad"})
    C_Ht_dt: float = Field(json_schema_extra={"unit": "1/rad"})


class StateMoments(Answer):
    """Coefficients at one state, restoring, by chord squared and unit span; pressure is lower minus upper."""

    C_Ha: float
    C_Ht: float
    pressure_difference: list[float] | None


class HingeMoments(Answer):
    """Coefficients of the section, and at each state asked for."""

    derivatives: Derivatives
    states: list[StateMoments]
