"""Any other request as a job: answered by the same routes, in a worker that has the designs it names and no store."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import orjson

from service.jobs.frames import cut, joined
from service.jobs.given_designs import design_document, read_design
from service.jobs.kinds.kind import Document, Finished, TaskFailed
from service.store.designs import StoredDesign
from service.store.jobs import Job, NewJob
from service.store.store import Store
from service.wire.errors import problem

ANSWER = "answer"
#: Headers of an answer that are kept beside its bytes.
_KEPT_HEADERS = ("content-type", "content-disposition", "x-content-type-options")


def asked(method: str, path: str, query: str, body: Any) -> Document:
    """A request as JSON: the same for every spelling of the same body."""
    text = None if body is None else json.dumps(body, sort_keys=True, separators=(",", ":"))
    return {"method": method, "path": path, "query": query, "body": text}


def answer_job(request: Document, ident: str, designs: Mapping[str, StoredDesign], limits: Mapping[str, int]) -> NewJob:
    """The job that answers a request (`asked`) under these limits, which may be wider than those in line."""
    given = {name: design_document(design) for name, design in designs.items()}
    spec = orjson.dumps(request | {"designs": given, "limits": dict(limits)})
    return NewJob(ident, ANSWER, spec, 1)


class AnswerJobs:
    """The kind of jobs that answer requests: one task."""

    def plan(self, spec: Document) -> list[Document]:
        """Nothing before the answer."""
        return []

    def last(self, spec: Document, results: Sequence[bytes], created_at: float) -> Document:
        """The request itself."""
        return spec

    def work(self, task: Document) -> bytes:
        """The answer, its headers before it."""
        # The routes lead to jobs and these to their kinds: what replays a request is known to workers only.
        from service.jobs.replay import replayed

        designs = {name: read_design(design) for name, design in task["designs"].items()}
        status, headers, body = replayed(task, designs, task["limits"])
        if status >= 400:
            raise TaskFailed(_problem(body))
        return joined([orjson.dumps({name: headers[name] for name in _KEPT_HEADERS if name in headers}), body])

    def keep(self, job: Job, result: bytes, store: Store) -> Finished:
        """The answer is kept with the job."""
        return Finished(f"/v1/jobs/{job.id}/result", result)


def kept_answer(content: bytes) -> tuple[dict[str, str], bytes]:
    """Headers and bytes of the answer that a job was finished with."""
    headers, body = cut(content)
    found: dict[str, str] = orjson.loads(headers)
    return found, body


def _problem(body: bytes) -> Document:
    try:
        document = orjson.loads(body)
    except ValueError:
        document = None
    if isinstance(document, dict):
        return document
    return problem(500, "internal_error", "Internal error", "the answer to the request is no problem document")
