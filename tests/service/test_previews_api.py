"""Previews answer what a kept design's own routes answer, and keep nothing."""

from __future__ import annotations

from typing import Any

import pytest
from fastapi.testclient import TestClient

STUDIES = {
    "point": "points/3",
    "root_locus": "controllers/{name}/root-locus?point=3",
    "response": "controllers/{name}/response?point=3&samples=301",
    "frequency_response": "controllers/{name}/frequency-response?point=3&count=300",
    "actuator_requirements": "controllers/{name}/actuator-requirements",
}


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_says_what_a_kept_design_says(
    client: TestClient, wanted: dict[str, Any], design: dict[str, Any], name: str
) -> None:
    body = {"request": wanted, "studies": list(STUDIES), "controller": name, "point": 3}
    found = client.post("/v1/previews", json=body)
    assert found.status_code == 200, found.text
    document = found.json()
    assert document["design"] == {key: design[key] for key in document["design"]}
    for study, path in STUDIES.items():
        kept = client.get(f"/v1/designs/{design['id']}/{path.format(name=name)}").json()
        assert document["studies"][study] == kept, study


def test_keeps_nothing(client: TestClient, quick: dict[str, Any]) -> None:
    quick["name"] = "never kept"
    listed = client.get("/v1/designs").json()
    found = client.post("/v1/previews", json={"request": quick}).json()
    assert client.get("/v1/designs").json() == listed
    assert set(found["design"]).isdisjoint({"id", "links", "provenance"})
    assert found["studies"] == dict.fromkeys(STUDIES)


def test_gains_that_are_given_are_flown(client: TestClient, wanted: dict[str, Any]) -> None:
    """The locus of the inner loop passes through the poles at the gain that was given."""
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    for K_p in (0.2, 0.4):
        wanted["controllers"] = [wanted["controllers"][0] | {"gains": {"K_p": K_p, "K_d": 0.002, "K_i": 4.0}}]
        body = {"request": wanted, "studies": ["root_locus", "response"], "loop": "K_p"}
        studies = client.post("/v1/previews", json=body).json()["studies"]
        assert studies["root_locus"]["chosen_gain"] == pytest.approx(K_p)
        assert len(studies["response"]["time_s"]) == 301


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        (lambda body: body["request"]["geometry"].update(chord_m=-1.0), "/request/geometry/chord_m"),
        (lambda body: body["request"]["controllers"].append(body["request"]["controllers"][0]), "/request/controllers"),
        (lambda body: body["request"].update(grid={"altitude_m": [0.0], "mach": [1.2]}), "/request/grid"),
        (lambda body: body.update(studies=["response", "response"]), "/studies"),
        (lambda body: body.update(studies=["poetry"]), "/studies/0"),
        (lambda body: body.update(studies=["response"], point=99), "/point"),
        (lambda body: body.update(studies=["response"], samples=10**6), "/samples"),
        (lambda body: body.update(studies=["root_locus"], loop="K_none"), "/loop"),
        (lambda body: body.update(keep=True), "/keep"),
    ],
)
def test_refusals_name_the_field(
    client: TestClient, quick: dict[str, Any], refused: Any, change: Any, pointer: str
) -> None:
    body: dict[str, Any] = {"request": quick}
    change(body)
    problem = refused(client.post("/v1/previews", json=body), 422)
    assert problem["errors"][0]["pointer"].startswith(pointer)


def test_weights_that_cannot_work_are_named_in_the_request(
    client: TestClient, quick: dict[str, Any], refused: Any
) -> None:
    zero, one = [[0.0] * 5 for _ in range(5)], [[-1.0, 0.0], [0.0, 1.0]]
    quick["controllers"][0]["weights"] = {"rule": "explicit", "Q": zero, "R": one}
    problem = refused(client.post("/v1/previews", json={"request": quick}), 422)
    assert problem["errors"][0]["pointer"].startswith("/request/controllers/0/weights")


def test_nobody_of_that_name(client: TestClient, quick: dict[str, Any], refused: Any) -> None:
    refused(client.post("/v1/previews", json={"request": quick, "studies": ["response"], "controller": "x"}), 404)
    refused(client.post("/v1/previews", json={"request": quick, "studies": ["point"], "point": 99}), 404)


def test_limits_name_themselves(client: TestClient, quick: dict[str, Any], refused: Any) -> None:
    quick["grid"]["dynamic_pressure_pa"] = {"from": 200.0, "to": 2000.0, "count": 5000}
    problem = refused(client.post("/v1/previews", json={"request": quick}), 422)
    assert problem["code"] == "limit_exceeded"
    assert problem["errors"][0]["pointer"] == "/request/grid"
