"""The grid part of a design alone: linear models over the envelope, no controllers."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.designs import analysed
from service.documentation.openapi import BODY, problems
from service.limits import check_plant
from service.presenters.grid import air_document, grid_document, outcome_documents, warning_documents
from service.presenters.hinge_moments import fit_document
from service.presenters.plant import plant_document
from service.schemas.point import LinearModels
from service.schemas.requests import LinearModelsRequest
from service.state import HEAVY, SettingsHere
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute

router = APIRouter(prefix="/v1/linear-models", tags=["model"], route_class=JsonRoute)


@router.post("", response_model=LinearModels, responses=problems(*BODY), dependencies=[HEAVY])
def linear_models(request: Request, wanted: LinearModelsRequest, settings: SettingsHere) -> Response:
    """Hinge moments, trim, linear model, poles and servo-tab at every grid point. Nothing is kept."""
    check_plant(wanted, settings)
    plant = analysed(wanted)
    document = {
        "grid": grid_document(plant.grid),
        "air": air_document(plant.grid.condition),
        **outcome_documents(plant.outcomes),
        "warnings": warning_documents(plant.warnings),
        "hinge_moment_fit": fit_document(plant.system.aerodynamics.source),
        "points": [plant_document(plant, point) for point in range(plant.outcomes.codes.size)],
    }
    return answer(request, encode(document))
