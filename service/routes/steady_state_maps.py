"""Statics of the section over the plane of deflections."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.documentation.openapi import BODY, problems
from service.limits import check_map
from service.presenters.statics import statics_document
from service.schemas.statics import SteadyStateMaps
from service.schemas.studies import SteadyStateMapRequest
from service.state import HEAVY, SettingsHere
from service.studies.plant import steady_states
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute

router = APIRouter(prefix="/v1/steady-state-maps", tags=["model"], route_class=JsonRoute)


@router.post("", response_model=SteadyStateMaps, responses=problems(*BODY), dependencies=[HEAVY])
def steady_state_maps(request: Request, wanted: SteadyStateMapRequest, settings: SettingsHere) -> Response:
    """Hinge moments of both surfaces over aileron and tab angle, and the equilibria in that plane.

    At every grid point: the lines of zero aileron torque, zero tab torque and least total torque; what a tab alone
    does with the aileron: the tab angle for a wanted aileron angle with its torque, the float angle, and the range of
    aileron angles within the limits.
    """
    check_map(wanted, settings)
    return answer(request, encode(statics_document(steady_states(wanted))))
