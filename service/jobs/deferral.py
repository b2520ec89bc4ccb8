"""Heavy operations that become jobs: because the client prefers it, or because they are too much in line."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial, wraps
from inspect import iscoroutinefunction
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.routing import APIRoute

from service.documentation.openapi import job_answers
from service.jobs.document import job_document
from service.jobs.jobs import RETRY_AFTER
from service.jobs.kinds.answer import answer_job, asked
from service.limits import LIMITS, fits_in_a_job, of_jobs
from service.state import ALWAYS_HEAVY, HEAVY, State, principal_of, state_of
from service.store.designs import StoredDesign
from service.store.jobs import Job
from service.version import code_version
from service.wire.answering import JSON
from service.wire.reading import JsonRequest, prefers_async
from service.wire.refusals import LimitExceeded, NotFound


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


def _deferring(endpoint: Callable[..., Any]) -> Callable[..., Awaitable[Response]]:
    """The endpoint, which is reached when the request is valid: a job instead, or its own answer."""
    of_its_own = iscoroutinefunction(endpoint)

    @wraps(endpoint)
    async def answered(**values: Any) -> Response:
        request: Request = values["request"]
        state = state_of(request)
        if state.jobs is not None and prefers_async(request):
            return await run_in_threadpool(_accepted, request, state)
        try:
            return await (endpoint(**values) if of_its_own else run_in_threadpool(endpoint, **values))
        except LimitExceeded as refused:
            if state.jobs is None or not fits_in_a_job(refused, state.settings):
                raise
        return await run_in_threadpool(_accepted, request, state)

    return answered


def _accepted(request: Request, state: State) -> Response:
    return accepted(request, _job(request, state))


def _job(request: Request, state: State) -> Job:
    """The job that answers this request.

    Raises
    ------
    NotFound : of a design that the request names
    QueueFull, QuotaExceeded
    """
    assert state.jobs is not None
    asking = principal_of(request)
    state.door.check_room(asking)
    body = request.document if isinstance(request, JsonRequest) else None
    what = (request.method, request.scope["path"], request.scope["query_string"].decode("latin-1"), body)
    ident = answer_id(asking.owner, *what)
    limits = of_jobs(state.settings)
    given = _designs(request, state, body)
    new = answer_job(asked(*what), ident, given, {name: getattr(limits, name) for name in LIMITS})
    return state.jobs.ask(new, asking.owner, again=False)


def _designs(request: Request, state: State, body: Any) -> dict[str, StoredDesign]:
    """The designs that a request names: by path, by query, and in its body."""
    seen = state.designs.of(principal_of(request), partial(state.door.check_room, principal_of(request)))
    named = [request.path_params.get("id"), request.query_params.get("with")]
    found = {ident: seen.find(ident) for ident in named if ident is not None}
    ident = body.get("design_id") if isinstance(body, dict) else None
    if isinstance(ident, str):
        with suppress(NotFound):  # the route has words for it that point into the body
            found[ident] = seen.find(ident)
    return found
