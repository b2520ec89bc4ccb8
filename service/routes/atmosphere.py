"""The standard atmosphere."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from model.atmosphere import standard_atmosphere
from service.documentation.openapi import problems
from service.schemas.air import Air
from service.schemas.flight import Altitude, TemperatureOffset
from service.schemas.wire import PARAMETERS
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/atmosphere", tags=["air"])


class Altitudes(BaseModel):
    """Where the air is wanted."""

    model_config = PARAMETERS

    altitude_m: Annotated[list[Altitude], Field(min_length=1, max_length=1000)] = Field(
        description="Geopotential altitude; repeat it for arrays", examples=[[11000.0]]
    )
    temperature_offset_k: TemperatureOffset = Field(default=0.0, description="Added to the standard temperature")


@router.get("", response_model=Air, responses=problems(422))
def atmosphere(request: Request, at: Annotated[Altitudes, Query()]) -> Response:
    """International Standard Atmosphere (ISO 2533) at one geopotential altitude or at several."""
    several = len(at.altitude_m) > 1
    altitude = np.array(at.altitude_m) if several else at.altitude_m[0]
    air = standard_atmosphere(altitude, at.temperature_offset_k)
    document = {
        "altitude_m": air.altitude,
        "temperature_k": air.temperature,
        "pressure_pa": air.pressure,
        "density_kg_m3": air.density,
        "speed_of_sound_m_s": air.speed_of_sound,
        "dynamic_viscosity_pa_s": air.dynamic_viscosity,
    }
    return answer(request, encode(document))
