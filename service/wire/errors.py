"""Errors on the wire: one table from exception to status, one shape (RFC 9457), no traceback and no path."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

import orjson
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match

from service.wire import refusals
from service.wire.pointers import field_refusal
from service.wire.refusals import FieldRefusal

MEDIA_TYPE = "application/problem+json"
#: A body can hold a hundred thousand wrong numbers; the answer names the first of them.
MAX_FIELDS = 50

#: Exception -> status, code, title. The one place where a refusal meets HTTP.
STATUS: dict[type[Exception], tuple[int, str, str]] = {
    refusals.UnreadableBody: (400, "unreadable_body", "The body cannot be read"),
    refusals.Unauthenticated: (401, "unauthenticated", "A key is needed"),
    refusals.NotAllowed: (403, "not_allowed", "The key does not allow this"),
    refusals.NotFound: (404, "not_found", "There is no such thing here"),
    refusals.NotAcceptable: (406, "not_acceptable", "The answer has no form that the client takes"),
    refusals.NoDesignAtPoint: (409, "no_design_at_point", "The controller has no gains at this point"),
    refusals.StudyNotPossible: (409, "study_not_possible", "The study is not possible for this controller"),
    refusals.StaleDesign: (409, "stale_design", "The design was made by another version"),
    refusals.RepeatedTooSoon: (409, "repeated_too_soon", "The same request is being answered"),
    refusals.NoResult: (409, "no_result", "The job has no result"),
    refusals.BodyTooLarge: (413, "body_too_large", "The body is too large"),
    refusals.QuotaExceeded: (413, "quota_exceeded", "The owner has stored as much as the key allows"),
    refusals.UnsupportedMediaType: (415, "unsupported_media_type", "The body is not declared as JSON"),
    refusals.InvalidRequest: (422, "invalid_request", "The request cannot be taken"),
    refusals.LimitExceeded: (422, "limit_exceeded", "The request asks for more than this server does"),
    refusals.RepeatedDifferently: (422, "repeated_differently", "The Idempotency-Key is not of this request"),
    refusals.TooManyRequests: (429, "too_many_requests", "Too many requests"),
    refusals.QueueFull: (429, "queue_full", "Too many jobs wait"),
    refusals.NotReady: (503, "not_ready", "The server cannot work now"),
    refusals.Overloaded: (503, "overloaded", "The server has more to compute than it can"),
    refusals.StoreUnavailable: (503, "store_unavailable", "The store of designs does not answer"),
}

#: Statuses that the framework itself answers with.
FRAMEWORK_CODES = {404: "not_found", 405: "method_not_allowed", 500: "internal_error"}

log = logging.getLogger("gainfield")


def problem(status: int, code: str, title: str, detail: str, fields: Sequence[FieldRefusal] = ()) -> dict[str, Any]:
    """A problem document."""
    return {
        "type": f"urn:gainfield:problem:{code}",
        "title": title,
        "status": status,
        "detail": detail,
        "code": code,
        "errors": [{"pointer": f.pointer, "detail": f.detail, "unit": f.unit, "allowed": f.allowed} for f in fields],
    }


def problem_response(document: dict[str, Any], headers: dict[str, str] | None = None) -> Response:
    """The answer that carries a problem document."""
    return Response(
        orjson.dumps(_unicode(document)), status_code=document["status"], media_type=MEDIA_TYPE, headers=headers
    )


def refusal_response(refusal: refusals.Refusal) -> Response:
    """The answer to a refusal, by the table."""
    return problem_response(problem(*STATUS[type(refusal)], refusal.detail, refusal.fields), _headers(refusal))


def _headers(refusal: refusals.Refusal) -> dict[str, str]:
    """What a client reads of a refusal without its body."""
    headers = {} if refusal.wait is None else {"Retry-After": str(refusal.wait)}
    if isinstance(refusal, refusals.Unauthenticated):
        headers["WWW-Authenticate"] = 'Bearer realm="gainfield"'
    if isinstance(refusal, refusals.TooManyRequests) and refusal.allowance is not None:
        headers |= rate_headers(*refusal.allowance)
    return headers


def rate_headers(limit: int, left: int, wait: int) -> dict[str, str]:
    """What is left of a rate: requests in a minute, of these left, and until there are more [s]."""
    return {"RateLimit-Policy": f'"minute";q={limit};w=60', "RateLimit": f'"minute";r={left};t={wait}'}


def install(app: FastAPI) -> None:
    """Answer every error of the app with a problem document."""
    app.add_exception_handler(RequestValidationError, _validation)
    app.add_exception_handler(HTTPException, _framework)
    app.add_exception_handler(Exception, _internal)
    app.add_exception_handler(refusals.Refusal, _refusal)


async def _refusal(request: Request, error: Exception) -> Response:
    assert isinstance(error, refusals.Refusal)
    return refusal_response(error)


async def _validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    openapi = request.app.openapi()
    operation = openapi["paths"][request.scope["route"].path_format][request.method.lower()]
    found = error.errors()
    fields = [field_refusal(one, openapi, operation) for one in found[:MAX_FIELDS]]
    first = f"{fields[0].pointer or 'the body'}: {fields[0].detail}"
    rest = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return refusal_response(refusals.InvalidRequest(first + rest, *fields))


async def _framework(request: Request, error: Exception) -> Response:
    """404 and 405 of the router, in the same shape as ours."""
    assert isinstance(error, HTTPException)
    code = FRAMEWORK_CODES.get(error.status_code, "http_error")
    title = HTTPStatus(error.status_code).phrase
    headers = dict(error.headers or {})
    if error.status_code == 405:
        headers["Allow"] = ", ".join(_methods(request))
    return problem_response(problem(error.status_code, code, title, str(error.detail)), headers)


def _methods(request: Request) -> list[str]:
    """Methods that any route takes at this path: the router names those of the first one alone."""
    routes, here = request.app.routes, request.scope
    taken = [
        method
        for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
        if any(route.matches({**here, "method": method})[0] is Match.FULL for route in routes)
    ]
    return taken or ["GET"]  # below what is mounted no route is found: files, which are read


async def _internal(request: Request, error: Exception) -> Response:
    """A fault of ours: the traceback goes to the log, the client learns only that it is not theirs."""
    log.error("unhandled error at %s %s", request.method, request.url.path, exc_info=error)
    detail = "the server failed on this request; the failure is in its log"
    return problem_response(problem(500, "internal_error", "Internal error", detail))


def _unicode(value: Any) -> Any:
    """The same document with lone surrogates, which no JSON answer can carry, replaced."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode()
    if isinstance(value, dict):
        return {key: _unicode(item) for key, item in value.items()}
    return [_unicode(item) for item in value] if isinstance(value, list) else value
