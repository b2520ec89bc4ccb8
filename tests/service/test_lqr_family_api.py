"""Structures, allocations and weights of state feedback over HTTP."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.design_examples import design_requests


def designed(client: TestClient, name: str) -> dict[str, Any]:
    response = client.post("/v1/designs", json=design_requests()[name][1])
    assert response.status_code in (200, 201), response.text
    document: dict[str, Any] = response.json()
    return document


def answered(client: TestClient, design: dict[str, Any], name: str, what: str) -> dict[str, Any]:
    response = client.get(f"/v1/designs/{design['id']}/controllers/{name}/{what}")
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


@pytest.mark.parametrize("example", ["lqr_structures", "lqr_power"])
def test_everything_is_said_of_every_structure(client: TestClient, example: str) -> None:
    design = designed(client, example)
    point = client.get(f"/v1/designs/{design['id']}/points/0")
    assert point.status_code == 200, point.text
    for controller, here in zip(design["controllers"], point.json()["controllers"], strict=True):
        assert set(np.ravel(controller["outcomes"])) == {"ok"}, controller["reasons"]
        assert set(here["margins"]) == {"tab", "aileron"}
        for what in (
            "root-locus?point=0", "response?point=0", "frequency-response?point=0&count=50", "actuator-requirements",
            "verdicts", "scaling",
        ):  # fmt: skip
            answered(client, design, controller["name"], what)
        for suffix in ("json", "csv", "mat"):
            file = client.get(f"/v1/designs/{design['id']}/schedules/{controller['name']}.{suffix}")
            assert file.status_code == 200, file.text


def test_both_references_are_followed(client: TestClient) -> None:
    design = designed(client, "lqr_structures")
    (both,) = [c["name"] for c in design["request"]["controllers"] if c.get("reference") == "aileron_and_tab"]
    found = answered(client, design, both, "response?point=0&duration_s=20")
    signals, step = found["signals"], design["request"]["reference"]
    assert found["reference"] == {
        "kind": "step",
        **{k: step[k] for k in ("aileron_deg", "tab_deg")},
        "duration_s": 20.0,
    }
    assert signals["da_deg"][-1] - signals["da_deg"][0] == pytest.approx(step["aileron_deg"], abs=1e-3)
    assert signals["dt_deg"][-1] - signals["dt_deg"][0] == pytest.approx(step["tab_deg"], abs=1e-3)
    names = {g["name"] for g in design["controllers"][-1]["gains"]}
    assert {"K_T_t_int_t", "N_T_a_r_t"} <= names


def test_weighed_power_is_less(client: TestClient) -> None:
    design = designed(client, "lqr_power")
    peak = {}
    for name in ("before", "after"):
        demand = answered(client, design, name, "actuator-requirements")["actuators"]
        peak[name] = sum(np.array(demand[a]["peak_power_w"]) for a in ("tab", "aileron"))
    assert np.all(peak["after"] < peak["before"])


@pytest.mark.parametrize(
    ("field", "value"), [("sample_time_s", 0.001), ("measurement", {"kind": "rate_filters", "cutoff_hz": 500.0})]
)
def test_what_is_not_judged_over_a_grid_yet_is_refused(
    client: TestClient, quick: dict[str, Any], refused: Any, field: str, value: Any
) -> None:
    quick["controllers"][0][field] = value
    problem = refused(client.post("/v1/designs", json=quick), 422)
    assert problem["errors"][0]["pointer"] == f"/controllers/0/{field}"
