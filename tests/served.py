"""A server on a free port of this machine, in a thread, and Chromium to look at it with."""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import uvicorn

from service.app import create_app
from service.settings import Settings

#: A browser without a screen, which asks nobody of its own accord and finds nobody but this machine.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
]
_STARTED_WITHIN = 60.0


@contextmanager
def served(settings: Settings) -> Iterator[str]:
    """The address of a server with these settings."""
    server = uvicorn.Server(uvicorn.Config(create_app(settings), host="127.0.0.1", port=0, log_level="warning"))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        deadline = time.monotonic() + _STARTED_WITHIN
        while not server.started:
            if not thread.is_alive() or time.monotonic() > deadline:
                raise RuntimeError("the service did not start")
            time.sleep(0.02)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


def chromium() -> str | None:
    """Where Chromium is; None on a machine without."""
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def chromium_or_skip() -> str:
    """Where Chromium is; without one a test is skipped, and fails on CI, which must see the pages."""
    found = chromium()
    if found is None and os.environ.get("CI") == "true":
        pytest.fail("there is no Chromium, and CI must see the pages in one")
    return found or pytest.skip("there is no Chromium on this machine")
