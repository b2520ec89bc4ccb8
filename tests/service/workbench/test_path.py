"""From the front door to a file; addresses that bring a view back; the two themes; the keyboard alone."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.browser


def download(tab: Any, name: str, press: Callable[[], None]) -> Path:
    with tab.expect_download() as saved:
        press()
    assert saved.value.suggested_filename == name
    return Path(saved.value.path())


def test_a_newcomer_gets_from_the_front_door_to_a_file(tab: Any, open_example: Callable[..., None]) -> None:
    open_example(tab)
    tab.get_by_role("link", name="Download").click()
    button = tab.get_by_role("button", name="Download .csv")
    table = download(tab, "wind_tunnel_nf.csv", button.click).read_text(encoding="utf-8")
    rows = list(csv.reader(line for line in table.splitlines() if not line.startswith("#")))
    assert "K_p" in " ".join(rows[0])
    assert len(rows) == 1 + 8
    tab.get_by_label("Controller", exact=True).select_option("lqr")
    download(tab, "wind_tunnel_lqr.dml", tab.get_by_role("button", name="Download .dml").click)


def test_the_map_shows_what_the_design_says(tab: Any, open_example: Callable[..., None], address: str) -> None:
    open_example(tab)
    design = tab.evaluate("location.href").partition("design=")[2].partition("&")[0]
    gains = tab.request.get(f"{address}/v1/designs/{design}").json()["controllers"][0]["gains"]
    tab.get_by_text("Data", exact=True).click()
    shown = [float(cell) for cell in tab.locator(".plot details td:last-child").all_inner_texts()]
    expected = [value for row in gains[0]["values"] for value in row]
    assert shown == pytest.approx(expected, rel=1e-3)
    tab.locator(".plot-canvas").evaluate("el => el.emit('plotly_click', {points: [{x: '980', y: '3000'}]})")
    assert "point=6" in tab.evaluate("location.hash")
    assert tab.get_by_label("Point", exact=True).input_value() == "6"
    tab.get_by_role("navigation", name="Views of this point").get_by_role("link", name="Root locus").click()
    tab.get_by_role("heading", name="Gains of nf at this point").wait_for()
    assert tab.get_by_label("Point", exact=True).input_value() == "6"
    assert float(tab.get_by_label("K_p", exact=True).input_value()) == pytest.approx(gains[1]["values"][1][2], rel=1e-4)


def test_an_address_brings_the_view_back(
    tab: Any, new_tab: Callable[..., Any], open_example: Callable[..., None]
) -> None:
    open_example(tab)
    tab.get_by_label("Controller", exact=True).select_option("pf")
    tab.get_by_label("Point", exact=True).select_option("5")
    tab.get_by_label("Colour by").select_option("verdict.spec_pack.gain_margin_db_min")
    other = new_tab()
    other.goto(tab.evaluate("location.href"))
    other.locator(".plot-canvas .main-svg").first.wait_for()
    assert other.get_by_label("Controller", exact=True).input_value() == "pf"
    assert other.get_by_label("Point", exact=True).input_value() == "5"
    assert other.get_by_label("Colour by").input_value() == "verdict.spec_pack.gain_margin_db_min"
    label = other.locator(".plot-canvas").get_attribute("aria-label")
    assert "gain margin" in label
    assert "missed" in label


def test_back_and_forward(tab: Any, open_example: Callable[..., None]) -> None:
    open_example(tab)
    shown = tab.evaluate("location.href")
    tab.get_by_role("link", name="Download").click()
    tab.get_by_role("heading", name="Files of wind_tunnel").wait_for()
    tab.go_back()
    tab.get_by_role("heading", name="Map of the envelope").wait_for()
    assert tab.evaluate("location.href") == shown
    tab.go_back()
    tab.get_by_role("heading", name="Open a design").wait_for()
    tab.go_forward()
    tab.get_by_role("heading", name="Map of the envelope").wait_for()


@pytest.mark.parametrize(
    "hash_", ["#/explore/none?point=999&controller=nobody", "#/nothing", "#/explore/map?point=-4", "#%%%"]
)
def test_wrong_addresses_lead_somewhere(tab: Any, address: str, hash_: str) -> None:
    tab.goto(f"{address}/{hash_}")
    tab.get_by_role("heading", name="Open a design").wait_for()


def test_a_design_that_is_not_there_is_said(tab: Any, watch: Any, address: str) -> None:
    watch.refused.add(404)
    tab.goto(f"{address}/#/explore/map?design=00000000000000000000000000000000")
    tab.get_by_role("alert").wait_for()
    assert "00000000000000000000000000000000" in tab.get_by_role("alert").inner_text()
    tab.get_by_role("button", name="Open another design").click()
    tab.get_by_role("heading", name="Open a design").wait_for()


def test_points_and_controllers_that_a_design_has_not(
    tab: Any, new_tab: Callable[..., Any], open_example: Callable[..., None]
) -> None:
    open_example(tab)
    other = new_tab()
    other.goto(
        tab.evaluate("location.href").replace("point=0", "point=88").replace("controller=nf", "controller=nobody")
    )
    other.locator(".plot-canvas .main-svg").first.wait_for()
    assert other.get_by_label("Point", exact=True).input_value() == "0"
    assert other.get_by_label("Controller", exact=True).input_value() == "nf"


def test_below_a_path_of_a_proxy(tab: Any, watch: Any, address: str) -> None:
    """Every request stays below the path that the page is at."""

    def proxy(route: Any) -> None:
        path = route.request.url.removeprefix(address)
        if not path.startswith("/gain/"):
            watch.outside.append(path)
        route.continue_(url=address + path.removeprefix("/gain"))

    tab.route(f"{address}/**", proxy)
    tab.goto(f"{address}/gain/")
    tab.get_by_role("button", name="Open wind_tunnel", exact=True).click()
    tab.locator(".plot-canvas .main-svg").first.wait_for()
    tab.get_by_role("link", name="Download").click()
    with tab.expect_download() as saved:
        tab.get_by_role("button", name="Download .csv").click()
    assert saved.value.suggested_filename == "wind_tunnel_nf.csv"


def test_themes(tab: Any, new_tab: Callable[..., Any], open_example: Callable[..., None]) -> None:
    open_example(tab)
    ground = "getComputedStyle(document.body.parentElement).backgroundColor"
    ink = "document.querySelector('.plot-canvas .xtick text').style.fill"
    light, light_ink = tab.evaluate(ground), tab.evaluate(ink)
    tab.get_by_label("Theme").select_option("dark")
    tab.wait_for_function(f"({ink}) !== '{light_ink}'")
    assert tab.evaluate(ground) != light
    tab.reload()
    tab.locator(".plot-canvas .main-svg").first.wait_for()
    assert tab.evaluate("document.documentElement.dataset.theme") == "dark"
    tab.get_by_label("Theme").select_option("auto")
    assert tab.evaluate(ground) == light
    dark = new_tab(scheme="dark")
    dark.goto(tab.evaluate("location.href"))
    dark.locator(".plot-canvas .main-svg").first.wait_for()
    assert dark.evaluate(ground) != light


def test_the_keyboard_alone(tab: Any, address: str) -> None:
    tab.goto(f"{address}/")
    tab.get_by_role("button", name="Open wind_tunnel", exact=True).wait_for()
    tab.keyboard.press("Tab")
    assert focused(tab) == "Skip to the content"
    reach(tab, "Open wind_tunnel")
    tab.keyboard.press("Enter")
    tab.locator(".plot-canvas .main-svg").first.wait_for()
    reach(tab, "Map of the grid: arrow keys choose a point")
    for key in ("ArrowRight", "ArrowUp", "ArrowUp", "ArrowRight", "ArrowLeft"):
        tab.keyboard.press(key)
    assert "point=5" in tab.evaluate("location.href")
    tab.wait_for_function("document.getElementById('status').textContent.startsWith('point 5')")
    tab.evaluate("document.activeElement.blur()")
    reach(tab, "Download")
    tab.keyboard.press("Enter")
    tab.locator(".files").first.wait_for()
    reach(tab, "Download .npz: NumPy arrays")
    download(tab, "wind_tunnel_nf.npz", lambda: tab.keyboard.press("Enter"))


def focused(tab: Any) -> str:
    name: str = tab.evaluate("(e => (e.getAttribute('aria-label') ?? e.textContent).trim())(document.activeElement)")
    return name


def reach(tab: Any, name: str) -> None:
    """Press Tab until what has this name has the focus, which must be seen."""
    for _ in range(80):
        tab.keyboard.press("Tab")
        if focused(tab) == name:
            assert tab.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
            return
    pytest.fail(f"Tab does not lead to {name}")
