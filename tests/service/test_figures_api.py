"""Figures over the grid are those of each point's own document."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
from fastapi.testclient import TestClient


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_each_point_says_the_same(client: TestClient, design: dict[str, Any], name: str) -> None:
    found = client.get(f"/v1/designs/{design['id']}/controllers/{name}/figures").json()
    rows, columns = found["grid"]["shape"]
    for point, (i, j) in enumerate(itertools.product(range(rows), range(columns))):
        document = client.get(f"/v1/designs/{design['id']}/points/{point}").json()
        (there,) = [one for one in document["controllers"] if one["name"] == name]
        assert found["poles"][i][j] == there["poles"]
        rightmost = max(pole["re"] for pole in there["poles"])
        assert found["decay_rate_1_s"][i][j] == pytest.approx(-rightmost)
        for loop, margins in there["margins"].items():
            for figure, values in found["margins"][loop].items():
                assert values[i][j] == margins[figure], (loop, figure)
                assert (values[i][j] is None) == (figure in margins["reasons"])
        for figure, values in found["step"].items():
            assert values[i][j] == there["step"][figure], figure


def test_points_without_gains(client: TestClient, wanted: dict[str, Any]) -> None:
    """At a point above Mach 1 there is nothing, and a reason; a controller without any gains has no figures at all."""
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0, 9e4]}
    wanted["controllers"] = [
        wanted["controllers"][2],
        wanted["controllers"][0] | {"specs": {"damping_ratio_min": 0.95, "phase_margin_deg_min": 85.0}},
    ]
    answered = client.post("/v1/designs", json=wanted)
    assert answered.status_code == 201, answered.text
    made = answered.json()
    lqr, nf = (client.get(made["links"]["figures"][name]).json() for name in ("lqr", "nf"))
    assert [one is None for one in lqr["poles"][0]] == [False, True]
    assert [one is None for one in lqr["decay_rate_1_s"][0]] == [False, True]
    assert lqr["outcomes"][0][1] == "outside_model"
    assert (nf["step"], nf["margins"], nf["poles"]) == (None, {}, [[None, None]])
    assert nf["damping_ratio"] == [[None, None]]
    assert all(nf["reasons"][0])
