"""For those who run the server: whether it is up, whether it can work, and what it counts."""

from __future__ import annotations

import shutil
import tempfile
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response

from service.documentation.openapi import problems
from service.metrics import CONTENT_TYPE
from service.schemas.meta import Health, Readiness
from service.state import State, read, state_of
from service.store.figures import figures
from service.store.migrate import version_here, version_of
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, NotReady, StoreUnavailable

router = APIRouter(tags=["server"])

_METRICS: dict[int | str, dict[str, Any]] = {
    200: {"description": "Counts in the text format of Prometheus", "content": {"text/plain": {}}}
}


@router.get("/healthz", response_model=Health, responses=problems())
async def health(request: Request) -> Response:
    """The process is up."""
    return answer(request, encode({"status": "ok"}))


@router.get("/readyz", response_model=Readiness, responses=problems(503))
async def ready(request: Request) -> Response:
    """The server can work: its database answers with the tables of this code, and its disk takes what is written.

    503 names everything that is not well.
    """
    checks = await read(request, partial(_checks, state_of(request)))
    faults = {name: fault for name, fault in checks.items() if fault is not None}
    if faults:
        detail = "; ".join(f"{name}: {fault}" for name, fault in faults.items())
        raise NotReady(detail, *(FieldRefusal(f"/{name}", fault) for name, fault in faults.items()))
    return answer(request, encode({"status": "ready", "checks": list(checks)}))


@router.get("/metrics", response_class=Response, responses=_METRICS)
async def metrics(request: Request) -> Response:
    """Requests, latencies, computations, and what is stored.

    Counts are of the process that answers, which the label `worker` names; with several, sum over it. What is stored
    is the same from each.
    """
    state = state_of(request)
    text = await read(request, partial(state.metrics.text, partial(figures, state.store.database)))
    return Response(text, media_type=CONTENT_TYPE)


def _checks(state: State) -> dict[str, str | None]:
    """What the server needs, and why it does not have it; None where it has."""
    return {"database": _database_fault(state), "disk": _disk_fault(state)}


def _database_fault(state: State) -> str | None:
    """Why the database cannot be worked with; None when it can."""
    try:
        with state.store.database.reading():
            found = version_of(state.store.database.engine)
    except StoreUnavailable as refusal:
        return refusal.detail
    wanted = version_here()
    return None if found == wanted else f"its tables have version {found or 'none'}, this code needs {wanted}"


def _disk_fault(state: State) -> str | None:
    """Why the data directory cannot be worked with; None when it can."""
    directory, needed = state.settings.data_dir, state.settings.min_free_bytes
    try:
        with tempfile.TemporaryFile(dir=directory) as file:
            file.write(b"0" * 4096)
            file.flush()
        free = shutil.disk_usage(directory).free
    except OSError as error:
        return f"the data directory cannot be written: {error.strerror}"
    return None if free >= needed else f"{free} bytes are free; GAINFIELD_MIN_FREE_BYTES asks for {needed}"
