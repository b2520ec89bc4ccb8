"""What the job system refuses; unlike other refusals these say when to come again."""

from __future__ import annotations

from fastapi import FastAPI, Request, Response

from service.errors import problem, problem_response
from service.refusals import Refusal

#: How long a client may wait before it asks again [s].
RETRY_AFTER = 1


class JobRefusal(Refusal):
    """Base of the refusals below, each in `JOB_STATUS`."""


class QueueFull(JobRefusal):
    """As many jobs wait as this server takes."""


class NoResult(JobRefusal):
    """The job has no result, or none yet; the detail says which."""


#: Exception -> status, code, title.
JOB_STATUS: dict[type[JobRefusal], tuple[int, str, str]] = {
    NoResult: (409, "no_result", "The job has no result"),
    QueueFull: (429, "queue_full", "Too many jobs wait"),
}


def install(app: FastAPI) -> None:
    """Answer these refusals with a problem document and ``Retry-After``."""
    app.add_exception_handler(JobRefusal, _refusal)


async def _refusal(request: Request, error: Exception) -> Response:
    assert isinstance(error, JobRefusal)
    document = problem(*JOB_STATUS[type(error)], error.detail, error.fields)
    return problem_response(document, {"Retry-After": str(RETRY_AFTER)})
