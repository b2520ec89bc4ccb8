"""/docs and /redoc with the network cut: nothing is asked of anybody else, and the operations are seen."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.settings import Settings
from tests.served import FLAGS, chromium_or_skip, served


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
    with served(Settings(data_dir=tmp_path_factory.mktemp("docs"))) as at:
        yield at


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    path = chromium_or_skip()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=FLAGS)
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
