"""Gains and weights that are moved in Chromium: plots follow, and show what the service says of the same request."""

from __future__ import annotations

import copy
import re
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest

from service.examples import example
from tests.service.workbench.point_pages import DRAWN, made, post, trace, until, visit

pytestmark = pytest.mark.browser

POLES = "poles at this gain"


@pytest.fixture(scope="module")
def design(address: str) -> dict[str, Any]:
    return made(address, example("wind_tunnel"))


def previewed(address: str, design: dict[str, Any], name: str, changes: dict[str, float], **more: Any) -> Any:
    """Studies of a controller at point 3 with some gains or weights changed, by a request of our own."""
    request = dict(design["request"])
    request["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [1531.25]}
    controller = dict(next(one for one in request["controllers"] if one["name"] == name))
    if controller["kind"] == "lqr":
        controller["weights"] = controller["weights"] | changes
    else:
        own = next(one for one in design["controllers"] if one["name"] == name)
        controller["gains"] = {gain["name"]: gain["values"][0][3] for gain in own["gains"]} | changes
    request["controllers"] = [controller]
    body = {"request": request, "studies": ["point", "response"], "samples": 301} | more
    return post(address, "v1/previews", body)["studies"]


def slide(tab: Any, knob: str, decades: float) -> float:
    """Move a slider as a hand does; the value that it then has."""
    script = "(el, at) => { el.value = String(at); el.dispatchEvent(new Event('input', {bubbles: true})); }"
    tab.locator(f'[data-knob="{knob}"]').evaluate(script, decades)
    return float(tab.locator(f'[data-field="{knob}"]').input_value())


def settled(tab: Any, knob: str, value: float) -> None:
    """Wait until the address has the value and everything was asked for with it."""
    until(tab, f"location.hash.includes('{knob}={value:g}')")
    until(tab, "!document.querySelector('[aria-busy]')")


def complexes(found: dict[str, Any]) -> list[complex]:
    return sorted((complex(x, y) for x, y in zip(found["x"], found["y"], strict=True)), key=lambda p: (p.real, p.imag))


def wire(poles: list[dict[str, float]]) -> list[complex]:
    return sorted((complex(pole["re"], pole["im"]) for pole in poles), key=lambda p: (p.real, p.imag))


def far(ours: list[complex], theirs: list[complex]) -> float:
    """Largest distance from one of our poles to the nearest of theirs, in parts of its distance from the origin."""
    return max(min(abs(p - q) for q in theirs) / max(abs(p), 1.0) for p in ours)


@pytest.mark.parametrize(("controller", "gain"), [("nf", "K_i"), ("pf", "K_i"), ("nf", "K_d")])
def test_a_gain_moves_the_poles(tab: Any, address: str, design: dict[str, Any], controller: str, gain: str) -> None:
    visit(tab, address, design, "root-locus", controller=controller, loop=gain)
    tab.locator(DRAWN).nth(1).wait_for()
    before = complexes(trace(tab, POLES))
    step = trace(tab, "aileron", 1)["y"]
    value = slide(tab, gain, -0.11)
    gain_shown = f"at gain {value:.4g} "
    until(tab, "(text) => document.querySelector('.view .plot-canvas').ariaLabel.includes(text)", gain_shown)
    at_once = complexes(trace(tab, POLES))
    study = previewed(
        address, design, controller, {gain: value}, studies=["point", "response", "root_locus"], loop=gain
    )
    locus = study["root_locus"]
    assert locus["chosen_gain"] == value
    at = locus["gains"].index(value)
    wanted = wire([branch[at] for branch in locus["branches"]])
    assert far(at_once, wanted) < 0.02  # between the samples of the locus
    assert far(before, wanted) > 0.02
    settled(tab, gain, value)
    until(tab, f"(was) => document.querySelectorAll('.view .plot-canvas')[1].data[0].y.at(100) !== {step[100]}")
    assert far(complexes(trace(tab, POLES)), wanted) < 1e-6
    np.testing.assert_allclose(trace(tab, "aileron", 1)["y"], study["response"]["signals"]["da_deg"], rtol=1e-9)
    np.testing.assert_allclose(trace(tab, "aileron as designed", 1)["y"], step, rtol=1e-12)
    margin = study["point"]["controllers"][0]["margins"]["tab"]["phase_margin_deg"]
    row = tab.get_by_role("row", name="tab: phase margin").inner_text()
    assert f"{margin:.4g}" in row
    if gain == "K_d":
        closed = wire(study["point"]["controllers"][0]["poles"])
        assert far(complexes(trace(tab, "all loops closed")), closed) < 1e-9


def test_a_slow_service_has_the_last_word(tab: Any, address: str, design: dict[str, Any]) -> None:
    """Poles between the samples of the old locus give way to those of the new one, however late it comes."""
    visit(tab, address, design, "root-locus", controller="nf", loop="K_d")
    tab.locator(DRAWN).nth(1).wait_for()
    until(tab, "!document.querySelector('[aria-busy]')")

    def late(route: Any) -> None:
        tab.wait_for_timeout(700)
        route.continue_()

    tab.route("**/v1/previews", late)
    value = slide(tab, "K_d", 0.2)
    settled(tab, "K_d", value)
    locus = previewed(address, design, "nf", {"K_d": value}, loop="K_d", studies=["root_locus"])["root_locus"]
    at = locus["gains"].index(value)
    assert far(complexes(trace(tab, POLES)), wire([branch[at] for branch in locus["branches"]])) < 1e-9


def test_a_weight_moves_the_poles(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "point-weights", controller="lqr")
    tab.locator(DRAWN).nth(2).wait_for()
    value = slide(tab, "aileron_rate_deg_s", 0.6)
    settled(tab, "aileron_rate_deg_s", value)
    study = previewed(address, design, "lqr", {"aileron_rate_deg_s": value})
    wanted = wire(study["point"]["controllers"][0]["poles"])
    assert far(complexes(trace(tab, "now")), wanted) < 1e-9
    assert far(complexes(trace(tab, "as designed")), wanted) > 0.02
    np.testing.assert_allclose(trace(tab, "aileron", 1)["y"], study["response"]["signals"]["T_a_n_m"], rtol=1e-9)


def test_diagonal_entries_of_explicit_weights(tab: Any, address: str) -> None:
    request = example("wind_tunnel")
    Q = np.diag([40.0, 0.02, 800.0, 0.08, 3e5]).tolist()
    weights = {"rule": "explicit", "Q": Q, "R": [[4.0, 0.0], [0.0, 0.25]], "N": None}
    request["controllers"] = [request["controllers"][2] | {"weights": weights}]
    design = made(address, request)
    visit(tab, address, design, "point-weights", controller="lqr")
    tab.locator(DRAWN).nth(2).wait_for()
    knobs = tab.locator("[data-knob]").evaluate_all("(all) => all.map((one) => one.dataset.knob)")
    assert knobs == ["Q_dt", "Q_dt_rate", "Q_da", "Q_da_rate", "Q_int_a", "R_T_t", "R_T_a"]
    value = slide(tab, "Q_da", 1.0)
    settled(tab, "Q_da", value)
    assert value == 8000.0
    changed = [list(row) for row in Q]
    changed[2][2] = value
    study = previewed(address, design, "lqr", {"Q": changed})  # type: ignore[dict-item]
    assert far(complexes(trace(tab, "now")), wire(study["point"]["controllers"][0]["poles"])) < 1e-9


def test_keys_move_sliders(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "bode", controller="nf")
    tab.locator(DRAWN).first.wait_for()
    designed = float(tab.get_by_label("K_p", exact=True).input_value())
    slider = tab.get_by_role("slider", name="K_p, slider")
    slider.focus()
    for _ in range(5):
        tab.keyboard.press("ArrowRight")
    value = float(tab.get_by_label("K_p", exact=True).input_value())
    assert value == pytest.approx(designed * 10**0.05, rel=1e-3)
    assert slider.get_attribute("aria-valuetext") == f"{value:.4g}"
    settled(tab, "K_p", value)
    now, first = trace(tab, "magnitude now"), trace(tab, "magnitude as designed")
    assert np.max(np.abs(np.array(now["y"]) - np.array(first["y"]))) > 0.1
    tab.get_by_role("button", name="Back to the design's gains").click()
    until(tab, "!location.hash.includes('K_p=')")
    assert float(tab.get_by_label("K_p", exact=True).input_value()) == designed


def test_the_address_restores_loop_and_gains(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "root-locus", controller="nf", loop="K_p", K_p=0.3, K_i=40, damping=0.7)
    tab.locator(DRAWN).nth(1).wait_for()
    until(tab, "!document.querySelector('[aria-busy]')")
    study = previewed(address, design, "nf", {"K_p": 0.3, "K_i": 40.0}, studies=["point", "root_locus"], loop="K_p")
    locus = study["root_locus"]
    wanted = wire([branch[locus["gains"].index(0.3)] for branch in locus["branches"]])
    least = f"plot.data.find((one) => one.name === '{POLES}').x.reduce((a, b) => Math.min(a, b))"
    script = (
        f"(x) => {{ const plot = document.querySelector('.view .plot-canvas'); return Math.abs({least} - x) < 1e-6; }}"
    )
    until(tab, script, wanted[0].real)
    assert far(complexes(trace(tab, POLES)), wanted) < 1e-6
    assert tab.get_by_label("Loop", exact=True).input_value() == "K_p"
    assert [float(tab.get_by_label(name, exact=True).input_value()) for name in ("K_p", "K_i")] == [0.3, 40.0]
    line = trace(tab, "damping ratio 0.7")
    assert -line["x"][0] / np.hypot(line["x"][0], line["y"][0]) == pytest.approx(0.7)


def test_moves_are_of_one_controller(tab: Any, address: str, design: dict[str, Any]) -> None:
    """K_i of one controller at one point is not that of another."""
    visit(tab, address, design, "root-locus", controller="nf", K_i=40)
    tab.locator(DRAWN).nth(1).wait_for()
    tab.get_by_label("Controller").select_option("pf")
    tab.get_by_label("K_f", exact=True).wait_for()
    own = next(gain for gain in design["controllers"][1]["gains"] if gain["name"] == "K_i")["values"][0][3]
    assert float(tab.get_by_label("K_i", exact=True).input_value()) == pytest.approx(own, rel=1e-4)
    assert "K_i" not in parse_qs(urlsplit(tab.url).fragment)
    assert "K_i=" not in tab.url


def test_unstable_gains_are_said_to_be(tab: Any, address: str, design: dict[str, Any], watch: Any) -> None:
    watch.refused.add(409)
    visit(tab, address, design, "root-locus", controller="nf", loop="K_p")
    tab.locator(DRAWN).nth(1).wait_for()
    field = tab.get_by_label("K_p", exact=True)
    field.fill("6")
    field.press("Enter")
    refused = tab.locator(".view .message.refused")
    refused.wait_for()
    assert len(refused.inner_text()) > 20
    assert re.search(r"gain 6 .*unstable", tab.locator(".view .plot-canvas").first.get_attribute("aria-label"))
    tab.get_by_role("button", name="Back to the design's gains").click()
    refused.wait_for(state="detached")
    assert tab.locator(".view .stale").count() == 0


def test_a_factor_on_the_loop(tab: Any, address: str, design: dict[str, Any]) -> None:
    """Opened at an actuator, the poles move along the branches and nothing is asked of the service."""
    visit(tab, address, design, "root-locus", controller="lqr", loop="aileron")
    tab.locator(DRAWN).nth(1).wait_for()
    until(tab, "!document.querySelector('[aria-busy]')")
    before = complexes(trace(tab, POLES))
    asked: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    slide(tab, "factor", -0.4)
    until(tab, "location.hash.includes('factor=')")
    assert far(before, complexes(trace(tab, POLES))) > 0.02
    assert [one for one in asked if "/v1/" in one] == []


def test_moves_go_into_the_draft(tab: Any, address: str, design: dict[str, Any]) -> None:
    visit(tab, address, design, "root-locus", controller="nf", K_p=0.3)
    tab.locator(DRAWN).nth(1).wait_for()
    tab.get_by_role("button", name="Take these gains").click()
    tab.get_by_text("The gains of nf are in the request").wait_for()
    script = """async ([draft, design, controller]) => {
      const { taken } = await import(new URL("workbench/js/views/live/take.js", document.baseURI));
      return taken(draft, design, controller);
    }"""
    wanted = {"K_d": 0.01, "K_p": 0.3, "K_i": 40.0}
    controller = design["request"]["controllers"][0] | {"gains": wanted}
    fresh = tab.evaluate(script, [None, design, controller])
    assert fresh["controllers"][0]["gains"] == wanted
    assert fresh["controllers"][1:] == design["request"]["controllers"][1:]
    draft = design["request"] | {"name": "mine", "controllers": design["request"]["controllers"][::-1]}
    kept = tab.evaluate(script, [draft, design, controller])
    assert (kept["name"], kept["controllers"][2]["gains"]) == ("mine", wanted)
    other = tab.evaluate(script, [draft | {"controllers": draft["controllers"][:1]}, design, controller])
    assert other["name"] == design["name"]


def test_what_is_drawn_follows_the_theme(tab: Any, address: str, design: dict[str, Any]) -> None:
    """Marks in the colour of ink are seen on both grounds, without being drawn for it by the view."""
    visit(tab, address, design, "root-locus", controller="nf")
    tab.locator(DRAWN).last.wait_for()
    mark = "document.querySelector('.view .plot-canvas').data.find(({name}) => name === 'open-loop poles').marker.color"
    ink = "getComputedStyle(document.documentElement).getPropertyValue('--ink').trim()"
    seen = set()
    for theme in ("light", "dark"):
        tab.get_by_label("Theme").select_option(theme)
        until(tab, f"{mark} === {ink}")
        seen.add(tab.evaluate(mark))
    assert len(seen) == 2


ON_TORQUES = [[4.0, 0.0], [0.0, 0.25]]
EXPLICIT = {"rule": "explicit", "Q": np.diag([400.0, 0.1, 400.0, 0.1, 9e3]).tolist(), "R": ON_TORQUES}
OUTPUT = {"rule": "output", "outputs": ["da", "int_a"], "W_y": [[400.0, 0.0], [0.0, 9e3]], "W_u": ON_TORQUES}


@pytest.mark.parametrize(("weights", "knob", "path"), [(EXPLICIT, "R_T_a", "R"), (OUTPUT, "W_T_a", "W_u")])
def test_weights_of_any_rule_move_the_grid(
    tab: Any, address: str, weights: dict[str, Any], knob: str, path: str
) -> None:
    request = example("wind_tunnel")
    request["controllers"] = [request["controllers"][2] | {"weights": copy.deepcopy(weights)}]
    design = made(address, request)
    visit(tab, address, design, "weights", controller="lqr", gain="K_T_a_da")
    tab.locator(DRAWN).last.wait_for()
    value = slide(tab, knob, -1.0)
    assert value == pytest.approx(0.025)
    settled(tab, knob, value)
    request["controllers"][0]["weights"][path][1][1] = value
    gains = made(address, request)["controllers"][0]["gains"]
    expected = next(gain["values"] for gain in gains if gain["name"] == "K_T_a_da")
    assert trace(tab, "altitude")["y"] == expected[0]


def test_a_view_of_weights_is_opened_with_a_controller_that_has_some(
    tab: Any, address: str, design: dict[str, Any]
) -> None:
    visit(tab, address, design, "bode", controller="pf")
    tab.locator(DRAWN).last.wait_for()
    for view in ("Weights over the grid", "Weights of a regulator", "Phase plane"):
        tab.get_by_role("link", name=view).click()
        tab.locator(DRAWN).last.wait_for()
        assert tab.get_by_label("Controller", exact=True).input_value() == "lqr"
