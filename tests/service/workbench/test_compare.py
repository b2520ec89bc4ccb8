"""Two designs, or two controllers of one, side by side; the verdicts of all controllers."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.workbench.envelope_pages import Page

pytestmark = pytest.mark.browser


def compare(page: Page, design: Any, **query: object) -> None:
    text = "".join(f"&{name}={value}" for name, value in query.items())
    page.tab.goto(f"{page.address}/#/compare?design={design['id']}{text}")
    page.tab.get_by_role("heading", name="What the requests differ in").wait_for()
    page.tab.locator("[aria-busy], .message.loading").first.wait_for(state="detached")


def test_two_designs_side_by_side(page: Page) -> None:
    design, other = page.design(), page.design("wind_tunnel_23012")
    answer = page.get(f"designs/{design['id']}/compare?with={other['id']}&controller=nf")
    compare(page, design, **{"with": other["id"]}, controller="nf", point=3, figure="figures.settling_time_s")
    page.tab.locator(".plot-canvas .main-svg").nth(2).wait_for()
    said = page.tab.get_by_role("table", name="Differences of the requests").inner_text()
    for difference in answer["request_differences"]:
        assert difference["pointer"] in said
    for place, part in enumerate(("value", "other", "difference")):
        values = [next(f for f in one["figures"] if f["name"] == "settling_time_s")[part] for one in answer["points"]]
        assert page.plotted(place)[0]["z"] == [values[:4], values[4:]]
    page.tab.get_by_label("Compare by").select_option("gains.K_p")
    gain = [next(g for g in one["gains"] if g["name"] == "K_p")["other"] for one in answer["points"]]
    page.eventually(lambda: page.plotted(1)[0]["z"], [gain[:4], gain[4:]])
    assert "figure=gains.K_p" in page.tab.url
    carried = page.tab.locator("section", has_text="Gains carried").last.inner_text()
    summary = answer["on_other_plant"]
    assert f"at {summary['points_held_by_margin']} the nu-gap is below the margin" in carried
    assert carried.count("by its poles only") == sum(
        one[side]["held_by_margin"] is False and one[side]["stable"]
        for one in answer["points"]
        for side in ("on_other_plant", "other_on_this_plant")
    )
    page.pick("{x: '245', y: '3000'}")
    page.tab.get_by_role("heading", name="Point 4: altitude 3000 m, dynamic pressure 245 Pa").wait_for()
    assert page.point() == "4"


def test_two_controllers_of_one_design(page: Page) -> None:
    """Without another design the next controller is taken; nothing is carried to a plant that is the same."""
    design = page.design()
    compare(page, design)
    page.tab.locator(".plot-canvas .main-svg").nth(2).wait_for()
    assert page.tab.locator(".map-card h4").all_inner_texts()[:2] == ["nf", "pf"]
    assert "The two requests are the same." in page.tab.locator("main").inner_text()
    assert page.tab.get_by_text("Gains carried to the other plant").count() == 0
    page.tab.get_by_label("its controller").select_option("lqr")
    page.eventually(lambda: page.tab.locator(".map-card h4").all_inner_texts()[:2], ["nf", "lqr"])
    assert "other=lqr" in page.tab.url
    assert page.tab.locator("td", has_text="NaN").count() == 0


def test_grids_without_a_common_point_and_a_design_that_is_not_there(page: Page, watch: Any) -> None:
    request = page.example()
    request["grid"] = {"altitude_m": [100.0], "dynamic_pressure_pa": [300.0]}
    design, apart = page.design(), page.post("designs", request)
    compare(page, design, **{"with": apart["id"]})
    said = page.tab.get_by_role("region", name="Common points").inner_text()
    assert page.get(f"designs/{design['id']}/compare?with={apart['id']}")["reason"] in said
    assert page.tab.locator(".plot-canvas").count() == 0
    watch.refused.add(404)
    page.tab.goto(f"{page.address}/#/compare?design={design['id']}&with={'0' * 32}")
    refused = page.tab.locator(".message.refused")
    refused.wait_for()
    assert "there is no design" in refused.inner_text()
    page.tab.get_by_label("with design").select_option(apart["id"])
    refused.wait_for(state="detached")


def test_no_design_is_open(page: Page) -> None:
    page.tab.goto(f"{page.address}/#/compare")
    page.tab.get_by_role("button", name="Open a design").click()
    page.tab.get_by_role("heading", name="Open a design").wait_for()


def test_verdicts_of_every_controller(page: Page) -> None:
    design = page.design()
    page.open("verdicts", design)
    for controller in design["controllers"]:
        table = page.tab.get_by_role("table", name=f"Verdicts of {controller['name']}")
        assert table.locator("tbody tr").count() == len(controller["verdicts"])
        assert table.locator(".tag.bad").count() == sum(not one["passed"] for one in controller["verdicts"])
    row = page.tab.get_by_role("table", name="Verdicts of nf").locator("tr", has_text="tab rate")
    assert "at most 400 deg/s" in row.inner_text()
    assert "91.8 deg/s outside" in row.inner_text()
    row.get_by_role("button").click()
    page.tab.locator(".plot-canvas .main-svg").first.wait_for()
    assert "#/explore/map" in page.tab.url
    worst = next(one for one in design["controllers"][0]["verdicts"] if one["spec"] == "tab_rate_deg_s_max")
    assert page.point() == str(worst["worst_point"])
    assert page.parameter("figure") == "verdict.limits.tab_rate_deg_s_max"


def test_what_stands_in_the_way(page: Page) -> None:
    request = page.example()
    specs = {"damping_ratio_min": 0.7, "settling_time_s_max": 0.1, "overshoot_percent_max": 5.0}
    request["controllers"] = [request["controllers"][0] | {"specs": specs | {"phase_margin_deg_min": 45.0}}]
    design = page.post("designs", request)
    outcomes = [outcome for row in design["controllers"][0]["outcomes"] for outcome in row]
    lacking = [i for i, outcome in enumerate(outcomes) if outcome != "ok"]
    page.open("verdicts", design, show="missed", point=1)
    table = page.tab.get_by_role("table", name="Points without gains")
    assert table.locator("tbody tr").count() == len(lacking) > 1
    found = page.get(f"designs/{design['id']}/points/{lacking[0]}")["controllers"][0]["infeasibility"]
    said = page.tab.locator(".view").inner_text()
    assert f"What stands in the way at point {lacking[0]}" in said
    assert "In the way first: phase margin" in said
    assert page.tab.locator("li", has_text="laxer").count() == len(found["relaxations"])
    table.get_by_role("button", name=f"point {lacking[1]}").click()
    page.tab.get_by_role("heading", name=f"What stands in the way at point {lacking[1]}").wait_for()


def test_an_address_without_a_controller_has_one(page: Page) -> None:
    design = page.design()
    page.open("map", design, controller="lqr")
    page.tab.evaluate("hash => { location.hash = hash; }", f"#/explore/poles?design={design['id']}")
    page.tab.locator(".plot-canvas .main-svg").first.wait_for()
    assert page.tab.get_by_label("Controller", exact=True).input_value() == "nf"
    assert page.tab.locator(".message.refused").count() == 0
