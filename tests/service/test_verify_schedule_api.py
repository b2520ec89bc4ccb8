"""Uploaded tables over HTTP: proved, refuted at a point, or why they cannot be proved."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.verify import verify
from service.documentation.body_examples import BODIES
from service.examples import example
from tests.service.flown_answers import posted

VERIFY = "/v1/schedules/verify"
NAMES = ("nf", "pf", "lqr")


@pytest.fixture(scope="module")
def proofs(client: TestClient, design: dict[str, Any]) -> dict[str, Any]:
    """What GET says of every controller of the example."""
    response = client.get(design["links"]["verification"])
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


@pytest.fixture
def body() -> dict[str, Any]:
    """The uploaded table of the documentation that holds, free to be changed."""
    return copy.deepcopy(BODIES[VERIFY]()["proved"]["value"])


def uploaded(client: TestClient, request: dict[str, Any]) -> dict[str, Any]:
    response = client.post(VERIFY, json=request)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def statuses(document: dict[str, Any], name: str) -> list[str]:
    return [cell["status"] for cell in document["controllers"][name]["cells"]]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("by", ["design_id", "design"])
def test_a_designs_own_file_posted_back_is_the_designs_proof(
    client: TestClient, design: dict[str, Any], proofs: dict[str, Any], name: str, by: str
) -> None:
    file = client.get(design["links"]["schedules"][name]["json"]).json()
    request: dict[str, Any] = {"schedule": file, "certificate": True}
    if by == "design_id":
        request |= {"design_id": design["id"], "controller": name}
    else:
        parts = ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "actuators")
        request["design"] = {part: design["request"][part] for part in parts}
        request["controller"] = {"name": name, "kind": file["kind"]}
        if name == "nf":
            request["controller"]["rate_filter_hz"] = 100.0
    found = uploaded(client, request)
    assert found["controllers"][name] == proofs["controllers"][name]
    assert found["grid"] == proofs["grid"]
    of_design = client.get(design["links"]["certificate"][name]).json()
    sent = found["certificate"]["provenance"]
    assert (sent["design_id"], sent["design_name"]) == (None, None)
    assert sent["version"] == of_design["provenance"]["version"]
    assert sent["request_digest"] != of_design["provenance"]["request_digest"]
    own = ("provenance", "sha256")
    assert {k: v for k, v in found["certificate"].items() if k not in own} == {
        k: v for k, v in of_design.items() if k not in own
    }
    assert verify(found["certificate"]).startswith("proved: 3 of 3")


@pytest.mark.parametrize(("name", "gain"), [("nf", "K_p"), ("pf", "K_f"), ("lqr", "K_T_a_int_a")])
def test_one_gain_edited_beyond_its_slack_is_refuted(
    client: TestClient, design: dict[str, Any], name: str, gain: str
) -> None:
    file = client.get(design["links"]["schedules"][name]["json"]).json()
    (edited,) = (one for one in file["gains"] if one["name"] == gain)
    edited["values"][1][2] *= -30.0 if name == "lqr" else 30.0
    request = {"schedule": file, "design_id": design["id"], "controller": name, "certificate": True}
    found = uploaded(client, request)
    assert statuses(found, name) == ["proved", "refuted", "refuted"]
    for cell in found["controllers"][name]["cells"][1:]:
        point = cell["counterexample"]
        assert point["largest_real_part"] > 0.0
        assert 0.0 <= point["altitude_m"] <= 3000.0
        assert 551.25 <= point["dynamic_pressure_pa"] <= 1531.25
    assert found["certificate"]["proved"] == 1


def test_a_table_that_is_stable_at_its_points_only(client: TestClient) -> None:
    """Two speeds are too few: what no sample at the points would see."""
    request = BODIES[VERIFY]()["refuted"]["value"]
    (cell,) = uploaded(client, request)["controllers"]["uploaded"]["cells"]
    assert cell["status"] == "refuted"
    assert 245.0 < cell["counterexample"]["dynamic_pressure_pa"] < 3000.0
    # Flown at the four points as given gains, it is a design without fault.
    table = {g["name"]: {"values": g["values"]} for g in request["schedule"]["gains"]}
    wanted = example("wind_tunnel") | {"name": "coarse"}
    wanted["grid"] = {axis["name"]: axis["values"] for axis in request["schedule"]["axes"]}
    wanted["controllers"] = [request["controller"] | {"name": "given", "gains": table}]
    document = posted(client, wanted)
    assert document["controllers"][0]["outcomes"] == [["ok", "ok"], ["ok", "ok"]]
    (same_cell,) = client.get(f"{document['links']['verification']}?fraction=0").json()["controllers"]["given"]["cells"]
    assert same_cell == cell


def test_the_answer_to_a_bare_table_on_other_axes(client: TestClient, body: dict[str, Any]) -> None:
    body["proof"] = {"fraction": 0.2, "pieces": 4, "margins": True}
    found = uploaded(client, body)
    assert statuses(found, "uploaded") == ["proved", "proved"]
    assert found["certificate"] is None
    assert found["grid"]["shape"] == [2, 3]
    assert found["controllers"]["uploaded"]["summary"]["signal_error"]["proved_percent"] > 0.0
    # The same speeds as airspeeds at sea level, one line of altitude.
    speeds = [float(np.sqrt(2.0 * q / 1.225)) for q in body["schedule"]["axes"][1]["values"]]
    body["schedule"]["axes"][0]["values"] = [0.0]
    body["schedule"]["axes"][1] = {"name": "airspeed_m_s", "unit": "m/s", "values": speeds}
    for gain in body["schedule"]["gains"]:
        gain["values"] = gain["values"][:1]
    assert statuses(uploaded(client, body), "uploaded") == ["proved", "proved"]


def test_points_without_gains(client: TestClient, body: dict[str, Any]) -> None:
    for gain in body["schedule"]["gains"]:
        gain["values"][1][2] = None
    found = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert [cell["status"] for cell in found] == ["proved", "undecided"]
    assert found[1]["reason"] == "grid point [1, 2] is excluded: the table has no gains there"
    assert found[1]["wanted_1_s"] is found[1]["slowest"] is None
    body["schedule"]["outcomes"] = [["ok"] * 3, ["ok", "ok", "infeasible"]]
    body["schedule"]["reasons"] = [[None] * 3, [None, None, "overshoot"]]
    found = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert found[1]["reason"] == "grid point [1, 2] is infeasible: overshoot"
    for gain in body["schedule"]["gains"]:
        gain["values"] = [[None] * 3] * 2
    del body["schedule"]["outcomes"], body["schedule"]["reasons"]
    found = uploaded(client, body | {"certificate": True})
    assert statuses(found, "uploaded") == ["undecided", "undecided"]
    assert found["certificate"] is None


def test_loops_that_cannot_be_proved_say_why(client: TestClient, body: dict[str, Any], wanted: dict[str, Any]) -> None:
    body["design"]["actuators"]["tab"]["delay_s"] = 0.002
    body["proof"] = {"margins": True, "rates": True}
    found = uploaded(client, body)["controllers"]["uploaded"]
    assert [cell["status"] for cell in found["cells"]] == ["sampled", "sampled"]
    assert "transport delay" in found["reason"]
    assert "transport delay" in found["summary"]["signal_error_reason"]
    assert "transport delay" in found["summary"]["rate_bound_reason"]
    body["design"]["aerodynamics"]["virtual_inertia"] = True
    body["design"]["actuators"]["tab"]["delay_s"] = 0.0
    found = uploaded(client, body)["controllers"]["uploaded"]
    assert "virtual inertia" in found["reason"]
    assert all(cell["slowest"] for cell in found["cells"])
    wanted["controllers"] = [wanted["controllers"][2] | {"sample_time_s": 0.005}]
    document = posted(client, wanted | {"name": "digital"})
    cells = client.get(document["links"]["verification"]).json()["controllers"]["lqr"]
    assert {cell["status"] for cell in cells["cells"]} == {"sampled"}
    assert "computer" in cells["reason"]


def test_a_delayed_table_that_is_not_stable_does_not_pass_as_sampled(client: TestClient, body: dict[str, Any]) -> None:
    body["design"]["actuators"]["tab"]["delay_s"] = 0.002
    body["schedule"]["gains"][1]["values"][0][0] *= 50.0
    cells = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert [cell["status"] for cell in cells] == ["undecided", "sampled"]
    assert "grid point [0, 0] is not_certified" in cells[0]["reason"]
