"""Aerodynamics on the wire: where hinge moments come from, and the corrections on them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from model.hinge_moments.camber import ALLOWED_SECTIONS, mean_line
from service.schemas.wire import Request, refusal


def known_section(name: str) -> str:
    """Name of a section, refused unless its mean line is known."""
    try:
        mean_line(name)
    except ValueError:
        raise refusal(f"there is no mean line for {name!a}", ALLOWED_SECTIONS) from None
    return name


class Aerodynamics(Request):
    """Source of the hinge moments, damping model and corrections."""

    source: Literal["thin_aerofoil"] = Field(description="Closed-form thin-aerofoil theory for two hinges")
    section: Annotated[str, Field(max_length=32), AfterValidator(known_section)] = Field(
        default="symmetric",
        description="Camber: `symmetric`, or a NACA section of four or five digits such as `NACA 23012`",
        examples=["NACA 23012"],
    )
    damping: Literal["thesis", "quasi_steady"] = Field(
        default="thesis", description="`thesis`: equations 2.2.12 and 2.2.13; `quasi_steady`: thin-aerofoil rates"
    )
    virtual_inertia: bool = Field(default=False, description="Add the inertia of the air moved by the surfaces")
    compressibility: Literal["none", "prandtl_glauert"] = Field(
        default="none", description="Correction of the hinge-moment coefficients for Mach number"
    )
