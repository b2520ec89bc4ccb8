"""Designs over HTTP: made once, read back byte for byte, listed newest first."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.run import run
from service.app import create_app
from service.designs import design_id
from service.examples import NAMES, example
from service.schemas.design import Design, DesignList
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.to_domain.study_of import study


@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_example_is_answered(client: TestClient, name: str) -> None:
    response = client.post("/v1/designs", json=example(name))
    assert response.status_code in (200, 201)
    document = Design.model_validate(response.json()).model_dump()
    assert document["name"] == name
    assert any("ok" in row for controller in document["controllers"] for row in controller["outcomes"])


def test_created_then_the_same_bytes(client: TestClient, quick: Any) -> None:
    quick["name"] = "created then the same bytes"
    first = client.post("/v1/designs", json=quick, headers={"Prefer": "wait=60"})
    again = client.post("/v1/designs", json=quick, headers={"Prefer": "respond-async"})
    read = client.get(first.headers["Location"])
    assert [first.status_code, again.status_code, read.status_code] == [201, 200, 200]
    assert first.content == again.content == read.content
    assert first.headers["Location"] == again.headers["Location"] == f"/v1/designs/{first.json()['id']}"
    assert first.headers["ETag"] == read.headers["ETag"]


def test_every_spelling_of_a_request_is_one_design(client: TestClient, quick: Any) -> None:
    full = DesignRequest.model_validate(quick)
    del quick["atmosphere"], quick["spec_pack"], quick["aerodynamics"]["damping"], quick["trim"]["aileron_deg"]
    quick["grid"] = dict(reversed(quick["grid"].items())) | {"altitude_m": [0]}
    short = DesignRequest.model_validate(quick)
    assert design_id(short) == design_id(full)
    quick["geometry"]["chord_m"] = 0.6000000000000001
    assert design_id(DesignRequest.model_validate(quick)) != design_id(full)


def test_the_normalised_request_asks_for_the_same_design(client: TestClient, design: dict[str, Any]) -> None:
    again = client.post("/v1/designs", json=design["request"])
    assert again.status_code == 200
    assert again.json()["id"] == design["id"]


def test_gains_are_those_of_the_domain(design: dict[str, Any]) -> None:
    """The wire adds and loses nothing: bit for bit the numbers of `schedules.run.run`."""
    envelope = run(study(DesignRequest.model_validate(example("wind_tunnel"))))
    for on_wire, controller in zip(design["controllers"], envelope.controllers, strict=True):
        for gain, computed in zip(on_wire["gains"], controller.gains, strict=True):
            values = np.array(gain["values"], dtype=float)
            np.testing.assert_array_equal(values, computed.values)
            assert (gain["name"], gain["unit"]) == (computed.name, computed.unit)
            assert np.array_equal(np.isfinite(values), np.array(on_wire["outcomes"]) == "ok")


def test_verdicts_are_in_the_units_of_the_request(design: dict[str, Any], wanted: Any) -> None:
    nf = design["controllers"][0]
    asked = {v["spec"]: v for v in nf["verdicts"] if v["source"] == "request"}
    assert {name: v["limit"] for name, v in asked.items()} == wanted["controllers"][0]["specs"]
    assert {v["unit"] for v in asked.values()} == {"1", "dB", "deg", "s", "%"}
    for verdict in asked.values():
        # A gain exists only where every spec asked for is met.
        low = verdict["spec"].endswith("_min")
        assert verdict["passed"] is True
        assert (verdict["worst_value"] >= verdict["limit"]) if low else (verdict["worst_value"] <= verdict["limit"])
        assert 0 <= verdict["worst_point"] < 8
    limits = {v["spec"]: v["limit"] for v in nf["verdicts"] if v["source"] == "limits"}
    assert limits == {"tab_deflection_deg_max": 25.0, "tab_rate_deg_s_max": 400.0, "tab_torque_n_m_max": 2.0}


def test_a_failed_point_is_a_value(client: TestClient, quick: Any) -> None:
    """A point beyond Mach 1 loses no other point and never carries a gain."""
    quick["grid"] = {"altitude_m": [0.0], "airspeed_m_s": [50.0, 400.0]}
    document = client.post("/v1/designs", json=quick).json()
    (controller,) = document["controllers"]
    assert controller["outcomes"] == [["ok", "outside_model"]]
    assert controller["reasons"][0][0] is None
    assert "Mach" in controller["reasons"][0][1]
    for gain in controller["gains"]:
        assert isinstance(gain["values"][0][0], float)
        assert gain["values"][0][1] is None
    point = client.get(f"/v1/designs/{document['id']}/points/1").json()
    assert point["linear_model"] is None
    assert point["reason"] == controller["reasons"][0][1]


def test_reduced_frequency_over_the_grid(client: TestClient, design: dict[str, Any]) -> None:
    """k = |s| c / (2 V) of a closed-loop pole, and a warning that quasi-steady damping is too quick for it."""
    for controller in design["controllers"]:
        k = np.array(controller["reduced_frequency"])
        assert k.shape == (2, 4)
        point = client.get(f"/v1/designs/{design['id']}/points/0").json()
        (here,) = (c for c in point["controllers"] if c["name"] == controller["name"])
        found = [abs(complex(p["re"], p["im"])) * 0.6 / (2 * point["air"]["airspeed_m_s"]) for p in here["poles"]]
        assert np.min(np.abs(np.array(found) / k[0, 0] - 1)) < 1e-6
    (warning,) = (w for w in design["warnings"] if w["code"] == "reduced_frequency")
    largest = np.max([c["reduced_frequency"] for c in design["controllers"]], axis=0)
    assert warning["points"] == np.flatnonzero(largest > 0.05).tolist()


def test_not_modified(client: TestClient, design: dict[str, Any]) -> None:
    for path in (f"/v1/designs/{design['id']}", f"/v1/designs/{design['id']}/schedules/nf.mat", "/v1/limits"):
        tag = client.get(path).headers["ETag"]
        for sent in (tag, f'"other", W/{tag}', "*"):
            response = client.get(path, headers={"If-None-Match": sent})
            assert (response.status_code, response.content, response.headers["ETag"]) == (304, b"", tag)
        assert client.get(path, headers={"If-None-Match": '"other"'}).status_code == 200


def test_a_conditional_post_is_answered_in_full(client: TestClient, quick: Any) -> None:
    client.post("/v1/designs", json=quick)
    assert client.post("/v1/designs", json=quick, headers={"If-None-Match": "*"}).status_code == 200


def test_head_is_get_without_the_body(client: TestClient, design: dict[str, Any]) -> None:
    for path in (f"/v1/designs/{design['id']}", "/healthz", f"/v1/designs/{design['id']}/schedules/nf.csv"):
        got, head = client.get(path), client.head(path)
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-length"] == str(len(got.content))
        assert head.headers["etag"] == got.headers["etag"]


def test_list_newest_first_by_cursor(tmp_path: Path, quick: Any) -> None:
    with TestClient(create_app(Settings(data_dir=tmp_path))) as client:
        ids = []
        for number in range(5):
            quick["name"] = f"design {number}"
            ids.append(client.post("/v1/designs", json=quick).json()["id"])
        seen, cursor = [], None
        while True:
            page = client.get("/v1/designs", params={"limit": 2} | ({"cursor": cursor} if cursor else {}))
            document = DesignList.model_validate(page.json())
            seen += [item.id for item in document.items]
            if seen == ids[4:2:-1]:
                # A design made while the list is read shifts nothing.
                quick["name"] = "late"
                client.post("/v1/designs", json=quick)
            cursor = document.next_cursor
            assert (cursor is None) == ("next" not in page.links)
            if cursor is None:
                break
            assert page.links["next"]["url"] == f"/v1/designs?limit=2&cursor={cursor}"
        assert seen == ids[::-1]
        assert document.items[-1].link == f"/v1/designs/{ids[0]}"


@pytest.mark.parametrize(
    ("query", "pointer"),
    [
        ("limit=0", "/limit"),
        ("limit=x", "/limit"),
        ("limit=201", "/limit"),
        ("cursor=7", "/cursor"),
        ("cursor=d-7", "/cursor"),
        ("cursor=d%D9%A3", "/cursor"),
        ("cursor=d" + "9" * 30, "/cursor"),
        ("cursor=" + "9" * 41, "/cursor"),
        ("page=2", "/page"),
    ],
)
def test_bad_pages(client: TestClient, refused: Any, query: str, pointer: str) -> None:
    assert refused(client.get(f"/v1/designs?{query}"), 422)["errors"][0]["pointer"] == pointer


@pytest.mark.parametrize("ident", ["0" * 32, "x", "%00", "%ff", "..", "a" * 300, "' OR 1=1 --"])
def test_unknown_design(client: TestClient, refused: Any, ident: str) -> None:
    for rest in ("", "/points/0", "/controllers/nf/root-locus?point=0", "/schedules/nf.csv"):
        assert refused(client.get(f"/v1/designs/{ident}{rest}"), 404)["code"] == "not_found"


def test_links_lead_somewhere(client: TestClient, design: dict[str, Any]) -> None:
    """Every link, of the controllers that it is of; weights without regard to power have no before and after."""
    links = design["links"]
    queries = dict.fromkeys(
        ("root_locus", "response", "frequency_response", "simultaneous_margins", "norms", "phase_plane"), "?point=0"
    )
    queries |= {
        "cross_check": "?points=0",
        "gains": "?altitude_m=0&dynamic_pressure_pa=500",
        "sample_time_sweep": "?from_s=0.001&to_s=0.002&count=2",
    }
    posted = {"weight_search", "trade_off"}
    plain = [what for what, there in links.items() if isinstance(there, str)]
    followed = [links[what].format(index=0) + queries.get(what, "") for what in plain]
    followed += [path for files in links["schedules"].values() for path in files.values()]
    for what in links.keys() - {*plain, "schedules", "power_comparison"} - posted:
        assert set(links[what]) <= {"nf", "pf", "lqr"}
        followed += [path + queries.get(what, "") for path in links[what].values()]
    for path in followed:
        response = client.get(path)
        assert response.status_code == 200, (path, response.text)
    assert set(links["norms"]) == {"lqr"}
    assert set(links["design_margin"]) == {"nf", "pf"}
    assert client.get(links["power_comparison"]["lqr"]).json()["code"] == "study_not_possible"


def test_names_in_any_script(client: TestClient, quick: Any) -> None:
    quick["name"] = 'Höhe "q" \n\t高度 \U0001f6e9 \x7f \x00 <script>'
    document = client.post("/v1/designs", json=quick).json()
    assert document["name"] == quick["name"]
    for suffix in ("json", "csv", "mat"):
        response = client.get(f"/v1/designs/{document['id']}/schedules/lqr.{suffix}")
        assert response.status_code == 200
        name = response.headers["content-disposition"]
        assert name == f'attachment; filename="H-he-q-script_lqr.{suffix}"'
    assert json.loads(client.get(f"/v1/designs/{document['id']}/schedules/lqr.json").content)["design_name"]
