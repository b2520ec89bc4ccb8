"""Views over the envelope in use: what a reader moves, types and starts; refusals in words; addresses."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.service.workbench.envelope_pages import Page

pytestmark = pytest.mark.browser

MOTOR = {
    "name": "m1",
    "stall_torque_n_m": 0.02,
    "no_load_rate_deg_s": 30000.0,
    "continuous_torque_n_m": None,
    "power_w": None,
    "rotor_inertia_kg_m2": None,
    "gear_low": 1,
    "gear_high": 60,
    "efficiency": 0.9,
}


@pytest.fixture
def design(page: Page) -> Any:
    return page.post("designs", page.example())


def test_torque_and_speed_with_the_point_that_sets_each(page: Page, design: Any) -> None:
    path = f"designs/{design['id']}/controllers/lqr/actuator-requirements"
    answer = page.post(path, {"manoeuvre": {"kind": "step", "aileron_deg": 10.0}, "duration_s": 1.0})["linear"]
    page.open("torque-speed", design, controller="lqr", actuator="aileron")
    hull, cloud = page.plotted()[:2]
    expected = answer["torque_speed"]["aileron"]
    assert cloud["x"] == [one["torque_n_m"] for one in expected["cloud"]]
    assert hull["y"][:-1] == [one["rate_deg_s"] for one in expected["hull"]]
    assert (hull["x"][0], hull["y"][0]) == (hull["x"][-1], hull["y"][-1])
    row = page.tab.locator("tr", has_text="peak torque [N m]").inner_text()
    assert "12.83" in row
    assert "over 10" in row
    assert f"point {answer['envelope']['aileron']['peak_torque_n_m']['point']}" in row


def test_candidates_are_judged_and_stay_in_the_address(page: Page, design: Any) -> None:
    page.open("torque-speed", design, controller="lqr", candidates=json.dumps([MOTOR]))
    wanted = {name: MOTOR[name] for name in ("name", "stall_torque_n_m", "no_load_rate_deg_s", "efficiency")}
    body = {"actuator": "tab", "candidates": [wanted | {"gear_ratio": {"low": 1, "high": 60}}]}
    judged = page.post(f"designs/{design['id']}/controllers/lqr/actuator-selection", body)["candidates"][0]
    assert judged["enough"] is False
    page.tab.get_by_role("button", name="Judge the candidates").click()
    page.eventually(lambda: page.plotted()[-1]["name"].split(",")[0], "m1")
    line = page.plotted()[-1]
    assert line["x"][0] == judged["at_surface"]["stall_torque_n_m"]
    assert max(line["y"]) == judged["at_surface"]["no_load_rate_deg_s"]
    assert page.tab.get_by_text("not enough", exact=True).is_visible()
    page.tab.get_by_label("stall torque of m1").fill("1.5")
    page.tab.get_by_label("stall torque of m1").press("Tab")
    page.eventually(lambda: json.loads(page.parameter("candidates"))[0]["stall_torque_n_m"], 1.5)
    page.tab.get_by_role("button", name="Judge the candidates").click()
    page.tab.get_by_text("enough", exact=True).wait_for()


def test_a_candidate_that_is_not_one_is_refused_in_words(page: Page, design: Any, watch: Any) -> None:
    watch.refused.add(422)
    page.open("torque-speed", design, controller="nf", candidates=json.dumps([MOTOR | {"stall_torque_n_m": -1}]))
    page.tab.get_by_role("button", name="Judge the candidates").click()
    assert "stall_torque_n_m" in page.tab.locator(".message.refused").inner_text()
    assert page.tab.locator(".plot-canvas").count() == 1


def test_every_design_flown_at_every_other_point(page: Page, design: Any) -> None:
    below = f"designs/{design['id']}/controllers/nf/"
    pairs = page.get(below + "cross-flight?specs=spec_pack")["pairs"]
    page.open("robust", design, controller="nf", specs="spec_pack")
    levels = [
        [int(s) + int(h) for s, h in zip(*rows, strict=True)]
        for rows in zip(pairs["stable"], pairs["held"], strict=True)
    ]
    assert {0, 1, 2} == {level for row in levels for level in row}
    assert page.plotted()[0]["z"] == levels
    page.tab.get_by_label("Show", exact=True).select_option("damping_ratio")
    page.eventually(lambda: page.plotted()[0]["z"], pairs["damping_ratio"])
    assert page.parameter("figure") == "damping_ratio"


def test_perturbed_plants_are_flown_when_asked(page: Page, design: Any) -> None:
    query = "method=monte_carlo&hinge_moment_percent=15&inertia_percent=10&draws=50"
    answer = page.get(f"designs/{design['id']}/controllers/lqr/robust-performance?{query}")
    page.open("robust", design, controller="lqr", **dict(one.split("=") for one in query.split("&")))
    assert page.tab.locator(".plot-canvas").count() == 1
    page.tab.get_by_role("button", name="Fly them").click()
    page.tab.locator(".plot-canvas").nth(1).wait_for()
    page.eventually(lambda: page.plotted(1)[0]["z"], answer["held"]["part"])
    text = page.tab.locator(".view").inner_text()
    assert "50 plants" in text
    worst = answer["figures"]["damping_ratio"]["worst_of_all"]
    assert f"{worst['value']:.4g}" in text


def test_weights_move_the_whole_grid_and_go_to_the_request(page: Page, design: Any) -> None:
    page.open("weights", design, controller="lqr", aileron_deg=1.25, gain="K_T_a_dt")
    changed = page.example()
    changed["controllers"][2]["weights"]["aileron_deg"] = 1.25
    made = page.post("designs", changed)["controllers"][2]
    values = next(gain["values"] for gain in made["gains"] if gain["name"] == "K_T_a_dt")
    assert [line["y"] for line in page.plotted()[:2]] == values
    was = next(gain["values"] for gain in design["controllers"][2]["gains"] if gain["name"] == "K_T_a_dt")
    assert [line["y"] for line in page.plotted()[2:]] == was
    missed = sum(not verdict["passed"] for verdict in made["verdicts"])
    assert page.tab.locator(".tag.bad").count() == missed >= 1
    page.tab.get_by_label("aileron, largest, slider").focus()
    for _ in range(10):
        page.tab.keyboard.press("ArrowLeft")
    page.eventually(lambda: page.plotted()[0]["y"] != values[0], True)
    page.eventually(lambda: page.parameter("aileron_deg") != "1.25", True)
    smaller = float(page.parameter("aileron_deg"))
    assert smaller == pytest.approx(1.25 * 10**-0.1, rel=0.02)
    page.tab.get_by_role("button", name="Take these weights").click()
    page.tab.get_by_role("link", name="Define").click()
    page.tab.locator("#json").wait_for(state="attached")
    draft = json.loads(page.tab.locator("#json").input_value())
    assert draft["controllers"][2]["weights"]["aileron_deg"] == smaller
    assert [one["name"] for one in draft["controllers"]] == ["nf", "pf", "lqr"]


def test_weights_of_the_design_come_back(page: Page, design: Any) -> None:
    page.open("weights", design, controller="lqr", tab_deg=3)
    was = next(gain["values"] for gain in design["controllers"][2]["gains"] if gain["name"] == "K_T_a_da")
    assert page.plotted()[0]["y"] != was[0]
    page.tab.get_by_role("button", name="Back to the design's weights").click()
    page.eventually(lambda: page.plotted()[0]["y"], was[0])
    assert page.parameter("tab_deg") is None


@pytest.mark.parametrize(
    ("view", "words"), [("weights", "negative feedback"), ("phase", "this study is of state feedback")]
)
def test_what_a_controller_does_not_have_is_said_in_words(
    page: Page, design: Any, watch: Any, view: str, words: str
) -> None:
    watch.refused.add(409)
    page.open(view, design, controller="nf")
    assert words in page.tab.locator(".view .message").inner_text()
    page.tab.get_by_label("Controller", exact=True).select_option("lqr")
    page.tab.locator(".plot-canvas .main-svg").first.wait_for()
    assert page.tab.locator(".view .message.refused, .view .message.empty").count() == 0


def test_the_phase_plane_is_the_step_and_the_starts_of_the_address(page: Page, design: Any) -> None:
    page.open("phase", design, controller="lqr", point=6, plane="torques", starts=3)
    answer = page.get(f"designs/{design['id']}/controllers/lqr/phase-plane?point=6&starts=3&samples=401")
    lines = page.plotted()
    assert [line["x"] for line in lines[:3]] == [one["trajectory"]["aileron_torque_n_m"] for one in answer["free"]]
    assert lines[-2]["y"] == answer["step"]["tab_torque_n_m"]


def test_a_sampled_feedback_has_gains_on_the_map_and_words_elsewhere(page: Page, watch: Any) -> None:
    watch.refused.add(409)
    request = page.example()
    request["controllers"] = [request["controllers"][2] | {"sample_time_s": 0.004}]
    sampled = page.post("designs", request)
    page.open("map", sampled)
    assert page.plotted()[0]["z"] == sampled["controllers"][0]["gains"][0]["values"]
    page.tab.get_by_label("Colour by").select_option("loop.decay_rate_1_s")
    decay = page.get(f"designs/{sampled['id']}/controllers/lqr/figures")["decay_rate_1_s"]
    page.eventually(lambda: page.plotted()[0]["z"], decay)
    page.open("robust", sampled)
    assert "runs as code" in page.tab.locator(".view").inner_text()


def test_much_work_waits_for_the_reader(page: Page) -> None:
    request = page.example()
    request["grid"] = {
        "altitude_m": {"from": 0, "to": 3000, "count": 7},
        "dynamic_pressure_pa": {"from": 245, "to": 1500, "count": 10},
    }
    request["controllers"] = request["controllers"][2:]
    many = page.post("designs", request)
    asked: list[str] = []
    page.tab.on("request", lambda one: asked.append(one.url))
    page.open("map", many, controller="lqr", figure="proof")
    assert page.tab.get_by_role("button", name="Prove 54 cells").is_visible()
    page.open("robust", many, controller="lqr")
    page.tab.get_by_role("button", name="Fly 4900 pairs").wait_for()
    page.open("poles", many, controller="lqr")
    assert len(page.plotted()) == 7 + 7 + 1
    assert not any(word in url for url in asked for word in ("verification", "cross-flight", "/points/"))
