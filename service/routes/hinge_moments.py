"""Hinge moments of a section, without air and without a grid."""

from __future__ import annotations

from math import radians
from typing import Any

import numpy as np
from fastapi import APIRouter, Request, Response

from model.arrays import FloatArray
from model.hinge_moments.expansion import Angles, HingeMomentSource
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from service.documentation.openapi import BODY, problems
from service.limits import check_table
from service.presenters.hinge_moments import derivatives, fit_document
from service.schemas.hinge_moments import HingeMoments
from service.schemas.requests import HingeMomentsRequest
from service.state import HEAVY, SettingsHere
from service.to_domain.source_of import hinge_moment_source
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute

router = APIRouter(prefix="/v1/hinge-moments", tags=["model"], route_class=JsonRoute)


@router.post("", response_model=HingeMoments, responses=problems(*BODY), dependencies=[HEAVY])
def hinge_moments(request: Request, wanted: HingeMomentsRequest, settings: SettingsHere) -> Response:
    """Coefficients and derivatives of a section, and the pressure difference along its chord.

    Restoring and trailing edge up: divided by dynamic pressure, chord squared and unit span. Incompressible. From
    theory, from given derivatives, or from a table, whose fit is judged in the answer.
    """
    check_table(wanted.aerodynamics, settings)
    about = Angles(
        *(radians(angle) for angle in (wanted.about.alpha_deg, wanted.about.tab_deg, wanted.about.aileron_deg))
    )
    source = hinge_moment_source(wanted.aerodynamics, wanted.geometry, about)
    known = bool(source.covers(about.alpha, about.dt, about.da))
    angles = [
        np.deg2rad([getattr(state, name) for state in wanted.states])
        for name in ("alpha_deg", "tab_deg", "aileron_deg")
    ]
    document = {
        "derivatives": derivatives(source.at(about.alpha, about.dt, about.da)) if known else None,
        "reason": None if known else f"the angles `about` lie outside the hinge-moment data: {source.domain}",
        "states": _states(source, wanted, angles),
        "hinge_moment_fit": fit_document(source),
    }
    return answer(request, encode(document))


def _states(source: HingeMomentSource, wanted: HingeMomentsRequest, angles: list[FloatArray]) -> list[dict[str, Any]]:
    """Coefficients at each state, in the order asked for; null where the source knows nothing."""
    alpha, dt, da = angles
    covered = source.covers(alpha, dt, da)
    value = np.where(covered[:, None], source.at(alpha, dt, da).value, np.nan)
    pressure: list[FloatArray] | list[None] = [None] * len(wanted.states)
    if wanted.chordwise is not None and isinstance(source, ThinAerofoil):
        pressure = list(source.pressure_difference(np.array(wanted.chordwise), alpha, dt, da))
    return [
        {"C_Ha": aileron, "C_Ht": tab, "pressure_difference": load, "covered": known}
        for (tab, aileron), load, known in zip(value.tolist(), pressure, covered.tolist(), strict=True)
    ]
