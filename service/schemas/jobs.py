"""Jobs on the wire."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.problem import Problem
from service.schemas.wire import Answer


class Progress(Answer):
    """How far a job is: finished tasks of all, the rate since it was taken up, and the time left at this rate."""

    done: int
    total: int
    rate_1_s: float | None = Field(description="Null before the first task is finished")
    time_left_s: float | None = Field(description="Null before the first task is finished")


class JobLinks(Answer):
    """Where more of the job is."""

    self: str
    events: str
    result: str


class Job(Answer):
    """A job: queued, running, being cancelled, or ended in one of three ways."""

    id: str
    kind: Literal["design", "answer"]
    state: Literal["queued", "running", "cancelling", "cancelled", "failed", "succeeded"]
    progress: Progress
    created_at: str
    started_at: str | None = Field(description="Null before a runner took it up")
    finished_at: str | None = Field(description="Null before it has ended")
    result: str | None = Field(description="Path of the result; null unless `state` is `succeeded`")
    error: Problem | None = Field(description="Why it failed; null unless `state` is `failed`")
    links: JobLinks


class JobList(Answer):
    """A page of jobs, newest first."""

    items: list[Job]
    next_cursor: str | None = Field(description="Cursor of the next page; null on the last one")
