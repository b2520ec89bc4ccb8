"""What the routes of one app share: settings, the store, the designs kept ready, the slots for heavy work."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from anyio import Semaphore
from fastapi import Depends, Request

from service.designs import Designs
from service.reading import prefers_async
from service.settings import Settings
from service.store.designs import LOCAL
from service.store.store import Store

if TYPE_CHECKING:  # the jobs replay requests, and with them the routes and this state
    from service.jobs.jobs import Jobs


@dataclass(frozen=True)
class State:
    """Made when the app starts, closed when it stops. Without `jobs`, every answer is given in line."""

    settings: Settings
    store: Store
    designs: Designs
    slots: Semaphore
    jobs: Jobs | None


def state_of(request: Request) -> State:
    """The state of the app that serves this request."""
    state: State = request.app.state.shared
    return state


async def slot(request: Request) -> AsyncIterator[None]:
    """A place among the computations that run at the same time; waits, without a thread, until one is free.

    What only reads a design that is ready in memory does not wait, nor what is to become a job.
    """
    state = state_of(request)
    if state.designs.ready(request.path_params.get("id", "")) or prefers_async(request):
        yield
        return
    async with state.slots:
        yield


async def own_slot(request: Request) -> AsyncIterator[None]:
    """A place among the computations that run at the same time, be the design ready in memory or not."""
    if prefers_async(request):
        yield
        return
    async with state_of(request).slots:
        yield


def owner_of(request: Request) -> str:
    """Whose the designs and jobs of this request are."""
    return LOCAL


def settings_of(request: Request) -> Settings:
    """Settings of the app that serves this request."""
    return state_of(request).settings


def designs_of(request: Request) -> Designs:
    """Designs of the app that serves this request."""
    return state_of(request).designs


SettingsHere = Annotated[Settings, Depends(settings_of)]
DesignsHere = Annotated[Designs, Depends(designs_of)]
#: In the `dependencies` of every route that computes.
HEAVY = Depends(slot, scope="function")
#: The same for routes that compute much, the design being ready or not.
ALWAYS_HEAVY = Depends(own_slot, scope="function")
