"""Eigenvalues of the open loop over one varied quantity."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.documentation.openapi import BODY, problems
from service.limits import check_sweep
from service.presenters.eigenvalues import sweep_document
from service.schemas.eigenvalues import EigenvalueSweeps
from service.schemas.studies import EigenvalueSweepRequest
from service.state import HEAVY, SettingsHere
from service.studies.sweeps import refits, swept
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute

router = APIRouter(prefix="/v1/eigenvalue-sweeps", tags=["model"], route_class=JsonRoute)


@router.post("", response_model=EigenvalueSweeps, responses=problems(*BODY), dependencies=[HEAVY])
def eigenvalue_sweeps(request: Request, wanted: EigenvalueSweepRequest, settings: SettingsHere) -> Response:
    """Eigenvalues over a named quantity or any number of the request, at every grid point (seed Figs 2.8 to 2.13).

    Of the coupled section and of the aileron with the tab imposed: continuous branches, the share of each state, the
    stability verdict, and its mechanism: a stiffness that is not symmetric flutters without any damping.
    """
    check_sweep(wanted, refits(wanted), settings)
    return answer(request, encode(sweep_document(swept(wanted))))
