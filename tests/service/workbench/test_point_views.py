"""Views at a point in Chromium: what they show is what the service answers, and refusals are said in words."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from service.examples import example
from tests.service.workbench.point_pages import DRAWN, ask, made, post, trace, until, visit

pytestmark = pytest.mark.browser

VIEWS = ("root-locus", "point-weights", "bode", "nichols", "response", "plant")


@pytest.fixture(scope="module")
def design(address: str) -> dict[str, Any]:
    return made(address, example("wind_tunnel"))


@pytest.mark.parametrize("controller", ["nf", "pf", "lqr"])
def test_every_view_renders(tab: Any, address: str, design: dict[str, Any], controller: str) -> None:
    for view in VIEWS:
        visit(tab, address, design, view, controller=controller)
        if view == "point-weights" and controller != "lqr":
            tab.get_by_text("has no weights").wait_for()
            continue
        tab.locator(DRAWN).first.wait_for()
        assert tab.locator(".message.refused").count() == 0, view
        labels = tab.locator(".view .plot-canvas").evaluate_all("(all) => all.map((one) => one.ariaLabel)")
        assert min(map(len, labels)) > 30, view
        unnamed = "(all) => all.filter((one) => !one.labels.length && !one.ariaLabel).length"
        assert tab.locator(".view input, .view select, .view textarea").evaluate_all(unnamed) == 0, view


@pytest.mark.parametrize("width", [820, 1280])
def test_nothing_is_wider_than_the_page(
    new_tab: Callable[..., Any], address: str, design: dict[str, Any], width: int
) -> None:
    tab = new_tab(width=width)
    for view in VIEWS:
        visit(tab, address, design, view, controller="lqr")
        tab.locator(DRAWN).first.wait_for()
        assert tab.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0, view


@pytest.mark.parametrize(("controller", "cut"), [("nf", "tab"), ("pf", "tab"), ("lqr", "tab"), ("lqr", "aileron")])
def test_margins_are_marked_on_the_loop(
    tab: Any, address: str, design: dict[str, Any], controller: str, cut: str
) -> None:
    """The curve crosses 0 dB and the half turns where the service has the margins, several inputs or one."""
    visit(tab, address, design, "bode", controller=controller, transfer=f"loop.{cut}")
    tab.locator(DRAWN).first.wait_for()
    point = ask(address, design, "points/3")
    margins = next(one for one in point["controllers"] if one["name"] == controller)["margins"][cut]
    size, phase = trace(tab, "magnitude now"), trace(tab, "phase now")
    for margin in margins["phase_margins"]:
        at = np.log(margin["omega_rad_s"])
        assert np.interp(at, np.log(size["x"]), size["y"]) == pytest.approx(0.0, abs=0.15)
        found = np.interp(at, np.log(phase["x"]), phase["y"]) - margin["deg"]
        assert found % 360.0 == pytest.approx(180.0, abs=1.0)
    for margin in margins["gain_margins"]:
        at = np.log(margin["omega_rad_s"])
        assert np.interp(at, np.log(size["x"]), size["y"]) == pytest.approx(-margin["db"], abs=0.4)
    assert trace(tab, "phase margins")["x"][::3] == pytest.approx([m["omega_rad_s"] for m in margins["phase_margins"]])
    label = tab.locator(".view .plot-canvas").get_attribute("aria-label")
    assert f"disk margin {margins['disk_margin']:.4g}" in label


def test_disk_touches_the_nyquist_curve(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "nichols", controller="pf", form="nyquist")
    tab.locator(DRAWN).first.wait_for()
    disk, curve = trace(tab, "disk"), trace(tab, "loop")
    centre = (min(disk["x"]) + max(disk["x"])) / 2
    radius = (max(disk["x"]) - min(disk["x"])) / 2
    nearest = np.min(np.abs(np.array(curve["x"]) + 1j * np.array(curve["y"]) - centre))
    assert nearest == pytest.approx(radius, rel=2e-2)
    tab.get_by_role("checkbox").uncheck()
    until(tab, "document.querySelector('.view .plot-canvas').ariaLabel.startsWith('Nichols')")
    assert max(abs(x % 360.0 - 180.0) for x in trace(tab, "disk")["x"] if x is not None) < 90.0
    assert "form" not in tab.url


def test_transfers_are_those_of_the_service(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "bode", controller="lqr")
    tab.locator(DRAWN).first.wait_for()
    tab.get_by_label("Transfer").select_option("disturbance.T_a_disturbance.da")
    until(tab, "document.querySelector('.view .plot-canvas').ariaLabel.includes('T_a_disturbance to da')")
    drawn = trace(tab, "magnitude now")
    answer = ask(address, design, f"controllers/lqr/frequency-response?point=3&count={len(drawn['x'])}")
    wanted = next(one for one in answer["disturbance"] if (one["from"], one["to"]) == ("T_a_disturbance", "da"))
    np.testing.assert_allclose(drawn["y"], 20.0 * np.log10(wanted["magnitude"]), rtol=1e-9)
    assert "transfer=disturbance.T_a_disturbance.da" in tab.url


def test_responses_and_limits(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "response", controller="lqr")
    tab.locator(DRAWN).nth(3).wait_for()
    for kind, name in (("linear", "linear"), ("nonlinear", "simulated")):
        answer = ask(address, design, f"controllers/lqr/response?point=3&kind={kind}&samples=501")["signals"]
        np.testing.assert_allclose(trace(tab, f"tab {name}", 1)["y"], answer["dt_rate_deg_s"], rtol=1e-12)
        power = np.array(answer["T_a_n_m"]) * np.radians(answer["da_rate_deg_s"])
        np.testing.assert_allclose(trace(tab, f"aileron {name}", 3)["y"], power, rtol=1e-9, atol=1e-12)
    words = tab.locator(".view .reasons").first.inner_text()
    assert re.search(r"exceeded\s+Rate of the tab: .* 634 deg/s, 58\.5 % over the limit of 400 deg/s; simulated", words)
    assert re.search(r"kept\s+Deflection of the tab", words)
    limits = tab.evaluate("document.querySelectorAll('.view .plot-canvas')[1].layout.shapes.map((one) => one.y0)")
    assert sorted(limits) == [-400.0, 400.0]
    verdicts = tab.get_by_role("table", name="Verdicts of lqr").inner_text()
    assert re.search(r"tab rate\s+at most 400 deg/s\s+634 deg/s\s+missed", verdicts)
    tab.get_by_label("Samples").select_option("201")
    until(tab, "document.querySelector('.view .plot-canvas').data[0].x.length === 201")


def test_plant_and_its_text(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "plant")
    tab.locator(DRAWN).first.wait_for()
    point = ask(address, design, "points/3")
    poles = trace(tab, "open-loop poles")
    assert sorted(poles["x"]) == pytest.approx(sorted(pole["re"] for pole in point["poles"]))
    area = tab.get_by_label("Linear model as text")
    matlab = area.input_value()
    rows = re.search(r"^A = \[(.*?)\];", matlab, re.DOTALL | re.MULTILINE)
    assert rows
    A = [[float(cell) for cell in row.split(",")] for row in rows.group(1).split(";")]
    assert point["linear_model"]["A"] == A
    tab.get_by_label("As text for").select_option("numpy")
    until(tab, "document.querySelector('.model-text').value.startsWith('import numpy')")
    names: dict[str, Any] = {}
    exec(area.input_value(), names)
    for matrix in "ABCD":
        np.testing.assert_array_equal(names[matrix], point["linear_model"][matrix])
    assert names["states"] == point["linear_model"]["states"]


def test_no_gains_at_the_point(tab: Any, address: str, watch: Any) -> None:
    request = example("wind_tunnel")
    request["controllers"] = [request["controllers"][0]]
    request["controllers"][0]["specs"] = {"damping_ratio_min": 0.9, "settling_time_s_max": 0.001}
    design = made(address, request)
    reason = design["controllers"][0]["reasons"][0][3]
    assert reason
    watch.refused.add(409)
    for view in ("root-locus", "bode", "nichols", "response"):
        visit(tab, address, design, view, controller="nf")
        refused = tab.locator(".view .message:not(.loading)")
        refused.wait_for()
        said = refused.inner_text()
        assert reason in said if view != "response" else len(said) > 20, view
        assert tab.locator(DRAWN).count() == 0, view


def test_no_locus_of_a_sampled_regulator(tab: Any, address: str, watch: Any) -> None:
    """What the service refuses is said in its place; the step and the margins are shown all the same."""
    request = example("wind_tunnel")
    request["controllers"] = [request["controllers"][2] | {"sample_time_s": 0.005}]
    design = made(address, request)
    watch.refused.add(409)
    visit(tab, address, design, "root-locus", controller="lqr")
    tab.locator(".view .message.refused").wait_for()
    tab.locator(DRAWN).first.wait_for()
    assert len(trace(tab, "aileron")["y"]) == 301
    assert "phase margin" in tab.get_by_role("table", name="Margins and step").inner_text()


def test_a_point_of_the_request(tab: Any, address: str) -> None:
    """Values over the grid become those of the point, whichever way they are written."""
    request = example("wind_tunnel")
    specs = request["controllers"][0]["specs"]
    specs["damping_ratio_min"] = {"axis": "dynamic_pressure_pa", "values": [0.41, 0.42, 0.43, 0.44]}
    specs["phase_margin_deg_min"] = {"axis": "altitude_m", "values": [40.0, 41.0]}
    specs["gain_margin_db_min"] = {"values": [[5.0, 5.1, 5.2, 5.3], [5.4, 5.5, 5.6, 5.7]]}
    design = made(address, request)
    tab.goto(address)
    script = """async ([design, point]) => {
      const { narrowed } = await import(new URL("workbench/js/views/live/narrow.js", document.baseURI));
      return narrowed(design, point, "nf");
    }"""
    found = tab.evaluate(script, [design, 6])
    assert found["grid"] == {"altitude_m": [3000.0], "dynamic_pressure_pa": [980.0]}
    own = found["controllers"][0]
    assert len(found["controllers"]) == 1
    assert (own["specs"]["damping_ratio_min"], own["specs"]["phase_margin_deg_min"]) == (0.43, 41.0)
    assert own["specs"]["gain_margin_db_min"] == 5.6
    gains = {gain["name"]: gain["values"][1][2] for gain in design["controllers"][0]["gains"]}
    assert own["gains"] == gains
    mine = post(address, "v1/previews", {"request": found, "studies": ["point"]})["studies"]["point"]["controllers"][0]
    kept = ask(address, design, "points/6")["controllers"][0]
    for name in ("gain_margin_up_db", "phase_margin_deg", "delay_margin_s", "disk_margin"):
        assert mine["margins"]["tab"][name] == pytest.approx(kept["margins"]["tab"][name], rel=1e-9)
