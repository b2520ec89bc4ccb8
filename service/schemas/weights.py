"""Weights of a quadratic regulator on the wire: by Bryson's rule, or the matrices themselves."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.wire import Request

LargestAngle = Annotated[float, Field(ge=1e-6, le=1e6)]
LargestTorque = Annotated[float, Field(ge=1e-9, le=1e9)]
Entry = Annotated[float, Field(ge=-1e12, le=1e12)]


class BrysonWeights(Request):
    """Largest acceptable value of each state, integral and input: ``Q = diag(1/max^2)``, ``R = diag(1/max^2)``."""

    rule: Literal["bryson"]
    aileron_deg: LargestAngle
    aileron_rate_deg_s: LargestAngle
    tab_deg: LargestAngle
    tab_rate_deg_s: LargestAngle
    aileron_integral_deg_s: LargestAngle = Field(
        description="Integral of the aileron's error, in degrees times seconds", json_schema_extra={"unit": "deg s"}
    )
    tab_torque_n_m: LargestTorque
    aileron_torque_n_m: LargestTorque


class ExplicitWeights(Request):
    """The matrices of the cost ``x'Qx + u'Ru + 2x'Nu``, in SI and radians."""

    rule: Literal["explicit"]
    Q: Annotated[list[list[Entry]], Field(min_length=5, max_length=5)] = Field(
        description="5 x 5, states in the order dt dt_rate da da_rate int_a", json_schema_extra={"unit": "SI"}
    )
    R: Annotated[list[list[Entry]], Field(min_length=2, max_length=2)] = Field(
        description="2 x 2, inputs in the order T_t T_a", json_schema_extra={"unit": "SI"}
    )
    N: Annotated[list[list[Entry]], Field(min_length=5, max_length=5)] | None = Field(
        default=None, description="5 x 2; null for none", json_schema_extra={"unit": "SI"}
    )
