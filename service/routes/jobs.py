"""Jobs: listed, watched, cancelled, and their results."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated

import anyio
from anyio import to_thread
from fastapi import APIRouter, Depends, Header, Path, Query, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel, Field

from service.documentation.openapi import problems
from service.jobs.document import job_document
from service.jobs.jobs import RETRY_AFTER, Jobs
from service.jobs.kinds.answer import kept_answer
from service.limits import check_size
from service.schemas.jobs import Job, JobList
from service.schemas.wire import PARAMETERS
from service.state import SettingsHere, principal_of, state_of
from service.store.jobs import Job as StoredJob
from service.wire.answering import JSON, answer, encode
from service.wire.refusals import NoResult, NotFound

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

#: How often the store is asked for what an open stream of events tells [s].
_LOOK = 0.25

JobId = Annotated[str, Path(alias="id", description="Id of a job, as the answer 202 gave it")]


def jobs_of(request: Request) -> Jobs:
    """Jobs of the app that serves this request."""
    jobs = state_of(request).jobs
    if jobs is None:
        raise NotFound("there are no jobs here")
    return jobs


JobsHere = Annotated[Jobs, Depends(jobs_of)]


def job_here(request: Request, ident: JobId, jobs: JobsHere) -> StoredJob:
    """The job that the path names."""
    return jobs.find(ident, principal_of(request).sees)


JobHere = Annotated[StoredJob, Depends(job_here)]


class Page(BaseModel):
    """Which page of the list is wanted."""

    model_config = PARAMETERS

    limit: Annotated[int, Field(ge=1)] = Field(default=50, description="Jobs on the page", examples=[50])
    cursor: Annotated[str, Field(pattern="^j[0-9]{1,18}$")] | None = Field(
        default=None, description="`next_cursor` of the page before; without it, the newest jobs"
    )


@router.get("", response_model=JobList, responses=problems(422, 503))
def list_jobs(request: Request, page: Annotated[Page, Query()], jobs: JobsHere, settings: SettingsHere) -> Response:
    """Jobs, newest first, a page at a time."""
    check_size("/limit", "jobs on a page", page.limit, "max_listed_designs", settings)
    before = None if page.cursor is None else int(page.cursor[1:])
    found = jobs.page(page.limit + 1, before, principal_of(request).sees)
    shown, more = found[: page.limit], len(found) > page.limit
    next_cursor = f"j{shown[-1].seq}" if more else None
    headers = {"Link": f'</v1/jobs?limit={page.limit}&cursor={next_cursor}>; rel="next"'} if more else None
    items = [job_document(job) for job in shown]
    return answer(request, encode({"items": items, "next_cursor": next_cursor}), headers=headers)


@router.get("/{id}", response_model=Job, responses=problems(404, 503))
def read_job(request: Request, job: JobHere) -> Response:
    """The job as it stands."""
    return answer(request, encode(job_document(job)))


@router.get("/{id}/events", response_class=EventSourceResponse, responses=problems(404, 503))
async def job_events(
    request: Request,
    job: JobHere,
    jobs: JobsHere,
    last_event_id: Annotated[str | None, Header(description="Of the last event that the client has seen")] = None,
) -> AsyncIterator[ServerSentEvent]:
    """The job whenever it changes, as server-sent events, until it has ended; each is named by the job's state.

    Their ids count the changes of the job: a client that comes back with the last one gets what is newer.
    """
    seen = int(last_event_id) if last_event_id and last_event_id.isdecimal() and len(last_event_id) < 19 else -1
    now: StoredJob | None = job
    while now is not None:
        if now.revision > seen:
            seen = now.revision
            yield ServerSentEvent(raw_data=encode(job_document(now)).decode(), event=now.state, id=str(seen))
        if now.ended:
            return
        await anyio.sleep(_LOOK)
        now = await to_thread.run_sync(_again, jobs, job.id, job.owner)


def _again(jobs: Jobs, ident: str, owner: str) -> StoredJob | None:
    """The job as it is now; None when it was forgotten meanwhile."""
    try:
        return jobs.find(ident, owner)
    except NotFound:
        return None


@router.get(
    "/{id}/result",
    response_class=Response,
    responses={
        200: {"description": "What the request would have been answered with in line", "content": {JSON: {}}},
        **problems(404, 409, 503),
    },
)
def job_result(request: Request, job: JobHere, jobs: JobsHere) -> Response:
    """The result of a job that succeeded: the very bytes that the request would have been answered with in line."""
    if job.state != "succeeded" or job.result is None:
        why = "; the document of the job says why" if job.ended else "; it is not finished yet"
        wait = None if job.ended else RETRY_AFTER
        raise NoResult(f"the job {job.id} is {job.state}{why}", wait=wait)
    if job.result_blob is None:
        ident = job.result.rpartition("/")[2]
        design = state_of(request).designs.find(ident)
        return answer(request, design.answer, headers={"Content-Location": job.result})
    headers, body = kept_answer(jobs.result(job))
    media_type = headers.pop("content-type", JSON)
    return answer(request, body, media_type=media_type, headers=headers)


@router.delete(
    "/{id}",
    response_model=Job,
    responses={
        202: {"model": Job, "description": "The job is asked to stop; within a second it has"},
        204: {"description": "The job had ended; it is forgotten. What it made is kept"},
        **problems(404, 503),
    },
)
def cancel_job(request: Request, job: JobHere, jobs: JobsHere) -> Response:
    """Cancel a job, or forget one that has ended."""
    if job.ended:
        jobs.forget(job)
        return Response(status_code=204)
    now = jobs.cancel(job.id, job.owner)
    return answer(request, encode(job_document(now)), 202 if now.state == "cancelling" else 200)
