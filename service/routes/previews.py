"""Previews: a request designed, looked at and forgotten, in one call; what a moving slider asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from fastapi import APIRouter, Request, Response

from schedules.designed import DesignedEnvelope
from service.designs import controller_of, designed
from service.documentation.openapi import BODY, problems
from service.limits import check_design
from service.presenters.design import over_the_grid
from service.presenters.requirements import requirements_document
from service.routes.frequency_response import WantedResponses, frequency_responses_at
from service.routes.points import point_document
from service.routes.requirements import WantedResponse, response_at
from service.routes.root_locus import WantedLocus, root_locus_at
from service.schemas.previews import Preview, PreviewRequest, PreviewStudies
from service.settings import Settings
from service.state import ALWAYS_HEAVY, SettingsHere
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute
from service.wire.refusals import InvalidRequest, LimitExceeded

router = APIRouter(prefix="/v1/previews", tags=["designs"], route_class=JsonRoute)


@router.post("", response_model=Preview, responses=problems(*BODY, 404, 409, 503), dependencies=[ALWAYS_HEAVY])
def preview(request: Request, body: PreviewRequest, settings: SettingsHere) -> Response:
    """Design a request and answer studies of one controller with it; nothing is kept.

    Made for what changes with every move of a slider: give the gains or the weights, and a grid of one point where one
    is looked at.
    """
    with _below("/request"):
        check_design(body.request, settings)
        envelope = designed(body.request)
    name = body.controller or body.request.controllers[0].name
    document = {"design": over_the_grid(envelope), "studies": _studies(envelope, name, body, settings)}
    return answer(request, encode(document))


def _studies(envelope: DesignedEnvelope, name: str, body: PreviewRequest, settings: Settings) -> dict[str, Any]:
    makers: dict[str, Callable[[], dict[str, Any]]] = {
        "point": lambda: point_document(envelope, body.point),
        "root_locus": lambda: root_locus_at(
            envelope, name, WantedLocus(point=body.point, loop=body.loop, count=body.gains), settings
        ),
        "response": lambda: response_at(
            envelope, name, WantedResponse(point=body.point, samples=body.samples), settings
        ),
        "frequency_response": lambda: frequency_responses_at(
            envelope, name, WantedResponses(point=body.point, count=body.frequencies), settings
        ),
        "actuator_requirements": lambda: requirements_document(envelope, controller_of(envelope, name)),
    }
    return dict.fromkeys(PreviewStudies.model_fields) | {study: makers[study]() for study in body.studies}


@contextmanager
def _below(pointer: str) -> Iterator[None]:
    """Pointers of refusals from here on are of a document at this pointer of the body."""
    try:
        yield
    except (InvalidRequest, LimitExceeded) as refused:
        fields = [replace(field, pointer=pointer + field.pointer) for field in refused.fields]
        raise type(refused)(refused.detail, *fields) from refused
