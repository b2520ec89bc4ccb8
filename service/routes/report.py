"""The report of a design: one page for people."""

from __future__ import annotations

from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from service.designs import controller_of
from service.documentation.openapi import problems
from service.presenters.figures import figures_document
from service.presenters.requirements import requirements_document
from service.presenters.verification import verification_document
from service.report.page import report_page
from service.routes.designs import DesignId
from service.schemas.verification_requests import VerificationQuery
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere, SettingsHere
from service.to_domain.verification_of import check_work, proof_request, verified
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/report", tags=["designs"])

#: The page needs its own style and nothing else.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"
_PAGE: dict[int | str, dict[str, Any]] = {200: {"description": "The page", "content": {"text/html": {}}}}


class WantedReport(BaseModel):
    """What the report is to have beside what costs nothing."""

    model_config = PARAMETERS

    proof: bool = Field(default=False, description="Whether the table is to be proved between its points")


@router.get("", response_class=Response, responses=_PAGE | problems(404, 409, 422, 503), dependencies=[HEAVY])
def report(
    request: Request,
    ident: DesignId,
    wanted: Annotated[WantedReport, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Inputs, envelope, gains, verdicts, margins, requirements, proof and warnings, on a page that prints well."""
    stored, envelope = designs.find(ident), designs.envelope(ident)
    figures, demands = {}, {}
    for one in envelope.controllers:
        figures[one.request.name] = _document(figures_document(envelope, one))
        demands[one.request.name] = _document(requirements_document(envelope, one))
    proofs = None
    if wanted.proof:
        query = VerificationQuery()
        asked = proof_request(query)
        check_work(envelope.plant.grid.shape, len(envelope.controllers), query, asked, settings, "")
        found = {
            name: verified(envelope.study, envelope.plant, controller_of(envelope, name), query, asked)
            for name in figures
        }
        proofs = _document(verification_document(envelope.plant.grid, found))["controllers"]
    page = report_page(orjson.loads(stored.answer), figures, demands, proofs)
    return answer(request, page, media_type="text/html", headers={"Content-Security-Policy": POLICY})


def _document(document: dict[str, Any]) -> dict[str, Any]:
    """A document as it goes over the wire: no arrays, no numbers that do not exist."""
    found: dict[str, Any] = orjson.loads(encode(document))
    return found
