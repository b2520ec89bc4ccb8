"""Searches of Bryson weights over HTTP: what is found, beside the controller's own weights, and what is refused."""

from __future__ import annotations

import copy
import json
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from design.assess import limit_specs
from design.lqr.power_weights import ReferenceStep
from design.lqr.weight_request import WeightSearch
from design.lqr.weight_search import search_weights
from design.lqr.weight_tradeoff import trade_off
from design.outcome import Outcome
from design.specs import Spec
from schedules.run import run
from service.app import create_app
from service.documentation.body_examples import BODIES
from service.documentation.design_examples import design_requests
from service.examples import example
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.to_domain import study_of

SPECS = {"settling_time_s_max": 0.3, "overshoot_percent_max": 5.0, "damping_ratio_min": 0.5}
#: Weight of the wire -> of the domain, and its unit there.
WEIGHTS = {
    "aileron_deg": ("aileron", np.pi / 180.0),
    "aileron_rate_deg_s": ("aileron_rate", np.pi / 180.0),
    "tab_deg": ("tab", np.pi / 180.0),
    "tab_rate_deg_s": ("tab_rate", np.pi / 180.0),
    "aileron_integral_deg_s": ("aileron_integral", np.pi / 180.0),
    "tab_torque_n_m": ("tab_torque", 1.0),
    "aileron_torque_n_m": ("aileron_torque", 1.0),
}
#: Enough of the weights to meet the specs at the last point.
SOME = {"tab_rate_deg_s", "aileron_rate_deg_s", "aileron_integral_deg_s", "aileron_torque_n_m"}
ROUTES = ("weight-search", "trade-off")


@pytest.fixture(scope="module")
def here(design: dict[str, Any]) -> str:
    """Address of the example's controllers."""
    return f"/v1/designs/{design['id']}/controllers"


@pytest.fixture(scope="module")
def found(client: TestClient, here: str) -> dict[str, Any]:
    """The search of two points, each with its own weights."""
    return posted(client, f"{here}/lqr/weight-search", {"specs": SPECS, "points": [3, 1]})


@pytest.fixture(scope="module")
def domain() -> tuple[Any, WeightSearch, Any]:
    """Envelope, search and outcomes of the same question, in the domain's own words."""
    envelope = run(study_of.study(DesignRequest.model_validate(example("wind_tunnel"))))
    study = envelope.study
    specs = (
        Spec("settling_time", "max", 0.3),
        Spec("overshoot", "max", 0.05),
        Spec("damping_ratio", "min", 0.5),
        *limit_specs({"tab": study.tab_actuator, "aileron": study.aileron_actuator}),
    )
    step = ReferenceStep(study.reference.aileron, study.reference.duration)
    search = WeightSearch(envelope.controller("lqr").request, specs, step)  # type: ignore[arg-type]
    others = np.full((2, 4), True)
    others[0, [1, 3]] = False
    return envelope, search, envelope.plant.outcomes.failing(others, Outcome.EXCLUDED, lambda index: "not asked")


def posted(client: TestClient, address: str, body: Any) -> dict[str, Any]:
    response = client.post(address, json=body)
    assert response.status_code in (200, 201), response.text
    document: dict[str, Any] = response.json()
    return document


def maxima(weights: dict[str, Any], names: tuple[str, ...]) -> list[float]:
    inside = {domain: weights[wire] * scale for wire, (domain, scale) in WEIGHTS.items()}
    return [inside[name] for name in names]


def test_answers_are_those_of_the_domain(found: dict[str, Any], domain: tuple[Any, WeightSearch, Any]) -> None:
    envelope, search, outcomes = domain
    assert [point["index"] for point in found["points"]] == [3, 1]
    study = envelope.study
    ours = search_weights(
        envelope.plant.model, search, outcomes, study.tab_actuator, study.aileron_actuator, exchange=True
    )
    for point in found["points"]:
        index = (0, point["index"])
        assert (point["outcome"], point["reason"], point["infeasibility"]) == ("ok", None, None)
        np.testing.assert_allclose(maxima(point["weights"], search.names), ours.maxima[index], rtol=1e-14)
        gains = [gain["value"] for gain in point["gains"]]
        np.testing.assert_allclose(gains[:10], ours.design.K[index].ravel(), rtol=1e-14)
        np.testing.assert_allclose(gains[10:], ours.design.N[index].ravel(), rtol=1e-14)
        assert point["minimised"]["after"] == ours.minimised[index]
        after = {spec["spec"]: spec["after"] for spec in point["specs"]}
        settling, overshoot, damping = ours.achieved[index][:3]
        assert after["settling_time_s_max"] == settling
        assert after["overshoot_percent_max"] == pytest.approx(100.0 * overshoot, rel=1e-12)
        assert after["damping_ratio_min"] == damping
        rate = ours.achieved[index][[spec.quantity for spec in search.specs].index("tab_rate")]
        assert after["tab_rate_deg_s_max"] == pytest.approx(np.rad2deg(rate), rel=1e-12)
    assert found["controller"] is None
    assert found["minimised"] == {"quantity": "total_rms_power", "unit": "W"}
    assert found["step"] == {"aileron_deg": pytest.approx(10.0), "tab_deg": 0.0, "duration_s": 1.0}


def test_before_is_what_the_design_says_of_itself(client: TestClient, here: str, found: dict[str, Any]) -> None:
    asked = client.get(f"{here}/lqr/actuator-requirements").json()["actuators"]
    assert found["before"] == {**example("wind_tunnel")["controllers"][2]["weights"], "tab_integral_deg_s": None}
    for point in found["points"]:
        k = point["index"]
        own = client.get(f"{here.removesuffix('/controllers')}/points/{k}").json()["controllers"][2]
        before = {spec["spec"]: spec["before"] for spec in point["specs"]}
        assert before["settling_time_s_max"] == pytest.approx(own["step"]["settling_time_s"], rel=1e-6)
        assert before["overshoot_percent_max"] == pytest.approx(own["step"]["overshoot_percent"], rel=1e-6)
        assert before["tab_rate_deg_s_max"] == pytest.approx(asked["tab"]["peak_rate_deg_s"][0][k], rel=1e-6)
        power = sum(asked[actuator]["rms_power_w"][0][k] for actuator in ("tab", "aileron"))
        assert point["minimised"]["before"] == pytest.approx(power, rel=1e-6)
        saved = 100.0 * (1.0 - point["minimised"]["after"] / power)
        assert point["minimised"]["saved_percent"] == pytest.approx(saved, rel=1e-6)
        for spec in point["specs"]:
            more = spec["before"] <= spec["limit"] if spec["spec"].endswith("max") else spec["before"] >= spec["limit"]
            assert spec["before_passed"] is more


def judged_anew(client: TestClient, controller: dict[str, Any], specs: dict[str, Any]) -> tuple[Any, Any, Any]:
    """A design with this controller alone, its verdicts by spec, and its actuator requirements."""
    pack = {"spec_pack": {"name": "sought", "specs": specs}}
    made = posted(client, "/v1/designs", example("wind_tunnel") | {"controllers": [controller]} | pack)
    address = f"/v1/designs/{made['id']}/controllers/{controller['name']}"
    said = {one["spec"]: one for one in client.get(f"{address}/verdicts").json()["verdicts"]}
    return made, said, client.get(f"{address}/actuator-requirements").json()["actuators"]


def test_weights_that_were_found_meet_the_specs_in_a_new_design(client: TestClient, here: str) -> None:
    varying = SPECS | {"settling_time_s_max": {"axis": "dynamic_pressure_pa", "values": [0.4, 0.35, 0.3, 0.2]}}
    body = {"specs": varying, "minimised": "peak_aileron_torque", "common": True, "points": [2, 3]}
    found = posted(client, f"{here}/lqr/weight-search", body)
    assert found["points"][0]["weights"] == found["points"][1]["weights"] == found["controller"]["weights"]
    made, said, demand = judged_anew(client, found["controller"], varying)
    gains = {gain["name"]: gain["values"] for gain in made["controllers"][0]["gains"]}
    for point in found["points"]:
        k = point["index"]
        assert point["outcome"] == "ok"
        assert {spec["spec"] for spec in point["specs"]} == set(said)
        for spec in point["specs"]:
            assert said[spec["spec"]]["passes"][0][k] is True
            assert said[spec["spec"]]["limits"][0][k] == spec["limit"]
            assert said[spec["spec"]]["values"][0][k] == pytest.approx(spec["after"], rel=1e-6)
        for gain in point["gains"]:
            assert gains[gain["name"]][0][k] == pytest.approx(gain["value"], rel=1e-9)
        assert demand["aileron"]["peak_torque_n_m"][0][k] == pytest.approx(point["minimised"]["after"], rel=1e-6)


def test_a_point_without_weights_says_why_and_breaks_no_other(
    client: TestClient, here: str, found: dict[str, Any]
) -> None:
    varying = SPECS | {"settling_time_s_max": {"values": [[0.3, 0.001, 0.3, 0.3], [0.3, 0.3, 0.3, 0.3]]}}
    body = {"specs": varying, "points": [1, 3], "exchange": False, "searched": sorted(SOME)}
    mixed = posted(client, f"{here}/lqr/weight-search", body)
    bad, good = mixed["points"]
    assert (bad["outcome"], good["outcome"]) == ("infeasible", "ok")
    assert bad["weights"] is None
    assert bad["minimised"]["after"] is bad["minimised"]["saved_percent"] is None
    assert all(gain["value"] is None for gain in bad["gains"])
    assert all(spec["after"] is None and spec["before"] is not None for spec in bad["specs"])
    assert "settling time at most 0.001 s" in bad["reason"]
    why = bad["infeasibility"]
    missed = {one["spec"] for one in why["nearest_design_misses"]}
    assert "settling_time_s_max" in missed
    (reachable,) = (one["reachable"] for one in why["relaxations"] if one["spec"] == "settling_time_s_max")
    assert why["blocking"] == "settling_time_s_max"
    alone = posted(client, f"{here}/lqr/weight-search", body | {"points": [3]})
    assert alone["points"][0]["weights"] == good["weights"]
    assert alone["points"][0]["gains"] == good["gains"]
    for one, same in zip(alone["points"][0]["specs"], good["specs"], strict=True):
        assert one["after"] == pytest.approx(same["after"], rel=1e-9)
    assert alone["controller"]["weights"] == good["weights"]
    own = example("wind_tunnel")["controllers"][2]["weights"]
    assert {name for name in own if good["weights"][name] != own[name]} == SOME
    enough = body | {"points": [1], "specs": SPECS | {"settling_time_s_max": 1.01 * reachable}}
    assert posted(client, f"{here}/lqr/weight-search", enough)["points"][0]["outcome"] == "ok"


def test_no_one_set_of_weights(client: TestClient, here: str) -> None:
    body = {"specs": {"settling_time_s_max": 0.005}, "common": True, "points": [0, 3], "searched": ["tab_deg"]}
    found = posted(client, f"{here}/lqr/weight-search", body)
    assert found["controller"] is None
    for point in found["points"]:
        assert point["outcome"] == "infeasible"
        assert "no one set of weights" in point["reason"]
        assert point["infeasibility"] is None


def test_the_stricter_of_a_spec_and_the_actuators_limit(client: TestClient, here: str) -> None:
    rates = {"axis": "dynamic_pressure_pa", "values": [300.0, 300.0, 300.0, 900.0]}
    body = {"specs": SPECS | {"tab_rate_deg_s_max": rates, "tab_torque_n_m_max": 50.0}, "searched": ["tab_deg"]}
    asked = {}
    for point in (0, 3):
        (found,) = posted(client, f"{here}/lqr/weight-search", body | {"points": [point]})["points"]
        asked[point] = {spec["spec"]: (spec["limit"], spec["source"]) for spec in found["specs"]}
    assert asked[0]["tab_rate_deg_s_max"] == (300.0, "request")
    assert asked[3]["tab_rate_deg_s_max"][0] == 400.0
    assert asked[0]["tab_torque_n_m_max"] == (2.0, "limits")
    (free,) = posted(client, f"{here}/lqr/weight-search", body | {"points": [3], "actuator_limits": False})["points"]
    assert {spec["spec"]: spec["limit"] for spec in free["specs"]}["tab_rate_deg_s_max"] == 900.0


def test_power_weights_start_from_their_base(client: TestClient) -> None:
    made = posted(client, "/v1/designs", design_requests()["lqr_power"][1])
    address = f"/v1/designs/{made['id']}/controllers/after"
    found = posted(client, f"{address}/weight-search", {"specs": SPECS, "points": [3], "searched": sorted(SOME)})
    assert found["before"]["rule"] == "power"
    demand = client.get(f"{address}/actuator-requirements").json()["actuators"]
    power = demand["tab"]["rms_power_w"][0][3] + demand["aileron"]["rms_power_w"][0][3]
    assert found["points"][0]["minimised"]["before"] == pytest.approx(power, rel=1e-6)
    assert found["controller"]["weights"] == found["points"][0]["weights"]
    plain = posted(client, "/v1/designs", example("wind_tunnel"))["id"]
    body = {"specs": SPECS, "points": [3], "searched": sorted(SOME)}
    same = posted(client, f"/v1/designs/{plain}/controllers/lqr/weight-search", body)
    assert same["points"][0]["weights"] == found["points"][0]["weights"]


def test_trade_off_is_that_of_the_domain(client: TestClient, here: str, domain: tuple[Any, WeightSearch, Any]) -> None:
    envelope, search, outcomes = domain
    body = {"specs": SPECS, "settling_times_s": [0.3, 0.05, 0.04], "points": [3], "searched": sorted(SOME)}
    found = posted(client, f"{here}/lqr/trade-off", body)
    only = outcomes.failing(np.arange(8).reshape(2, 4) != 3, Outcome.EXCLUDED, lambda index: "not asked")
    study, search = envelope.study, replace(search, searched=tuple(WEIGHTS[name][0] for name in sorted(SOME)))
    ours = trade_off(
        envelope.plant.model, search, (0.3, 0.05, 0.04), 8, only, study.tab_actuator, study.aileron_actuator
    )
    (point,) = found["points"]
    front = point["front"]
    kept = np.isfinite(ours.settling_time[0, 3])
    assert [place["settling_time_s"] for place in front] == ours.settling_time[0, 3][kept].tolist()
    assert [place["peak_aileron_torque_n_m"] for place in front] == ours.aileron_torque[0, 3][kept].tolist()
    assert [place["allowed_s"] for place in front] == ours.limit[0, 3][kept].tolist()
    for place, values in zip(front, ours.maxima[0, 3][kept], strict=True):
        np.testing.assert_allclose(maxima(place["weights"], search.names), values, rtol=1e-14)
    assert len(front) >= 2
    assert all(a["peak_aileron_torque_n_m"] > b["peak_aileron_torque_n_m"] for a, b in pairwise(front))
    asked = client.get(f"{here}/lqr/actuator-requirements").json()["actuators"]["aileron"]
    assert point["before"]["peak_aileron_torque_n_m"] == pytest.approx(asked["peak_torque_n_m"][0][3], rel=1e-6)
    fastest = example("wind_tunnel")["controllers"][2] | {"weights": front[0]["weights"]}
    specs = SPECS | {"settling_time_s_max": front[0]["allowed_s"]}
    _, said, demand = judged_anew(client, fastest, specs)
    assert all(one["passes"][0][3] for one in said.values())
    assert demand["aileron"]["peak_torque_n_m"][0][3] == pytest.approx(front[0]["peak_aileron_torque_n_m"], rel=1e-6)


def test_a_trade_off_that_nothing_meets(client: TestClient, here: str) -> None:
    body = {"specs": {"settling_time_s_max": 0.005}, "count": 2, "points": [0], "searched": ["tab_deg"]}
    (point,) = posted(client, f"{here}/lqr/trade-off", body)["points"]
    assert (point["outcome"], point["front"]) == ("infeasible", [])
    assert "settling time" in point["reason"]
    assert point["before"]["settling_time_s"] > 0.005


@pytest.mark.parametrize(
    ("route", "body", "pointer"),
    [
        ("weight-search", {"specs": {}}, "/specs"),
        ("weight-search", {"specs": {"tab_rate_deg_s_max": 30.0}}, "/specs"),
        ("weight-search", {"specs": {"phase_margin_deg_min": 45.0}}, "/specs/phase_margin_deg_min"),
        ("weight-search", {"specs": SPECS | {"overshoot_percent_max": 0.0}}, "/specs/overshoot_percent_max"),
        ("weight-search", {"specs": SPECS, "points": [8]}, "/points/0"),
        ("weight-search", {"specs": SPECS, "points": [0, 10**30]}, "/points/1"),
        ("weight-search", {"specs": SPECS, "points": [1, -1]}, "/points/1"),
        ("weight-search", {"specs": SPECS, "points": [1, 2, 1]}, "/points/2"),
        ("weight-search", {"specs": SPECS, "points": []}, "/points"),
        ("weight-search", {"specs": SPECS, "searched": ["tab"]}, "/searched/0"),
        ("weight-search", {"specs": SPECS, "searched": ["tab_deg", "tab_integral_deg_s"]}, "/searched/1"),
        ("weight-search", {"specs": SPECS, "searched": ["tab_deg", "tab_deg"]}, "/searched/1"),
        ("weight-search", {"specs": SPECS, "span": 1.0}, "/span"),
        ("weight-search", {"specs": SPECS, "span": 9000.0}, "/span"),
        ("weight-search", {"specs": SPECS, "minimised": "noise"}, "/minimised"),
        ("weight-search", {"specs": SPECS, "settling_times_s": [0.1, 0.2]}, "/settling_times_s"),
        (
            "weight-search",
            {"specs": {"damping_ratio_min": {"axis": "mach", "values": [0.5]}}},
            "/specs/damping_ratio_min/axis",
        ),
        (
            "weight-search",
            {"specs": {"damping_ratio_min": {"values": [[0.5] * 4, [0.5] * 3]}}},
            "/specs/damping_ratio_min/values/1",
        ),
        ("trade-off", {"specs": {"damping_ratio_min": 0.5}}, "/specs/settling_time_s_max"),
        ("trade-off", {"specs": SPECS, "settling_times_s": [0.2]}, "/settling_times_s"),
        ("trade-off", {"specs": SPECS, "points": [0], "settling_times_s": [0.2, 0.31]}, "/settling_times_s/1"),
        ("trade-off", {"specs": SPECS, "count": 1}, "/count"),
        ("trade-off", {"specs": SPECS, "common": True}, "/common"),
    ],
)
def test_what_is_asked_wrongly(
    client: TestClient, here: str, refused: Any, route: str, body: Any, pointer: str
) -> None:
    problem = refused(client.post(f"{here}/lqr/{route}", json=body), 422)
    assert problem["code"] == "invalid_request"
    assert problem["errors"][0]["pointer"] == pointer
    assert problem["errors"][0]["allowed"]


@pytest.mark.parametrize("route", ROUTES)
def test_of_controllers_that_have_such_weights(client: TestClient, here: str, refused: Any, route: str) -> None:
    body = {"specs": SPECS, "points": [0]}

    def problem(address: str) -> str:
        answered = refused(client.post(f"{address}/{route}", json=body), 409)
        assert answered["code"] == "study_not_possible"
        return str(answered["detail"])

    for name in ("nf", "pf"):
        assert "of the kind" in problem(f"{here}/{name}")
    refused(client.post(f"{here}/none/{route}", json=body), 404)
    refused(client.post(f"/v1/designs/none/controllers/lqr/{route}", json=body), 404)
    kinds = {
        ("lqr_sampled", "at_500_hz"): "runs on a computer",
        ("lqr_measured", "filtered"): "works its states out",
        ("lqr_structures", "regulator"): "Bryson's rule",
        ("lqr_power", "net_work"): "Bryson's rule",
    }
    for (shown, name), words in kinds.items():
        ident = posted(client, "/v1/designs", design_requests()[shown][1])["id"]
        assert words in problem(f"/v1/designs/{ident}/controllers/{name}")
    plain = example("wind_tunnel")
    plain["controllers"] = [plain["controllers"][2] | {"reference": "none"}]
    ident = posted(client, "/v1/designs", plain)["id"]
    assert "follows no reference" in problem(f"/v1/designs/{ident}/controllers/lqr")


def test_limits_name_themselves(tmp_path: Any, refused: Any) -> None:
    with TestClient(create_app(Settings(data_dir=tmp_path, max_weight_searches=7))) as client:
        address = f"/v1/designs/{posted(client, '/v1/designs', example('wind_tunnel'))['id']}/controllers/lqr"
        for route, body in (
            ("weight-search", {"specs": SPECS}),
            ("trade-off", {"specs": SPECS, "points": [0]}),
            ("trade-off", {"specs": SPECS, "points": [0, 1], "settling_times_s": [0.1, 0.15, 0.2, 0.3]}),
            ("trade-off", {"specs": SPECS, "points": [0], "count": 10**18}),
        ):
            problem = refused(client.post(f"{address}/{route}", json=body), 422)
            assert problem["code"] == "limit_exceeded"
            assert problem["errors"][0]["pointer"] == "/points"
            assert "max_weight_searches" in problem["detail"]
            assert "GAINFIELD_MAX_WEIGHT_SEARCHES" in problem["detail"]
        assert "max_weight_searches" in {one["name"] for one in client.get("/v1/limits").json()["limits"]}


def test_points_outside_the_model_stay_as_they_are(client: TestClient) -> None:
    """One of the two points is beyond the speed of sound: it is no search, and has no figures."""
    fast = example("wind_tunnel")
    fast["grid"] = {"altitude_m": [0.0], "airspeed_m_s": [40.0, 400.0]}
    fast["controllers"] = fast["controllers"][2:]
    address = f"/v1/designs/{posted(client, '/v1/designs', fast)['id']}/controllers/lqr"
    body = {"specs": SPECS, "searched": ["tab_deg"]}
    good, bad = posted(client, f"{address}/weight-search", body)["points"]
    assert bad["outcome"] == "outside_model"
    assert bad["weights"] is None
    assert all(spec["before"] is spec["before_passed"] is spec["after"] is None for spec in bad["specs"])
    assert good["outcome"] in ("ok", "infeasible")
    (lost,) = posted(client, f"{address}/weight-search", body | {"points": [1]})["points"]
    assert lost == bad
    (nothing,) = posted(client, f"{address}/trade-off", {"specs": SPECS, "points": [1]})["points"]
    assert (nothing["outcome"], nothing["front"]) == ("outside_model", [])


@pytest.mark.parametrize(
    "body",
    [
        {"specs": {"settling_time_s_max": 1e-4, "aileron_torque_n_m_max": 1e-9, "tab_power_w_max": 1e-9}},
        {"specs": {"settling_time_s_max": 1e3, "damping_ratio_min": 0.01, "tab_rate_deg_s_max": 1e6}, "span": 1.1},
        {
            "specs": {"overshoot_percent_max": 0.01, "aileron_power_w_max": 1e9},
            "minimised": "energy_out",
            "span": 400.0,
        },
        {"specs": {"damping_ratio_min": 0.99, "aileron_deflection_deg_max": 1e-3}, "minimised": "peak_total_power"},
    ],
)
def test_the_ends_of_the_ranges(client: TestClient, here: str, body: dict[str, Any]) -> None:
    asked = body | {"points": [2], "searched": ["tab_deg", "tab_torque_n_m"], "actuator_limits": False}
    (point,) = posted(client, f"{here}/lqr/weight-search", asked)["points"]
    assert point["outcome"] in ("ok", "infeasible", "not_certified")
    assert (point["reason"] is None) == (point["outcome"] == "ok")


EXAMPLES = [(path, shown["value"]) for path in BODIES if path.endswith(ROUTES) for shown in BODIES[path]().values()]
VALUES = st.sampled_from([0, -1, 1e-9, 0.5, 1, 30, 1e308, 5e-324, 10**400, True, None, "", "tab_deg", [], {}, [[0.5]]])


def places(document: Any, pointer: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    return [place for key, value in items for place in ((*pointer, key), *places(value, (*pointer, key)))]


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_random_values_anywhere(here: str, small: TestClient, refused: Any, data: st.DataObject) -> None:
    """Of a server that searches at no more than one point, so that what can be taken is refused for its size."""
    path, shown = data.draw(st.sampled_from(EXAMPLES))
    document = copy.deepcopy(shown) | {"points": [2, 3]}
    for _ in range(data.draw(st.integers(1, 3))):
        *parents, last = data.draw(
            st.sampled_from([one for one in places(document) if one[:1] != ("points",)] or [("specs",)])
        )
        with suppress(KeyError, IndexError, TypeError):
            place = document
            for part in parents:
                place = place[part]
            place[last] = copy.deepcopy(data.draw(VALUES | st.floats()))
    address = path.replace("{id}", here.split("/")[3]).replace("{name}", "lqr")
    response = small.post(address, content=json.dumps(document), headers={"Content-Type": "application/json"})
    problem = refused(response, 422)
    assert problem["errors"]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A server that searches at one point, with the design of the example."""
    with TestClient(
        create_app(Settings(data_dir=tmp_path_factory.mktemp("small"), max_weight_searches=1)),
        raise_server_exceptions=False,
    ) as client:
        posted(client, "/v1/designs", example("wind_tunnel"))
        yield client
