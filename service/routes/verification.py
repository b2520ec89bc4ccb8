"""Proof between the grid points: of a design's controllers, their certificates, and of any uploaded table."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response

from schedules.proof.certificate import to_document
from schedules.proof.prove import prove
from service.designs import controller_of
from service.documentation.openapi import BODY, problems
from service.presenters.verification import verification_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.verification_answers import UploadedVerification, Verification
from service.schemas.verification_requests import CertificateQuery, VerificationQuery, VerificationRequest
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.to_domain.verification_of import (
    answerable,
    check_work,
    origin_of,
    proof_request,
    uploaded_of,
    uploaded_origin,
    verified,
)
from service.wire.answering import answer, download_headers, encode
from service.wire.reading import JsonRoute
from service.wire.refusals import StudyNotPossible

router = APIRouter(prefix="/v1", tags=["verification"], route_class=JsonRoute)

_CERTIFICATE: dict[int | str, dict[str, Any]] = {
    200: {"description": "The certificate, as an attachment", "content": {"application/json": {}}}
}


@router.get(
    "/designs/{id}/verification",
    response_model=Verification,
    responses=problems(404, 409, 422, 503),
    dependencies=[ALWAYS_HEAVY],
)
def verification(
    request: Request,
    ident: DesignId,
    wanted: Annotated[VerificationQuery, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Every cell between the grid points: proved to decay, refuted at a point that is named, or neither.

    What is proved holds for all altitudes and speeds of a cell and however they move inside it, of the model or of
    plants that are off. Loops that cannot be proved (delays, code, virtual inertia) are sampled, and say why.
    """
    envelope, asked = designs.envelope(ident), proof_request(wanted)
    if wanted.controller is None:
        controllers = list(envelope.controllers)
    else:
        controllers = [controller_of(envelope, name) for name in dict.fromkeys(wanted.controller)]
    check_work(envelope.plant.grid.shape, len(controllers), wanted, asked, settings, "/pieces")
    found = {
        one.request.name: verified(envelope.study, envelope.plant, one, wanted, asked) for one in controllers
    }  # fmt: skip
    return answer(request, encode(verification_document(envelope.plant.grid, found)))


@router.get(
    "/designs/{id}/controllers/{name}/certificate",
    response_class=Response,
    responses=_CERTIFICATE | problems(404, 409, 422, 503),
    dependencies=[ALWAYS_HEAVY],
)
def certificate(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[CertificateQuery, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """The proof itself: gains, plant matrices, and each piece's box, rate and Lyapunov matrix.

    `python -m schedules.verify FILE` checks it with numpy alone, and with the `table_sha256` of a schedule file's
    summary that it is of that table. Refused (409) where no cell is proved.
    """
    envelope, asked = designs.envelope(ident), proof_request(wanted)
    controller = controller_of(envelope, name)
    check_work(envelope.plant.grid.shape, 1, wanted, asked, settings, "/pieces")
    proof = answerable(lambda: prove(envelope.study, envelope.plant, controller, asked))
    if proof.summary.proved == 0:
        raise StudyNotPossible(f"controller {name}: nothing to certify, {proof.summary.words}")
    headers = download_headers(envelope.study.name, name, "certificate", suffix="json")
    return answer(request, encode(to_document(proof, origin_of(designs, ident))), headers=headers)


@router.post(
    "/schedules/verify",
    response_model=UploadedVerification,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def verify_schedule(
    request: Request, body: VerificationRequest, designs: DesignsHere, settings: SettingsHere
) -> Response:
    """Any table of gains against a plant: proved or refuted cell by cell, on the table's own axes.

    The table is a list of axes and gains, or a schedule file of this product as it is; what a file says of a proof has
    no part. Its gains are taken as they are:
    a table that does not hold is refuted, at a point that is named.
    """
    asked = proof_request(body.proof, "/proof")
    check_work(body.schedule.shape, 1, body.proof, asked, settings, "/proof/pieces")
    uploaded = uploaded_of(body, designs, settings)
    designed = uploaded.designed
    found = verified(uploaded.study, uploaded.plant, designed, body.proof, asked)
    document = verification_document(uploaded.plant.grid, {designed.request.name: found})
    certified = body.certificate and found.proof.summary.proved > 0
    made = to_document(found.proof, uploaded_origin(body)) if certified else None
    return answer(request, encode(document | {"certificate": made}))
