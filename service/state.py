"""What the routes of one app share: settings, the store, the designs kept ready, the slots for heavy work."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, TypeVar

from anyio import CapacityLimiter, Semaphore, to_thread
from fastapi import Depends, Request

from service.access.door import Door
from service.access.principals import Principal
from service.designs import Designs
from service.metrics import Metrics
from service.settings import Settings
from service.store.store import Store
from service.wire.reading import prefers_async
from service.wire.refusals import Overloaded

Result = TypeVar("Result")

if TYPE_CHECKING:  # the jobs replay requests, and with them the routes and this state
    from service.jobs.jobs import Jobs


@dataclass(frozen=True)
class State:
    """Made when the app starts, closed when it stops.

    Attributes
    ----------
    slots : for what computes
    light : threads for what only reads: they are there however many of the others compute
    jobs : None in a worker, where every answer is given in line
    """

    settings: Settings
    store: Store
    designs: Designs
    slots: Semaphore
    light: CapacityLimiter
    door: Door
    metrics: Metrics
    jobs: Jobs | None


def state_of(request: Request) -> State:
    """The state of the app that serves this request."""
    state: State = request.app.state.shared
    return state


async def read(request: Request, function: Callable[[], Result]) -> Result:
    """What the function reads, in a thread for such."""
    return await to_thread.run_sync(function, limiter=state_of(request).light)


#: Queries that ask for a proof, which costs much though the design is ready.
COSTLY = frozenset({"certificate", "proof"})


async def slot(request: Request) -> AsyncIterator[None]:
    """A place among the computations that run at the same time; waits, without a thread, until one is free.

    What only reads a design that is ready in memory does not wait, nor what is to become a job.
    """
    ready = state_of(request).designs.ready(request.path_params.get("id", ""))
    if (ready and COSTLY.isdisjoint(request.query_params)) or prefers_async(request):
        yield
        return
    async with computing(request):
        yield


async def own_slot(request: Request) -> AsyncIterator[None]:
    """A place among the computations that run at the same time, be the design ready in memory or not."""
    if prefers_async(request):
        yield
        return
    async with computing(request):
        yield


#: How long a client waits before it asks a server again that has too much to compute [s].
_LATER = 5


@asynccontextmanager
async def computing(request: Request) -> AsyncIterator[None]:
    """Hold one of the slots; the time until there was one is in the answer's ``Server-Timing``.

    Raises
    ------
    Overloaded : as many wait already as may
    """
    state = state_of(request)
    limit = state.settings.max_waiting_designs
    if state.slots.statistics().tasks_waiting >= limit:
        raise Overloaded(
            f"{limit} requests wait for a computation, the limit max_waiting_designs of this server "
            "(setting GAINFIELD_MAX_WAITING_DESIGNS)",
            wait=_LATER,
        )
    asked = time.perf_counter()
    async with state.slots:
        request.scope["state"].setdefault("timing", {})["queue"] = time.perf_counter() - asked
        with state.metrics.computing():
            yield


async def settings_of(request: Request) -> Settings:
    """Settings of the app that serves this request."""
    return state_of(request).settings


def principal_of(request: Request) -> Principal:
    """Who asks."""
    principal: Principal = request.scope["state"]["principal"]
    return principal


async def designs_of(request: Request) -> Designs:
    """Designs of the app that serves this request, as the one who asks sees them."""
    state, asking = state_of(request), principal_of(request)
    return state.designs.of(asking, partial(state.door.check_room, asking))


SettingsHere = Annotated[Settings, Depends(settings_of)]
DesignsHere = Annotated[Designs, Depends(designs_of)]
#: In the `dependencies` of every route that computes.
HEAVY = Depends(slot, scope="function")
#: The same for routes that compute much, the design being ready or not.
ALWAYS_HEAVY = Depends(own_slot, scope="function")
