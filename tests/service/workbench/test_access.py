"""What everybody needs to use the page: names, roles, landmarks, headings, focus, and contrast in both themes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.browser

NAMED = {
    *("button", "link", "combobox", "textbox", "checkbox", "radio", "slider", "spinbutton", "listbox", "img", "image"),
    *("progressbar", "region", "navigation", "application", "table", "ProgressIndicator"),
}
PANELS = ["start", "explore", "define", "download"]

HERE = Path(__file__).parent
STRUCTURE = (HERE / "page_structure.js").read_text(encoding="utf-8")
CONTRAST = (HERE / "text_contrast.js").read_text(encoding="utf-8")


@pytest.fixture
def show(open_example: Callable[..., None], address: str) -> Callable[[Any, str], None]:
    """Bring a panel up, with everything in it opened."""

    def shown(tab: Any, panel: str) -> None:
        if panel == "start":
            tab.goto(f"{address}/")
            tab.locator(".card").first.wait_for()
            return
        open_example(tab)
        if panel != "explore":
            tab.get_by_role("link", name=panel.capitalize()).click()
            tab.locator(".form .group, .files").first.wait_for()
        tab.evaluate("for (const el of document.querySelectorAll('details')) el.open = true")
        tab.wait_for_timeout(200)

    return shown


@pytest.mark.parametrize("panel", PANELS)
def test_structure_and_names(tab: Any, show: Callable[[Any, str], None], panel: str) -> None:
    show(tab, panel)
    page = tab.evaluate(STRUCTURE)
    assert (page["main"], page["header"], page["lang"]) == (1, 1, "en")
    assert page["status"] == 1
    assert "Gainfield" in page["title"]
    assert page["levels"][0] == 1
    assert page["levels"].count(1) == 1
    assert all(after - before <= 1 for before, after in zip(page["levels"], page["levels"][1:], strict=False)), page[
        "levels"
    ]
    assert len(page["ids"]) == len(set(page["ids"]))
    assert set(page["aims"]) <= set(page["ids"])
    assert max(page["tabindex"], default=0) <= 0
    assert page["unlabelled"] == []
    nodes = tab.context.new_cdp_session(tab).send("Accessibility.getFullAXTree")["nodes"]
    nameless = [
        node
        for node in nodes
        if not node["ignored"] and node["role"]["value"] in NAMED and not node.get("name", {}).get("value", "").strip()
    ]
    assert nameless == []
    assert len(nodes) > 30


@pytest.mark.parametrize("panel", PANELS)
def test_contrast_in_both_themes(tab: Any, show: Callable[[Any, str], None], panel: str) -> None:
    show(tab, panel)
    for theme in ("light", "dark"):
        tab.get_by_label("Theme").select_option(theme)
        found = tab.evaluate(CONTRAST)
        assert len(found) > 10
        assert [entry for entry in found if entry[0] < 4.5] == [], theme


@pytest.mark.parametrize("panel", PANELS)
def test_nothing_runs_out_of_the_window(tab: Any, show: Callable[[Any, str], None], panel: str) -> None:
    show(tab, panel)
    for width in (1280, 820):
        tab.set_viewport_size({"width": width, "height": 900})
        tab.wait_for_timeout(200)
        assert tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        boxes = tab.evaluate("[...document.querySelectorAll('.surface')].map((el) => [el.clientWidth, el.scrollWidth])")
        assert all(scroll <= client + 1 for client, scroll in boxes), (width, boxes)
