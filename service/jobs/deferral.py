"""Heavy operations that become jobs: because the client prefers it, or because they are too much in line."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response
from fastapi.routing import APIRoute

from service.answering import JSON
from service.jobs.document import job_document
from service.jobs.kinds.answer import answer_job, asked
from service.jobs.refusals import RETRY_AFTER
from service.limits import LIMITS, fits_in_a_job, of_jobs
from service.openapi import job_answers
from service.reading import JsonRequest, prefers_async
from service.refusals import LimitExceeded, NotFound
from service.state import ALWAYS_HEAVY, HEAVY, State, owner_of, state_of
from service.store.designs import StoredDesign
from service.store.jobs import Job
from service.version import code_version


def deferrable(router: APIRouter) -> APIRouter:
    """A router with the same routes, those that compute much answering with a job where that is better.

    A route that declares the answer 202 sees to it itself.
    """
    found = APIRouter()
    found.routes.extend(_deferrable(route) if isinstance(route, APIRoute) else route for route in router.routes)
    return found


def accepted(request: Request, job: Job) -> Response:
    """The answer 202: where the job is, and what it is now."""
    headers = {"Location": f"/v1/jobs/{job.id}", "Retry-After": str(RETRY_AFTER), "Cache-Control": "no-store"}
    if prefers_async(request):
        headers["Preference-Applied"] = "respond-async"
    return Response(orjson.dumps(job_document(job)), 202, headers, JSON)


def answer_id(owner: str, method: str, path: str, query: str, body: Any) -> str:
    """Id of the job that answers a request of this owner's: the same request is one job."""
    words = orjson.dumps([owner, asked(method, path, query, body), code_version()], option=orjson.OPT_SORT_KEYS)
    return hashlib.sha256(words).hexdigest()[:32]


def _deferrable(route: APIRoute) -> APIRoute:
    heavy = HEAVY in route.dependencies or ALWAYS_HEAVY in route.dependencies
    if not heavy or 202 in route.responses:
        return route
    deferred = copy.copy(route)
    deferred.endpoint = _deferring(route.endpoint)
    deferred.responses = {**job_answers(), **route.responses}
    return deferred


def _deferring(endpoint: Callable[..., Response]) -> Callable[..., Response]:
    """The endpoint, which is reached when the request is valid: a job instead, or its own answer."""

    @wraps(endpoint)
    def answered(**values: Any) -> Response:
        request: Request = values["request"]
        state = state_of(request)
        if state.jobs is None:
            return endpoint(**values)
        if prefers_async(request):
            return accepted(request, _job(request, state))
        try:
            return endpoint(**values)
        except LimitExceeded as refused:
            if not fits_in_a_job(refused, state.settings):
                raise
        return accepted(request, _job(request, state))

    return answered


def _job(request: Request, state: State) -> Job:
    """The job that answers this request.

    Raises
    ------
    NotFound : of a design that the request names
    QueueFull
    """
    assert state.jobs is not None
    body = request.document if isinstance(request, JsonRequest) else None
    what = (request.method, request.scope["path"], request.scope["query_string"].decode("latin-1"), body)
    owner = owner_of(request)
    ident = answer_id(owner, *what)
    limits = of_jobs(state.settings)
    given = _designs(request, state, body)
    new = answer_job(asked(*what), ident, given, {name: getattr(limits, name) for name in LIMITS})
    return state.jobs.ask(new, owner, again=False)


def _designs(request: Request, state: State, body: Any) -> dict[str, StoredDesign]:
    """The designs that a request names: by path, by query, and in its body."""
    named = [request.path_params.get("id"), request.query_params.get("with")]
    found = {ident: state.designs.find(ident) for ident in named if ident is not None}
    ident = body.get("design_id") if isinstance(body, dict) else None
    if isinstance(ident, str):
        with suppress(NotFound):  # the route has words for it that point into the body
            found[ident] = state.designs.find(ident)
    return found
