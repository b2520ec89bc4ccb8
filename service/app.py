"""The application: routes, errors, limits and documentation put together for given settings."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache, partial

from anyio import CapacityLimiter, Semaphore, to_thread
from fastapi import Depends, FastAPI
from starlette.types import ASGIApp

from service import workbench
from service.access.door import Door
from service.access.exposure import keys_required
from service.access.guard import Guard
from service.designs import Designs, design_id
from service.documentation import openapi, pages
from service.documentation.design_examples import design_requests
from service.envelopes import Envelopes
from service.examples import NAMES
from service.housekeeping import house_kept
from service.http.body_limit import BodyLimit
from service.http.edge import Edge
from service.http.head_requests import HeadRequests
from service.http.negotiation import acceptable
from service.jobs.example import example_job
from service.jobs.jobs import Jobs
from service.limits import check_made_again
from service.metrics import Metrics
from service.routes import ROUTERS
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.state import State
from service.store.store import Store
from service.version import release
from service.wire import errors

#: Threads for what only reads the store.
LIGHT_THREADS = 8


class Application(FastAPI):
    """The framework's application, with the edge around all of it: its answers to faults get their headers too."""

    metrics: Metrics

    def build_middleware_stack(self) -> ASGIApp:
        """Everything that a request goes through."""
        return Edge(super().build_middleware_stack(), self.metrics)


def create_app(settings: Settings | None = None) -> Application:
    """The application for these settings; without them, for those of the environment.

    Nothing is opened before the application starts, and what it opened is closed when it stops.
    """
    chosen = settings or Settings()
    metrics = Metrics()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        url = chosen.database_url
        store = Store(chosen.data_dir, None if url is None else url.get_secret_value())
        ready = Envelopes(chosen.kept_envelopes, chosen.kept_point_designs)
        designs = Designs(store.designs, ready, partial(check_made_again, settings=chosen))
        slots, door = Semaphore(chosen.max_concurrent_designs), Door(chosen, store.keys)
        metrics.watch_waiting(lambda: slots.statistics().tasks_waiting)
        try:
            jobs = Jobs(store, chosen)
            light = CapacityLimiter(LIGHT_THREADS)
            app.state.shared = State(chosen, store, designs, slots, light, door, metrics, jobs)
            try:
                async with house_kept(store, chosen):
                    yield
            finally:
                await to_thread.run_sync(jobs.close)
        finally:
            store.close()

    app = Application(
        title="Gainfield",
        version=release(),
        description=openapi.DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        # A redirect would lead to whatever host the client names, and no route declares one.
        redirect_slashes=False,
        license_info={"name": "MIT", "identifier": "MIT"},
    )
    app.metrics = metrics
    for router in ROUTERS:
        app.include_router(router, dependencies=[Depends(acceptable)])
    pages.install(app)
    workbench.install(app)
    errors.install(app)
    openapi.install(app, NAMES[0], example_id, example_job, keys_required(chosen))
    app.add_middleware(BodyLimit, limit=chosen.max_body_bytes)
    app.add_middleware(HeadRequests)
    app.add_middleware(Guard)
    return app


@cache
def example_id(name: str) -> str:
    """Id that the design of the example of this name gets from this code."""
    return design_id(DesignRequest.model_validate(design_requests()[name][1]))
