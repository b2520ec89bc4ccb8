"""Similarity: what the dynamics depend on over a grid."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.documentation.openapi import BODY, problems
from service.limits import check_plant
from service.presenters.similarity import similarity_document
from service.schemas.similarity import Similarity
from service.schemas.studies import SimilarityRequest
from service.state import HEAVY, SettingsHere
from service.studies.plant import similarity as similarity_of
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute

router = APIRouter(prefix="/v1/similarity", tags=["model"], route_class=JsonRoute)


@router.post("", response_model=Similarity, responses=problems(*BODY), dependencies=[HEAVY])
def similarity(request: Request, wanted: SimilarityRequest, settings: SettingsHere) -> Response:
    """The non-dimensional model, and which of frequency and damping depend on dynamic pressure, density and airspeed.

    Whether a schedule in dynamic pressure alone suffices for the grid, with the damping error it would make; and a
    measured servo-tab scaled to this section and grid (seed 4.4, 7.6).
    """
    check_plant(wanted, settings)
    return answer(request, encode(similarity_document(similarity_of(wanted))))
