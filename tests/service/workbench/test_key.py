"""A server that asks for keys: the page asks for one, shows it with every request, and forgets it with the tab."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from service.access.keys import add_key
from service.settings import Settings
from service.store.store import Store

pytestmark = pytest.mark.browser


@pytest.fixture
def token(tmp_path: Path) -> str:
    store = Store(tmp_path)
    made = add_key(store.keys, "alice", "write")
    store.close()
    return made.token


@pytest.fixture
def address(tmp_path: Path, token: str, serve: Any) -> Iterator[str]:
    with serve(Settings(data_dir=tmp_path, require_keys=True)) as at:
        yield at


def test_the_page_asks_for_a_key_and_shows_it(
    new_tab: Callable[..., Any], watch: Any, address: str, token: str
) -> None:
    watch.refused.add(401)
    tab = new_tab()
    tab.goto(f"{address}/")
    dialog = tab.get_by_role("dialog")
    dialog.wait_for()
    assert "asks for a key" in dialog.inner_text()
    tab.get_by_label("API key").fill("gf_0000000000000000_wrong")
    tab.get_by_role("button", name="Use this key").click()
    tab.get_by_text("the key opens nothing").wait_for()
    tab.get_by_label("API key").fill(token)
    tab.keyboard.press("Enter")
    tab.get_by_role("button", name="Open wind_tunnel", exact=True).click()
    tab.locator(".plot-canvas .main-svg").first.wait_for()
    assert tab.get_by_role("dialog").count() == 0
    tab.get_by_role("link", name="Jobs").click()
    tab.get_by_text("No jobs").wait_for()
    # Kept for this tab only: another one is asked again, and may do without.
    other = new_tab()
    other.goto(f"{address}/")
    other.get_by_role("button", name="Not now").click()
    other.get_by_text("asks for a key").first.wait_for()
    assert token not in tab.content()
