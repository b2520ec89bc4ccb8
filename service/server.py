"""The server: one process or several, under settings that are safe to listen with."""

from __future__ import annotations

import resource
from functools import partial
from typing import Any, cast

from fastapi import FastAPI
from uvicorn import Config, Server
from uvicorn.supervisors import Multiprocess

from model.memory import keep_freed_memory
from service.access.exposure import check_exposure, keys_required
from service.app import create_app
from service.http.connection import connections
from service.jobs.jobs import check_workers
from service.logs import log_config
from service.settings import Settings
from service.store.store import Store

#: Files that a process has open beside its connections: the store, libraries, workers.
_OTHER_FILES = 256
#: After which a worker that says nothing is replaced [s]: on a busy machine its imports alone take many seconds.
_SILENT_WORKER = 60


def serve(settings: Settings) -> None:
    """Serve until interrupted; requests under way are answered before it ends, for `shutdown_timeout_s` at most.

    Raises
    ------
    Exposed : the server would listen beyond this machine without keys, or requires keys that do not exist
    StoreUnavailable : the store cannot be opened
    ValueError : the settings name a cluster that is not safe to use
    """
    check_workers(settings)
    check_exposure(settings, keys_required(settings) and _any_keys(settings))
    config = Config(
        cast("Any", partial(application, settings)),
        factory=True,
        host=settings.host,
        port=settings.port,
        http=cast("Any", connections(settings, raise_file_limit(settings.max_connections))),
        ws="none",
        workers=settings.workers,
        log_config=log_config(settings.log_level),
        access_log=False,
        server_header=False,
        timeout_keep_alive=cast("int", settings.idle_timeout_s),
        timeout_worker_healthcheck=_SILENT_WORKER,
        timeout_graceful_shutdown=settings.shutdown_timeout_s,
    )
    if settings.workers == 1:
        Server(config).run()
        return
    Multiprocess(config, sockets=[config.bind_socket()]).run()


def application(settings: Settings) -> FastAPI:
    """The application of one server process."""
    keep_freed_memory()
    return create_app(settings)


def raise_file_limit(connections: int) -> int:
    """Have the system let this process open files for so many connections; how many it lets."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = connections + _OTHER_FILES
    if soft != resource.RLIM_INFINITY and soft < wanted:
        soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    return connections if soft == resource.RLIM_INFINITY else min(connections, max(soft - _OTHER_FILES, 8))


def _any_keys(settings: Settings) -> bool:
    url = settings.database_url
    store = Store(settings.data_dir, None if url is None else url.get_secret_value())
    try:
        return store.keys.any_working()
    finally:
        store.close()
