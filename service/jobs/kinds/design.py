"""A design as a job: the searches of its controllers in blocks of points, then the envelope from all of them."""

from __future__ import annotations

import hashlib
from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import asdict

import orjson

from schedules.parts import Part
from service.designs import canonical, design_id, parts_of, stored_design, synthesised
from service.jobs.frames import cut, joined
from service.jobs.kinds.kind import Document, Finished
from service.schemas.requests import DesignRequest
from service.store.designs import StoredDesign
from service.store.jobs import Job, NewJob
from service.store.store import Store

DESIGN = "design"
_ENDING = ("id", "name", "created_at", "version")


def design_job(request: DesignRequest, owner: str) -> NewJob:
    """The job that makes the design of a request for this owner: one for the same request.

    Raises
    ------
    InvalidRequest : the model refuses the request
    """
    spec = orjson.dumps({"request": canonical(request).decode()})
    ident = hashlib.sha256(f"{DESIGN} {owner} {design_id(request)}".encode()).hexdigest()[:32]
    return NewJob(ident, DESIGN, spec, len(parts_of(request)) + 1)


class DesignJobs:
    """The kind of jobs that make designs."""

    def plan(self, spec: Document) -> list[Document]:
        """One task for every part of the study."""
        return [spec | {"part": asdict(part)} for part in parts_of(_request(spec))]

    def last(self, spec: Document, results: Sequence[bytes], created_at: float) -> Document:
        """The envelope from its parts, as it is stored."""
        return spec | {"parts": b64encode(joined(results)).decode(), "created_at": created_at}

    def work(self, task: Document) -> bytes:
        """Gains of a part, or the design."""
        request = _request(task)
        if "part" in task:
            return synthesised(request, Part(**task["part"]))
        design, _ = stored_design(design_id(request), request, cut(b64decode(task["parts"])), task["created_at"])
        words = orjson.dumps({name: getattr(design, name) for name in _ENDING})
        return joined([words, design.request, design.answer, *(() if design.parts is None else (design.parts,))])

    def keep(self, job: Job, result: bytes, store: Store) -> Finished:
        """The design is its owner's, as if it had been made in line."""
        words, request, answer, *parts = cut(result)
        document = orjson.loads(words)
        design = StoredDesign(
            **{name: document[name] for name in _ENDING},
            request=request,
            answer=answer,
            parts=parts[0] if parts else None,
        )
        kept = store.designs.add(design, job.owner)
        return Finished(f"/v1/designs/{kept.id}", None)


def _request(document: Document) -> DesignRequest:
    return DesignRequest.model_validate_json(document["request"])
