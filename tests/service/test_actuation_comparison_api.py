"""All controllers of a design side by side over HTTP, against other routes, the domain and a design alone."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.actuation_comparison import rate_limited_actuation, step_actuation
from service.app import create_app
from service.presenters.actuation_comparison import compared_document
from service.settings import Settings
from tests.service.lqr_by_hand import Posted, example, posted

RAD = np.pi / 180.0
RATES = [40.0, 400.0]
#: Figure on the wire -> attribute of the domain's figures, and its size.
FIGURES = {
    "aileron_peak_torque_n_m": ("aileron_peak_torque", 1.0),
    "tab_held_peak_torque_n_m": ("tab_held_peak_torque", 1.0),
    "tab_peak_torque_n_m": ("tab_peak_torque", 1.0),
    "tab_peak_rate_deg_s": ("tab_peak_rate", 1.0 / RAD),
    "tab_peak_deflection_deg": ("tab_peak_deflection", 1.0 / RAD),
    "settling_time_s": ("settling_time", 1.0),
    "overshoot_percent": ("overshoot", 100.0),
}


@pytest.fixture(scope="module")
def tunnel(client: TestClient) -> Posted:
    return posted(client, example("wind_tunnel"))


def comparison(design: Posted, query: str = "?rate_limit_deg_s=40&rate_limit_deg_s=400") -> dict[str, Any]:
    response = design.client.get(f"/v1/designs/{design.design['id']}/actuation-comparison{query}")
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def test_values_are_those_of_the_domain(tunnel: Posted) -> None:
    found, envelope = comparison(tunnel), tunnel.envelope
    assert found["rate_limit_deg_s"] == pytest.approx(RATES)
    assert found["reference"] == {
        "rate_limit_deg_s": None,
        "kind": "step",
        "aileron_deg": pytest.approx(10.0),
        "tab_deg": 0.0,
        "duration_s": 1.0,
    }
    assert [one["name"] for one in found["controllers"]] == ["nf", "pf", "lqr"]
    for one in found["controllers"]:
        controller = tunnel.controller(one["name"])
        step = step_actuation(envelope.plant, controller, envelope.study.reference)
        curves = rate_limited_actuation(envelope.plant, controller, envelope.study.reference, RAD * np.array(RATES))
        assert (one["reason"], one["missing"]) == (None, [])
        for name, (attribute, size) in FIGURES.items():
            expected, over_rates = getattr(step, attribute) * size, getattr(curves, attribute) * size
            np.testing.assert_allclose(one["step"][name], expected, rtol=1e-9)
            np.testing.assert_allclose(one["curves"]["points"][name], over_rates, rtol=1e-7)
            worst = one["envelope"][name]
            assert worst == {"value": pytest.approx(expected.max()), "point": int(np.argmax(expected))}
            for r, at_rate in enumerate(one["curves"]["envelope"][name]):
                assert at_rate["value"] == pytest.approx(over_rates[..., r].max(), rel=1e-7)
                assert np.ravel(over_rates[..., r])[at_rate["point"]] == pytest.approx(at_rate["value"], rel=1e-7)


def test_what_is_saved(tunnel: Posted) -> None:
    """The map and the number, from the torques beside them; and what they are of, from other routes."""
    found = comparison(tunnel)
    for one in found["controllers"]:
        for figures, saved in (
            (one["step"], one["envelope"]["torque_saved_percent"]),
            *(
                ({name: np.array(values)[..., r] for name, values in one["curves"]["points"].items()}, at_rate)
                for r, at_rate in enumerate(one["curves"]["envelope"]["torque_saved_percent"])
            ),
        ):
            own, held = (np.array(figures[f"{what}_peak_torque_n_m"]) for what in ("aileron", "tab_held"))
            np.testing.assert_allclose(figures["torque_saved_percent"], 100.0 * (1.0 - own / held), rtol=1e-9)
            assert saved == pytest.approx(100.0 * (1.0 - own.max() / held.max()), rel=1e-9)
        asked = tunnel.answered(one["name"], "actuator-requirements")
        assert asked["actuators"]["tab"]["peak_torque_n_m"] == one["step"]["tab_peak_torque_n_m"]
        assert asked["actuators"]["tab"]["peak_rate_deg_s"] == one["step"]["tab_peak_rate_deg_s"]
        if "aileron" in asked["actuators"]:
            assert asked["actuators"]["aileron"]["peak_torque_n_m"] == one["step"]["aileron_peak_torque_n_m"]
        point = tunnel.client.get(f"/v1/designs/{tunnel.design['id']}/points/5").json()
        if one["name"] != "lqr":  # without an actuator the aileron has the torque of the trim
            assert one["step"]["aileron_peak_torque_n_m"][1][1] == pytest.approx(abs(point["trim"]["T_a_n_m"]))
        (there,) = [c for c in point["controllers"] if c["name"] == one["name"]]
        assert one["step"]["settling_time_s"][1][1] == there["step"]["settling_time_s"]


def test_the_tab_held_at_rest(tunnel: Posted) -> None:
    """A reference so slow that it is static: the torque that the linear model needs at 10 degrees, or at trim."""
    found = comparison(tunnel, "?rate_limit_deg_s=1")
    (lqr,) = [c for c in found["controllers"] if c["name"] == "lqr"]
    for index in (0, 6):
        point = tunnel.client.get(f"/v1/designs/{tunnel.design['id']}/points/{index}").json()
        A, B = (np.array(point["linear_model"][name])[[1, 3]] for name in ("A", "B"))
        static = point["trim"]["T_a_n_m"] - np.linalg.solve(B, A[:, 2] * 10.0 * RAD)[1]
        expected = max(abs(static), abs(point["trim"]["T_a_n_m"]))
        held = np.ravel(lqr["curves"]["points"]["tab_held_peak_torque_n_m"])[index]
        assert held == pytest.approx(expected, rel=0.02)


def test_rates_unless_they_are_asked_for(tunnel: Posted) -> None:
    found = comparison(tunnel, "")
    assert found["rate_limit_deg_s"] == pytest.approx([20.0, 40.0, 80.0, 160.0, 320.0, 640.0])
    again = comparison(tunnel, "?rate_limit_deg_s=400&rate_limit_deg_s=40&rate_limit_deg_s=400")
    assert again["rate_limit_deg_s"] == pytest.approx([400.0, 40.0, 400.0])
    for one, other in zip(comparison(tunnel)["controllers"], again["controllers"], strict=True):
        curve, turned = (x["curves"]["envelope"]["torque_saved_percent"] for x in (one, other))
        assert turned == [curve[1], curve[0], curve[1]]


def test_what_cannot_be_compared_says_why(client: TestClient) -> None:
    for name, word in (("lqr_sampled", "runs as code"), ("lqr_structures", "no reference")):
        first, *others = comparison(posted(client, example(name)))["controllers"]
        assert word in first["reason"]
        assert first["step"] is first["envelope"] is first["curves"] is None
        assert first["outcomes"] == [["ok"] * 4] * 2
        if name == "lqr_structures":
            assert all(other["reason"] is None for other in others)


def is_of(gap: dict[str, Any], figure: str, rate: float | None) -> bool:
    limit = gap["rate_limit_deg_s"]
    return gap["figure"] == figure and (limit is None if rate is None else limit == pytest.approx(rate))


def test_every_null_is_explained(client: TestClient) -> None:
    """An ideal servo (no torque of its own), points without gains, and a step that is over before it has settled."""
    body = copy.deepcopy(example("wind_tunnel"))
    body["actuators"]["tab"] |= {"servo_bandwidth_hz": None, "servo_damping_ratio": None}
    body["reference"]["duration_s"] = 0.3
    body["controllers"] = [
        {"name": "few", "kind": "positive_feedback", "gains": {"K_f": 0.5, "K_i": 5.0}},
        {"name": "none", "kind": "positive_feedback", "gains": {"K_f": 50.0, "K_i": 5.0}},
    ]
    few, none = comparison(posted(client, body))["controllers"]
    assert (none["reason"], none["step"]) == ("no point carries a design", None)
    ok = np.array(few["outcomes"]).ravel() == "ok"
    assert 0 < ok.sum() < 8
    reasons = {(gap["figure"], gap["rate_limit_deg_s"]): gap for gap in few["missing"]}
    assert len(reasons) == len(few["missing"])
    for rate in (None, *RATES):
        for name in (*FIGURES, "torque_saved_percent"):
            figures = few["step"] if rate is None else few["curves"]["points"]
            values = np.array(figures[name], dtype=object)
            values = values if rate is None else values[..., RATES.index(rate)]
            null = np.flatnonzero([value is None for value in values.ravel()])
            explained = {point for gap in few["missing"] if is_of(gap, name, rate) for point in gap["points"]}
            assert set(null) == explained | set(np.flatnonzero(~ok))
    assert "ideal" in reasons["tab_peak_torque_n_m", None]["reason"]
    assert few["envelope"]["tab_peak_torque_n_m"]["value"] is None
    assert few["envelope"]["tab_peak_torque_n_m"]["point"] in np.flatnonzero(ok)
    assert "settle" in reasons["settling_time_s", None]["reason"]


def test_nothing_to_save(tunnel: Posted) -> None:
    """A torque of zero is no torque to save a part of."""
    controller, study = tunnel.controller("lqr"), tunnel.envelope.study
    step = step_actuation(tunnel.envelope.plant, controller, study.reference)
    still = replace(step, tab_held_peak_torque=np.zeros((2, 4)))
    curves = rate_limited_actuation(tunnel.envelope.plant, controller, study.reference, np.array([1.0]))
    document = compared_document(controller, still, curves, np.array([1.0]))
    assert document["envelope"]["torque_saved_percent"] is None
    (gap,) = document["missing"]
    assert (gap["figure"], list(gap["points"])) == ("torque_saved_percent", list(range(8)))


@pytest.mark.parametrize(
    ("query", "pointer"),
    [
        ("rate_limit_deg_s=0", "/rate_limit_deg_s/0"),
        ("rate_limit_deg_s=50&rate_limit_deg_s=-1", "/rate_limit_deg_s/1"),
        ("rate_limit_deg_s=nan", "/rate_limit_deg_s/0"),
        ("rate_limit_deg_s=fast", "/rate_limit_deg_s/0"),
        ("&".join(["rate_limit_deg_s=5"] * 101), "/rate_limit_deg_s"),
        ("rate=5", "/rate"),
    ],
)
def test_bad_input(tunnel: Posted, refused: Any, query: str, pointer: str) -> None:
    where = f"/v1/designs/{tunnel.design['id']}/actuation-comparison?{query}"
    assert refused(tunnel.client.get(where), 422)["errors"][0]["pointer"] == pointer


def test_limits_and_missing_things(client: TestClient, refused: Any, tmp_path: Path) -> None:
    assert refused(client.get("/v1/designs/0123/actuation-comparison"), 404)["code"] == "not_found"
    with TestClient(create_app(Settings(data_dir=tmp_path, max_compared_samples=30_000))) as small:
        here = posted(small, example("wind_tunnel"))
        where = f"/v1/designs/{here.design['id']}/actuation-comparison"
        problem = refused(small.get(where), 422)
        assert (problem["code"], "max_compared_samples" in problem["detail"]) == ("limit_exceeded", True)
        assert small.get(where + "?rate_limit_deg_s=1000").status_code == 200


def test_a_slow_loop_that_swings_for_long_is_refused_before_it_is_flown(client: TestClient, refused: Any) -> None:
    body = copy.deepcopy(example("wind_tunnel"))
    body["reference"]["duration_s"] = 1000.0
    gains = {"K_d": 0.002, "K_p": 0.6, "K_i": 20.0}
    body["controllers"] = [{"name": "few", "kind": "negative_feedback", "rate_filter_hz": 100.0, "gains": gains}]
    design = posted(client, body).design
    problem = refused(client.get(f"/v1/designs/{design['id']}/actuation-comparison"), 422)
    assert problem["code"] == "limit_exceeded"


def test_what_the_domain_refuses_is_no_fault(tunnel: Posted, refused: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def raising(*_: object, **__: object) -> None:
        raise ValueError("no")

    monkeypatch.setattr("service.routes.actuation_comparison.rate_limited_actuation", raising)
    where = f"/v1/designs/{tunnel.design['id']}/actuation-comparison"
    assert refused(tunnel.client.get(where), 409)["code"] == "study_not_possible"
