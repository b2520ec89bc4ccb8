"""A running server, Chromium, and pages that may neither fail nor ask anybody else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from service.settings import Settings
from tests.served import FLAGS, chromium_or_skip, served
from tests.service.workbench.envelope_pages import Page

WAIT = 30_000


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server that makes jobs of what is too much in line."""
    with served(Settings(data_dir=tmp_path_factory.mktemp("workbench"), job_work_factor=40)) as at:
        yield at


@pytest.fixture(scope="session")
def serve() -> Callable[[Settings], AbstractContextManager[str]]:
    """Start a server with other settings."""
    return served


@pytest.fixture(scope="session")
def profile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where Chromium keeps what it has compiled: the plotting script takes a second otherwise, in every test."""
    return tmp_path_factory.mktemp("profile")


@pytest.fixture(scope="module")
def browser(profile: Path) -> Iterator[Any]:
    path = chromium_or_skip()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch_persistent_context(
            profile, executable_path=path, args=FLAGS, accept_downloads=True
        )
        yield opened
        opened.close()


@dataclass
class Watch:
    """What a page did that it must not; `refused` are statuses that a test brings about on purpose."""

    failures: list[str] = field(default_factory=list)
    outside: list[str] = field(default_factory=list)
    refused: set[int] = field(default_factory=set)

    def console(self, message: Any) -> None:
        wanted = any(f"status of {status}" in message.text for status in self.refused)
        if message.type in ("error", "warning") and not wanted:
            self.failures.append(f"{message.text} {message.location}")


@pytest.fixture
def watch() -> Watch:
    return Watch()


@pytest.fixture
def new_tab(address: str, browser: Any, watch: Watch) -> Iterator[Callable[..., Any]]:
    """Make pages of a size and colour scheme; at the end none may have failed or asked another host."""
    tabs = []

    def seen(request: Any) -> None:
        if not request.url.startswith((address, "data:", "blob:")):
            watch.outside.append(request.url)

    def make(width: int = 1280, height: int = 860, scheme: str = "light") -> Any:
        tab = browser.new_page()
        tabs.append(tab)
        tab.set_viewport_size({"width": width, "height": height})
        tab.emulate_media(color_scheme=scheme)
        tab.set_default_timeout(WAIT)
        tab.on("request", seen)
        tab.on("console", watch.console)
        tab.on("pageerror", lambda error: watch.failures.append(str(error)))
        return tab

    yield make
    for tab in tabs:
        if tab.url.startswith(address):
            tab.evaluate("localStorage.clear()")
        tab.close()
    assert watch.failures == []
    assert watch.outside == []


@pytest.fixture
def tab(new_tab: Callable[..., Any]) -> Any:
    """One page at the size of a laptop."""
    return new_tab()


@pytest.fixture
def open_example(address: str) -> Callable[..., None]:
    """Open a shipped example from the front door and wait for its map."""

    def opened(tab: Any, name: str = "wind_tunnel") -> None:
        tab.goto(f"{address}/")
        tab.get_by_role("button", name=f"Open {name}", exact=True).click()
        tab.locator(".plot-canvas .main-svg").first.wait_for()

    return opened


@pytest.fixture
def page(tab: Any, address: str) -> Page:
    """The same page, with what the tests of views over the envelope do there."""
    return Page(tab, address)
