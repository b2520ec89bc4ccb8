"""/docs and /redoc with the network cut: nothing is asked of anybody else, and the operations are seen."""

from __future__ import annotations

import os
import re
import shutil
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
import uvicorn
from fastapi.testclient import TestClient

from service.app import create_app
from service.settings import Settings

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


@pytest.mark.parametrize("page", ["/docs", "/redoc"])
def test_pages_ask_nobody_else(client: TestClient, page: str) -> None:
    html = client.get(page).text
    assert not re.search(r"""(src|href|url)\s*[=:]\s*["']?(https?:)?//""", html)
    assets = re.findall(r'(?:src|href)="([^"]+)"', html)
    assert assets
    for asset in assets:
        assert client.get(asset).status_code == 200, asset


def test_swagger_is_ready_to_try(client: TestClient) -> None:
    html = client.get("/docs").text
    for setting in ('"tryItOutEnabled": true', '"filter": true', '"validatorUrl": null'):
        assert setting in html


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A real server on a free port of this machine."""
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("docs")))
    server = uvicorn.Server(uvicorn.Config(app, host="127.0.0.1", port=0, log_level="warning"))
    thread = threading.Thread(target=server.run)
    thread.start()
    deadline = time.monotonic() + 30
    while not server.started:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    port = server.servers[0].sockets[0].getsockname()[1]
    yield f"http://127.0.0.1:{port}"
    server.should_exit = True
    thread.join()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        if os.environ.get("CI") == "true":
            pytest.fail("there is no Chromium, and CI must see the documentation in one")
        pytest.skip("there is no Chromium on this machine")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        yield opened
        opened.close()


@pytest.mark.browser
@pytest.mark.parametrize(
    ("page", "seen", "words"),
    [("/docs", ".opblock", "/v1/designs"), ("/redoc", "[data-section-id]", "Design every controller")],
)
def test_pages_render_with_the_network_cut(address: str, browser: Any, page: str, seen: str, words: str) -> None:
    outside: list[str] = []

    def only_us(route: Any) -> None:
        if route.request.url.startswith((address, "data:", "blob:")):
            route.continue_()
        else:
            outside.append(route.request.url)
            route.abort()

    context = browser.new_context()
    context.route("**/*", only_us)
    tab = context.new_page()
    failures: list[str] = []
    tab.on("pageerror", lambda error: failures.append(str(error)))
    tab.goto(address + page)
    tab.wait_for_selector(seen, timeout=20_000)
    assert words in tab.inner_text("body")
    assert outside == []
    assert failures == []
    if page == "/docs":
        operations = sum(len(path) for path in create_app().openapi()["paths"].values())
        assert tab.locator(".opblock").count() == operations >= 20
    context.close()


@pytest.mark.browser
def test_a_request_runs_from_the_page(address: str, browser: Any) -> None:
    """Open an operation, press Execute, see the answer."""
    tab = browser.new_page()
    tab.goto(address + "/docs")
    block = tab.locator(".opblock", has=tab.locator('[data-path="/v1/hinge-moments"]'))
    block.locator(".opblock-summary-control").click()
    block.locator("button.execute").click()
    answered = block.locator(".live-responses-table tbody .response-col_status").first
    answered.wait_for(timeout=20_000)
    assert answered.inner_text().startswith("200")
    tab.close()
