"""The application: routes, errors, limits and documentation put together for given settings."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache

from anyio import Semaphore, to_thread
from fastapi import FastAPI

from service import errors, openapi, pages
from service.body_limit import BodyLimit
from service.design_examples import design_requests
from service.designs import Designs, design_id
from service.examples import NAMES
from service.head_requests import HeadRequests
from service.jobs import refusals as job_refusals
from service.jobs.example import example_job
from service.jobs.jobs import Jobs
from service.routes import ROUTERS
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.state import State
from service.store.store import Store
from service.version import release


def create_app(settings: Settings | None = None) -> FastAPI:
    """The application for these settings; without them, for those of the environment.

    Nothing is opened before the application starts, and what it opened is closed when it stops.
    """
    chosen = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        url = chosen.database_url
        store = Store(chosen.data_dir, None if url is None else url.get_secret_value())
        designs = Designs(store.designs, chosen.kept_envelopes)
        try:
            jobs = Jobs(store, chosen)
            app.state.shared = State(chosen, store, designs, Semaphore(chosen.max_concurrent_designs), jobs)
            try:
                yield
            finally:
                await to_thread.run_sync(jobs.close)
        finally:
            store.close()

    app = FastAPI(
        title="Gainfield",
        version=release(),
        description=openapi.DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        license_info={"name": "MIT", "identifier": "MIT"},
    )
    for router in ROUTERS:
        app.include_router(router)
    pages.install(app)
    errors.install(app)
    job_refusals.install(app)
    openapi.install(app, NAMES[0], example_id, example_job)
    app.add_middleware(BodyLimit, limit=chosen.max_body_bytes)
    app.add_middleware(HeadRequests)
    return app


@cache
def example_id(name: str) -> str:
    """Id that the design of the example of this name gets from this code."""
    return design_id(DesignRequest.model_validate(design_requests()[name][1]))
