"""Views over the envelope: every one draws, and what is drawn are the numbers of the API."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.service.workbench.envelope_pages import Page

pytestmark = pytest.mark.browser

View = Callable[..., Any]
DRIVER = ("GL Driver Message", "willReadFrequently")


def flat(rows: Any) -> list[float]:
    return [value for row in rows for value in row]


@pytest.mark.parametrize("example", ["wind_tunnel", "airliner_aileron"])
def test_every_view_draws_and_says_what_it_shows(page: Page, example: str) -> None:
    page.open("map", page.design(example), controller="lqr", point=3)
    views = page.tab.locator(".view-list a")
    titles = views.all_inner_texts()
    assert len(titles) >= 9
    for title in titles:
        views.get_by_text(title, exact=True).click()
        assert page.tab.locator(".view > h3").inner_text() == title
        if (example, title) == ("airliner_aileron", "Response in time"):
            # Its simulation is a job of ten seconds and more; what is exact is there at once.
            page.tab.get_by_text("is under way").wait_for()
            page.eventually(page.tab.locator(".plot-canvas .main-svg").count, 12)
        else:
            page.settled()
        assert page.tab.locator(".view .message.refused").count() == 0, title
        drawn = page.tab.locator(".plot-canvas .main-svg").count()
        assert drawn >= 1 or title == "Verdicts", title
        for canvas in page.tab.locator(".plot-canvas").all():
            assert canvas.get_attribute("role") == "img"
            assert len(canvas.get_attribute("aria-label") or "") > 30


def test_the_map_has_the_figures_of_the_api(page: Page) -> None:
    design = page.design()
    below = f"designs/{design['id']}/controllers/nf/"
    verdicts = {(one["source"], one["spec"]): one for one in page.get(below + "verdicts")["verdicts"]}
    tab_rate = page.get(below + "actuator-requirements")["actuators"]["tab"]["peak_rate_deg_s"]
    poles = [page.get(f"designs/{design['id']}/points/{point}")["controllers"][0]["poles"] for point in range(8)]
    decay = [-max(pole["re"] for pole in of_point) for of_point in poles]
    missed = verdicts["limits", "tab_rate_deg_s_max"]["passes"]
    expected = {
        "gain.K_p": flat(design["controllers"][0]["gains"][1]["values"]),
        "value.phase_margin_deg_min": flat(verdicts["request", "phase_margin_deg_min"]["values"]),
        "actuator.tab.peak_rate_deg_s": flat(tab_rate),
        "loop.decay_rate_1_s": decay,
        "verdict.limits.tab_rate_deg_s_max": [float(not passed) for passed in flat(missed)],
        "outcome": [0.0] * 8,
    }
    page.open("map", design, controller="nf")
    for figure, values in expected.items():
        page.tab.get_by_label("Colour by").select_option(figure)
        page.eventually(
            lambda wanted=values: flat(page.plotted()[0]["z"]) == pytest.approx(wanted, rel=1e-6),  # type: ignore[misc]
            True,
        )


def test_a_click_and_the_arrow_keys_choose_a_point_of_the_map(page: Page) -> None:
    page.open("map", page.design(), controller="nf")
    heat = page.plotted()[0]
    assert (heat["x"], heat["y"]) == (["245", "551.25", "980", "1531.25"], ["0", "3000"])
    page.pick("{x: '980', y: '3000'}")
    assert page.point() == "6"
    assert "Point 6" in page.tab.locator(".view").inner_text()
    page.tab.get_by_role("application").focus()
    page.tab.keyboard.press("ArrowDown")
    page.tab.keyboard.press("ArrowRight")
    page.tab.keyboard.press("ArrowRight")
    assert page.point() == "3"
    assert "chosen is point 3" in (page.tab.locator(".plot-canvas").get_attribute("aria-label") or "")


def test_a_proof_is_drawn_between_the_grid_lines_with_what_refutes_it(page: Page) -> None:
    request = page.example()
    request["grid"]["dynamic_pressure_pa"] = [245.0, 3000.0]
    request["controllers"] = [request["controllers"][0] | {"specs": {"damping_ratio_min": 0.2}}]
    design = page.post("designs", request)
    cell = page.get(f"designs/{design['id']}/verification")["controllers"]["nf"]["cells"][0]
    assert cell["status"] == "refuted"
    page.open("map", design, figure="proof")
    cells, points, refuted = page.plotted()[:3]
    assert (cells["x"], cells["y"], cells["z"]) == ([245, 3000], [0, 3000], [[3]])
    found = cell["counterexample"]
    assert (refuted["x"], refuted["y"]) == ([found["dynamic_pressure_pa"]], [found["altitude_m"]])
    assert points["x"] == [245, 3000, 245, 3000]
    assert page.tab.locator(".heatmap-label text").first.text_content() == "R"
    page.pick("{data: {meta: 'points'}, pointNumber: 2}")
    assert page.point() == "2"
    table = page.tab.locator(".view table").last.inner_text()
    assert "refuted" in table
    assert "at 3000 m, 1622 Pa" in table or "1623 Pa" in table


def test_gains_are_drawn_and_read_between_the_points_as_the_schedule_does(page: Page) -> None:
    design = page.design("airliner_aileron")
    page.open("gains", design, gain="K_T_a_da", at0=1000, at1=5100, rule="monotone_cubic")
    gain = next(one for one in design["controllers"][0]["gains"] if one["name"] == "K_T_a_da")
    read = page.get(
        f"designs/{design['id']}/controllers/lqr/gains?altitude_m=1000&dynamic_pressure_pa=5100&rule=monotone_cubic"
    )
    page.eventually(lambda: len(page.plotted()), 5)
    lines = page.plotted()
    assert [line["y"] for line in lines[:4]] == gain["values"]
    assert (lines[4]["x"], lines[4]["y"]) == ([5100], [read["gains"]["K_T_a_da"]])
    page.tab.get_by_label("As", exact=True).select_option("contour")
    page.eventually(lambda: page.plotted()[0]["z"], gain["values"])
    assert "as=contour" in page.tab.url


def test_a_surface_in_three_dimensions_is_behind_a_choice(page: Page, watch: Any) -> None:
    design = page.design("airliner_aileron")
    page.open("gains", design, gain="K_T_a_da", **{"as": "surface"})
    page.tab.locator(".plot-canvas canvas").first.wait_for()
    gain = next(one for one in design["controllers"][0]["gains"] if one["name"] == "K_T_a_da")
    assert page.plotted()[0]["z"] == gain["values"]
    # What the software renderer of a headless browser says about its own speed is no failure of the page.
    watch.failures[:] = [one for one in watch.failures if not any(words in one for words in DRIVER)]


def test_poles_of_all_points_with_a_symbol_for_each_altitude(page: Page) -> None:
    design = page.design()
    page.open("poles", design, controller="pf", of="both")
    documents = [page.get(f"designs/{design['id']}/points/{point}") for point in range(8)]
    poles = [[pole["re"] for pole in one["controllers"][1]["poles"]] for one in documents]
    low, high, _, _, plant, chosen = page.plotted()
    assert low["x"] == [value for of_point in poles[:4] for value in of_point]
    assert high["x"] == [value for of_point in poles[4:] for value in of_point]
    assert plant["y"] == [pole["im"] for one in documents for pole in one["poles"]]
    assert chosen["x"] == poles[0]
    page.pick("{customdata: 5}")
    page.eventually(lambda: page.plotted()[5]["x"], poles[5])
    assert page.point() == "5"


def test_sweeps_of_a_quantity_and_of_any_number_of_the_plant(page: Page) -> None:
    design, request = page.design(), page.example()
    plant = {part: request[part] for part in ("geometry", "inertia", "aerodynamics", "atmosphere", "trim")}
    plant["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    values = {"from": 0.0001, "to": 0.001, "count": 7}
    vary = {"pointer": "/inertia/tab/inertia_kg_m2", "values": values}
    swept = page.post("eigenvalue-sweeps", plant | {"vary": vary})["points"][0]
    page.open("sweeps", design, point=2, vary=vary["pointer"], **values)
    branches = page.plotted()[:4]
    assert [one["x"] for one in branches] == [
        [pole["re"] for pole in branch] for branch in swept["coupled"]["branches"]
    ]
    assert page.plotted(1)[0]["y"] == swept["coupled"]["growth_1_s"]
    assert swept["verdict"]["detail"] in page.tab.locator(".view").inner_text()
    page.tab.get_by_label("Model").select_option("decoupled")
    page.eventually(lambda: page.plotted(1)[0]["y"], swept["decoupled"]["growth_1_s"])
    page.tab.get_by_label("to", exact=True).fill("0.00001")
    page.tab.get_by_label("to", exact=True).press("Tab")
    page.tab.get_by_text("The range must rise").wait_for()


def test_the_steady_state_map_has_the_tab_along_x(page: Page) -> None:
    design, request = page.design(), page.example()
    plant = {part: request[part] for part in ("geometry", "inertia", "aerodynamics", "atmosphere", "trim")}
    plant["grid"] = {"altitude_m": [3000.0], "dynamic_pressure_pa": [551.25]}
    angles = {"from": -12, "to": 12, "count": 33}
    answer = page.post("steady-state-maps", plant | {"deflections": {"aileron_deg": angles, "tab_deg": angles}})
    page.open("statics", design, point=5, plane="T_t_n_m", reach=12)
    field, no_aileron_torque = page.plotted()[:2]
    expected = answer["points"][0]
    assert field["z"] == expected["plane"]["T_t_n_m"]
    assert field["x"] == pytest.approx(answer["deflections"]["tab_deg"])
    assert no_aileron_torque["x"] == expected["zero_aileron_torque"]["tab_deg"]
    assert "set by" in page.tab.locator(".view table").last.inner_text()
