"""A job on the wire."""

from __future__ import annotations

import time
from datetime import UTC, datetime
from typing import Any

import orjson

from service.store.jobs import Job


def job_document(job: Job) -> dict[str, Any]:
    """The job as it is answered, in its list and in its events."""
    path = f"/v1/jobs/{job.id}"
    return {
        "id": job.id,
        "kind": job.kind,
        "state": job.state,
        "progress": _progress(job),
        "created_at": _moment(job.created_at),
        "started_at": _moment(job.started_at),
        "finished_at": _moment(job.finished_at),
        "result": job.result,
        "error": None if job.error is None else orjson.loads(job.error),
        "links": {"self": path, "events": f"{path}/events", "result": f"{path}/result"},
    }


def _progress(job: Job) -> dict[str, Any]:
    """How far it is, and how fast since it was taken up first."""
    rate = left = None
    if job.started_at is not None and job.done > 0:
        elapsed = max((job.finished_at or time.time()) - job.started_at, 1e-3)
        rate = job.done / elapsed
        left = 0.0 if job.ended else (job.total - job.done) / rate
    return {"done": job.done, "total": job.total, "rate_1_s": rate, "time_left_s": left}


def _moment(seconds: float | None) -> str | None:
    if seconds is None:
        return None
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
