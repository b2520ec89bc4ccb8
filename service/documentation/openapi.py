"""The OpenAPI document: problem answers of every route, and examples that run as they stand."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from pydantic.json_schema import models_json_schema

from service.access.door import OPEN
from service.documentation.answer_examples import example_answer
from service.documentation.body_examples import BODIES
from service.documentation.curl_lines import curl_line
from service.documentation.design_examples import design_requests
from service.documentation.operation_titles import GROUPS, TITLES
from service.documentation.symbols import describe_symbols
from service.http.repeats import HEADER, LONGEST_KEY
from service.schemas.jobs import Job
from service.schemas.problem import FieldProblem, Problem
from service.wire.errors import MEDIA_TYPE, STATUS, problem
from service.wire.refusals import FieldRefusal
from service.wire.units import state_units

#: What a route that reads a body may refuse it for.
BODY = (400, 413, 415, 422)
_PROBLEM = {"$ref": "#/components/schemas/Problem"}
#: Where an operation keeps the name of the design request that it is shown with, until the document is complete.
_EXAMPLE = "x-example"
_FIELD = FieldRefusal("/geometry/chord_m", "must be greater than or equal to 0.001", "m", ">= 0.001 and <= 100")
_DETAILS = {
    400: "the body is not JSON: Expecting ',' delimiter at line 3, column 1",
    404: "there is no design 0123456789abcdef0123456789abcdef",
    409: "the controller pf has no gains at point 3: infeasible; gain margin is asked to be at least 6 dB",
    413: "the body has more than 1048576 bytes, the limit max_body_bytes of this server",
    415: "the body is declared as 'text/plain'; send JSON with the header Content-Type: application/json",
    422: "/geometry/chord_m: must be greater than or equal to 0.001",
    401: "this server asks for a key: Authorization: Bearer gf_<id>_<secret>, or X-API-Key",
    403: "this needs a key of scope write; the key shown has scope read",
    406: "Accept: none of the media types of 'text/html' is one of this answer",
    429: "100 jobs wait, the limit max_queued_jobs of this server (setting GAINFIELD_MAX_QUEUED_JOBS)",
    503: "the store does not answer: OperationalError",
}

DESCRIPTION = """
Gain-scheduled flight-envelope design for tab-aileron control: post a design request, read gains, root loci
and actuator requirements, download the gain schedule.

Angles are in degrees and every dimensional field ends in its unit; gains are in SI and radians and carry theirs.
Deflections are positive trailing edge up, the tab's angle is relative to the aileron, and `u = -K x`.
Errors are problem documents (RFC 9457) that name the field, its unit and what is allowed there.

The lines for a shell run as they stand once `GAINFIELD` holds this server's address, and the shipped example is posted:
the first line of *Designs* does that. Answers are shown with their lists cut short.
"""


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route that may refuse a request with these statuses."""
    return {status: _documented(status) for status in statuses}


def job_answers() -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route whose work may become a job."""
    described = "A job does the work: `Prefer: respond-async` asked for it, or it is above a limit of the work in line"
    return {202: {"model": Job, "description": described}, **problems(429, 503)}


def shown_with(example: str) -> dict[str, Any]:
    """The `openapi_extra` of a route below a design that is shown with another example than the first."""
    return {_EXAMPLE: example}


def _documented(status: int) -> dict[str, Any]:
    titles = {code: title for number, code, title in STATUS.values() if number == status}
    code, title = next(iter(titles.items()))
    shown = problem(status, code, title, _DETAILS[status], [_FIELD] if status == 422 else [])
    return {
        "description": f"{HTTPStatus(status).phrase}: `{'`, `'.join(titles)}`",
        "content": {MEDIA_TYPE: {"schema": _PROBLEM, "example": shown}},
    }


def install(
    app: FastAPI, first_example: str, example_id: Callable[[str], str], example_job: Callable[[], str], keys: bool
) -> None:
    """Complete the document of the app.

    `example_id` is the id that the design request of an example gets, `example_job` that of the job that routes of jobs
    are shown with.

    `keys` is whether the server asks for keys.
    Routes below a design are shown with the first example, or the one that `shown_with` says.
    """
    plain = app.openapi
    marks = {"job": example_job} | {f"design {name}": partial(example_id, name) for name in design_requests()}

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            document = plain()
            _, definitions = models_json_schema(
                [(Problem, "serialization"), (FieldProblem, "serialization")],
                ref_template="#/components/schemas/{model}",
            )
            schemas = document["components"]["schemas"]
            schemas.update(definitions["$defs"])
            for unused in ("HTTPValidationError", "ValidationError"):
                schemas.pop(unused, None)
            for path, operations in document["paths"].items():
                for method, operation in operations.items():
                    _common_refusals(method, operation)
                    if keys and path not in OPEN:
                        _secure(operation)
                    of_jobs = path.startswith("/v1/jobs")
                    shown = example_job() if of_jobs else example_id(operation.pop(_EXAMPLE, first_example))
                    _complete(path, method, operation, shown)
                    _present(path, method, operation, keys, marks)
            document["tags"] = [{"name": name, "description": words} for name, words in GROUPS.items()]
            for schema in schemas.values():
                describe_symbols(schema)
            if keys:
                document["components"]["securitySchemes"] = _SCHEMES
        return app.openapi_schema or {}

    app.openapi = openapi  # type: ignore[method-assign]


#: How a client shows its key.
_SCHEMES = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "A key `gf_<id>_<secret>`"},
    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": "The same key"},
}
_IDEMPOTENCY = {
    "name": HEADER,
    "in": "header",
    "required": False,
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY, "title": HEADER},
    "description": "Sent again with the same key within 24 h, the request is answered as the first time",
}


def _common_refusals(method: str, operation: dict[str, Any]) -> None:
    """What any route may refuse: an answer in no form that the client takes; a repeated POST, a POST too many."""
    responses = operation["responses"]
    responses.setdefault("406", _documented(406))
    responses.setdefault("429", _documented(429))
    if method == "post":
        operation.setdefault("parameters", []).append(_IDEMPOTENCY)
        responses.setdefault("409", _documented(409))


def _secure(operation: dict[str, Any]) -> None:
    """What a route answers when keys are asked for."""
    operation["security"] = [{name: []} for name in _SCHEMES]
    for status in (401, 403):
        operation["responses"].setdefault(str(status), _documented(status))


def _complete(path: str, method: str, operation: dict[str, Any], example_id: str) -> None:
    """Examples of bodies and parameters, units of parameters, and the answer to a conditional GET."""
    if method == "get":
        operation["responses"]["304"] = {"description": "Not modified: the client's `If-None-Match` names this answer"}
    parameters = operation.get("parameters", [])
    state_units({"properties": {parameter["name"]: parameter["schema"] for parameter in parameters}})
    for parameter in parameters:
        if parameter["name"] == "id":
            parameter["example"] = example_id
    # The framework declares its own 422 where no parameter of ours can be refused.
    if MEDIA_TYPE not in operation["responses"].get("422", {}).get("content", {MEDIA_TYPE: None}):
        del operation["responses"]["422"]
    if "requestBody" in operation:
        operation["requestBody"]["content"]["application/json"]["examples"] = BODIES[path]()


def _present(
    path: str, method: str, operation: dict[str, Any], keys: bool, marks: dict[str, Callable[[], str]]
) -> None:
    """Group and title of the operation, the answer to its example, and the line that asks for it."""
    if (method, path) in TITLES:
        group, operation["summary"] = TITLES[method, path]
        operation["tags"] = [group]
    shown = example_answer(method, path, marks)
    for status in ("200", "201"):
        content = operation["responses"].get(status, {}).get("content", {}).get("application/json")
        if content is not None and shown is not None:
            content["example"] = shown
    line = curl_line(method, path, operation, keys and path not in OPEN)
    operation["x-codeSamples"] = [{"lang": "Shell", "label": "curl", "source": line}]
