"""What a worker does, of whichever executor: one task, JSON in bytes, to its outcome in bytes; no pickle of ours."""

from __future__ import annotations

import logging
from typing import Any

import orjson

from service.jobs.kinds.kind import TaskFailed
from service.jobs.kinds.kinds import KINDS
from service.jobs.outcome import Outcome
from service.version import code_version
from service.wire.errors import STATUS, problem
from service.wire.refusals import Refusal

log = logging.getLogger("gainfield")


def work(task: bytes) -> bytes:
    """The outcome of a task (`service.jobs.outcome`), a refusal or a fault of ours included: nothing is raised."""
    problem_document: dict[str, Any] | None = None
    result = b""
    try:
        document = orjson.loads(task)
        result = KINDS[document["kind"]].work(document["task"])
    except TaskFailed as failed:
        problem_document = failed.problem
    except Refusal as refusal:
        problem_document = problem(*STATUS[type(refusal)], refusal.detail, refusal.fields)
    except Exception as error:
        log.error("a task failed", exc_info=error)
        detail = "the server failed on this job; the failure is in the log of the worker"
        problem_document = problem(500, "internal_error", "Internal error", detail)
    return Outcome(code_version(), problem_document, result).to_bytes()


def task_of(kind: str, task: dict[str, Any]) -> bytes:
    """A task of a kind of jobs as the bytes that `work` takes."""
    return orjson.dumps({"kind": kind, "task": task})
