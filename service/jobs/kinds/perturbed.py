"""Perturbed plants as a job: their cases in blocks, then what they say together."""

from __future__ import annotations

import hashlib
from base64 import b64decode, b64encode
from collections.abc import Sequence

import orjson

from schedules.perturbed_cases import FlownCases
from service.designs import Designs
from service.envelopes import Envelopes
from service.jobs.frames import cut, joined
from service.jobs.given_designs import GivenDesigns, design_document, read_design
from service.jobs.kinds.kind import Document, Finished
from service.settings import Settings
from service.store.designs import StoredDesign
from service.store.jobs import Job, NewJob
from service.store.store import Store
from service.studies.perturbed import Perturbed, WantedPerformance, perturbed
from service.version import code_version
from service.wire.answering import JSON, encode

PERTURBED = "perturbed"
#: Limits were kept where the question was asked.
_BOUNDLESS = 1 << 60


def perturbed_job(design: StoredDesign, asked: Perturbed, owner: str) -> NewJob:
    """The job that flies the cases of a question about a controller of this design: one for the same question."""
    words = {
        "design": design_document(design),
        "controller": asked.controller.request.name,
        "wanted": asked.wanted.model_dump(exclude_unset=True),
        "blocks": asked.blocks,
    }
    spec = orjson.dumps(words, option=orjson.OPT_SORT_KEYS)
    of = (PERTURBED.encode(), owner.encode(), spec, code_version().encode())
    ident = hashlib.sha256(b"\0".join(of)).hexdigest()[:32]
    return NewJob(ident, PERTURBED, spec, len(asked.blocks) + 1)


class PerturbedJobs:
    """The kind of jobs that fly perturbed plants."""

    def plan(self, spec: Document) -> list[Document]:
        """One task for every block of cases."""
        return [spec | {"block": block} for block in spec["blocks"]]

    def last(self, spec: Document, results: Sequence[bytes], created_at: float) -> Document:
        """The answer from all cases."""
        return spec | {"flown": b64encode(joined(results)).decode()}

    def work(self, task: Document) -> bytes:
        """Figures of a block of cases, or the answer."""
        asked = _asked(task)
        if "block" in task:
            return asked.fly(*task["block"]).to_bytes()
        done = [FlownCases.from_bytes(piece) for piece in cut(b64decode(task["flown"]))]
        return joined([orjson.dumps({"content-type": JSON}), encode(asked.document(done))])

    def keep(self, job: Job, result: bytes, store: Store) -> Finished:
        """The answer is kept with the job."""
        return Finished(f"/v1/jobs/{job.id}/result", result)


def _asked(task: Document) -> Perturbed:
    design = read_design(task["design"])
    envelope = Designs(GivenDesigns({design.id: design}), Envelopes(1)).envelope(design.id)
    settings = Settings(max_flown_loops=_BOUNDLESS, max_delayed_loops=_BOUNDLESS)
    return perturbed(envelope, task["controller"], WantedPerformance(**task["wanted"]), settings)
