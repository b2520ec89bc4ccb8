"""Hinge moments of a section, without air and without a grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from fastapi import APIRouter, Request, Response

from model.aerodynamics import Aerodynamics
from model.arrays import FloatArray
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from service.answering import answer, encode
from service.openapi import BODY, problems
from service.presenters.hinge_moments import derivatives
from service.reading import JsonRoute
from service.schemas.hinge_moments import HingeMoments
from service.schemas.requests import HingeMomentsRequest
from service.study_of import aerodynamic_model

router = APIRouter(prefix="/v1/hinge-moments", tags=["model"], route_class=JsonRoute)


@router.post("", response_model=HingeMoments, responses=problems(*BODY))
def hinge_moments(request: Request, wanted: HingeMomentsRequest) -> Response:
    """Coefficients and derivatives of a section, and the pressure difference along its chord.

    Restoring and trailing edge up: divided by dynamic pressure, chord squared and unit span. Incompressible.
    """
    aerodynamics = aerodynamic_model(wanted.aerodynamics, wanted.geometry)
    rest = aerodynamics.source.at(0.0, 0.0, 0.0)
    angles = [
        np.deg2rad([getattr(state, name) for state in wanted.states])
        for name in ("alpha_deg", "tab_deg", "aileron_deg")
    ]
    return answer(request, encode({"derivatives": derivatives(rest), "states": _states(aerodynamics, wanted, angles)}))


def _states(aerodynamics: Aerodynamics, wanted: HingeMomentsRequest, angles: list[FloatArray]) -> list[dict[str, Any]]:
    """Coefficients at each state, in the order asked for."""
    alpha, dt, da = angles
    value = aerodynamics.source.at(alpha, dt, da).value
    pressure: list[FloatArray] | list[None] = [None] * len(wanted.states)
    if wanted.chordwise is not None and isinstance(aerodynamics.source, ThinAerofoil):
        pressure = list(aerodynamics.source.pressure_difference(np.array(wanted.chordwise), alpha, dt, da))
    return [
        {"C_Ha": aileron, "C_Ht": tab, "pressure_difference": load}
        for (tab, aileron), load in zip(value.tolist(), pressure, strict=True)
    ]
