"""Two designs side by side over HTTP."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.documentation.design_examples import design_requests
from service.examples import example
from service.settings import Settings
from service.wire.request_differences import MOST_LISTED, differences
from tests.service.flown_answers import posted
from tests.service.lqr_by_hand import by_hand


@pytest.fixture(scope="module")
def heavier(client: TestClient) -> dict[str, Any]:
    """The example with three times the inertia of the aileron, on a grid that shares one altitude and two pressures."""
    body = copy.deepcopy(example("wind_tunnel"))
    body["inertia"]["aileron"]["inertia_kg_m2"] *= 3.0
    body["grid"] = {"altitude_m": [1500.0, 3000.0], "dynamic_pressure_pa": [551.25, 700.0, 1531.25]}
    return posted(client, body)


def compared(client: TestClient, design: dict[str, Any], other: dict[str, Any] | None, **query: str) -> dict[str, Any]:
    if other is not None:
        query["with"] = other["id"]
    response = client.get(f"/v1/designs/{design['id']}/compare", params=query)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def test_what_differs_in_the_request(client: TestClient, design: dict[str, Any], heavier: dict[str, Any]) -> None:
    found = compared(client, design, heavier)
    assert (found["this"]["id"], found["other"]["id"]) == (design["id"], heavier["id"])
    assert (found["this"]["points"], found["other"]["points"]) == (8, 6)
    listed = {d["pointer"]: (d["value"], d["other"], d["only_in"]) for d in found["request_differences"]}
    assert listed["/inertia/aileron/inertia_kg_m2"] == (4.2e-3, 4.2e-3 * 3.0, None)
    assert listed["/grid/altitude_m/0"] == (0.0, 1500.0, None)
    assert listed["/grid/dynamic_pressure_pa/3"] == (1531.25, None, "this")
    assert set(listed) == {
        "/inertia/aileron/inertia_kg_m2",
        "/grid/altitude_m/0",
        *(f"/grid/dynamic_pressure_pa/{i}" for i in range(4)),
    }
    assert found["request_differences_in_all"] == len(listed)


@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_gains_and_figures_at_the_common_points(
    client: TestClient, design: dict[str, Any], heavier: dict[str, Any], name: str
) -> None:
    """Each number is the one that the point of its own design has."""
    found = compared(client, design, heavier, controller=name)
    assert found["other"]["controller"] == name
    assert [(p["point"], p["other_point"]) for p in found["points"]] == [(5, 3), (7, 5)]
    for each in found["points"]:
        ours, theirs = (
            client.get(f"/v1/designs/{d['id']}/points/{each[key]}").json()
            for d, key in ((design, "point"), (heavier, "other_point"))
        )
        assert each["coordinates"] == ours["coordinates"] == theirs["coordinates"]
        one, other = (next(c for c in point["controllers"] if c["name"] == name) for point in (ours, theirs))
        assert [(g["name"], g["value"], g["other"]) for g in each["gains"]] == [
            (a["name"], a["value"], b["value"]) for a, b in zip(one["gains"], other["gains"], strict=True)
        ]
        figures = {figure["name"]: figure for figure in each["figures"]}
        for key, controller in (("value", one), ("other", other)):
            assert figures["settling_time_s"][key] == controller["step"]["settling_time_s"]
            assert figures["overshoot_percent"][key] == pytest.approx(controller["step"]["overshoot_percent"])
            smallest = min(m["phase_margin_deg"] for m in controller["margins"].values())
            assert figures["phase_margin_deg"][key] == pytest.approx(smallest)
        for figure in [*each["gains"], *each["figures"]]:
            if figure["value"] is not None and figure["other"] is not None:
                assert figure["difference"] == figure["other"] - figure["value"]
        assert "tab_torque_n_m" in figures


def sensitivities(omega: Any, A: Any, B: Any, K: Any) -> tuple[Any, Any]:
    T = K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(len(A)) - (A - B @ K), B + 0j)
    return np.eye(2) - T, T


def margin_in(unit: float, S: Any, T: Any) -> float:
    D = np.diag([unit, 1.0])
    scaled = np.concatenate([np.linalg.inv(D) @ M @ D for M in (S, T)], axis=-1)
    return float(1.0 / (np.sqrt(2.0) * np.linalg.norm(scaled, 2, axis=(-2, -1)).max()))


def test_the_gap_and_the_margin_by_hand(client: TestClient, design: dict[str, Any], heavier: dict[str, Any]) -> None:
    """From what the wire says of both points alone: chordal distances on a dense grid, in units that are searched."""
    found = compared(client, design, heavier, controller="lqr")
    omega = np.concatenate([[0.0], np.geomspace(1e-1, 1e5, 1500)])
    for each in found["points"]:
        ours, theirs = (
            client.get(f"/v1/designs/{d['id']}/points/{each[key]}").json()
            for d, key in ((design, "point"), (heavier, "other_point"))
        )
        hand, there = by_hand(ours, "lqr"), by_hand(theirs, "lqr")

        S, T = sensitivities(omega, hand.A, hand.B, hand.K)
        S2, T2 = sensitivities(omega, there.A, there.B, hand.K)

        units = np.geomspace(3e-2, 3.0, 101)
        margins = [margin_in(unit, S, T) for unit in units]
        said = each["on_other_plant"]
        assert said["stability_margin"] == pytest.approx(max(margins), rel=1e-3)
        assert said["stable"] is bool(np.linalg.eigvals(there.A - there.B @ hand.K).real.max() < 0.0)
        unit = units[int(np.argmax(margins))]
        D = np.diag([unit, 1.0])
        S, T, S2, T2 = (np.linalg.inv(D) @ M @ D for M in (S, T, S2, T2))
        graph = np.linalg.qr(np.concatenate([S, T], axis=-2))[0]
        other = np.linalg.qr(np.concatenate([S2, T2], axis=-2))[0]
        cosine = np.linalg.svd(other.conj().mT @ graph, compute_uv=False)[:, -1]
        assert said["nu_gap"] == pytest.approx(np.sqrt(1.0 - cosine.min() ** 2), rel=2e-2)
        assert said["held_by_margin"] is (said["nu_gap"] < said["stability_margin"])


def test_the_summary_counts(client: TestClient, design: dict[str, Any], heavier: dict[str, Any]) -> None:
    found = compared(client, design, heavier, controller="pf", other_controller="nf")
    assert (found["this"]["kind"], found["other"]["kind"]) == ("positive_feedback", "negative_feedback")
    for key in ("on_other_plant", "other_on_this_plant"):
        said, rows = found[key], [p[key] for p in found["points"]]
        assert said["points_flown"] == len(rows) == 2
        assert said["points_stable"] == sum(row["stable"] for row in rows)
        assert said["points_held_by_margin"] == sum(row["held_by_margin"] for row in rows)
        gaps = [row["nu_gap"] for row in rows]
        assert said["largest_nu_gap"] == max(gaps)
        assert said["largest_nu_gap_point"] == found["points"][int(np.argmax(gaps))]["point"]
    gains = {g["name"]: (g["value"] is None, g["other"] is None) for g in found["points"][0]["gains"]}
    assert gains == {"K_f": (False, True), "K_i": (False, False), "K_d": (True, False), "K_p": (True, False)}


def test_both_ways_round_it_is_the_same(client: TestClient, design: dict[str, Any], heavier: dict[str, Any]) -> None:
    one, other = compared(client, design, heavier), compared(client, heavier, design)
    assert one["on_other_plant"]["largest_nu_gap"] == other["other_on_this_plant"]["largest_nu_gap"]
    for a, b in zip(one["points"], other["points"], strict=True):
        assert a["on_other_plant"] == b["other_on_this_plant"]
        assert [g["difference"] for g in a["gains"]] == [-g["difference"] for g in b["gains"]]


def test_one_design_with_itself(client: TestClient, design: dict[str, Any]) -> None:
    """Without another design it is its own controllers that are compared: the plants are the same."""
    found = compared(client, design, None, controller="nf", other_controller="lqr")
    assert found["request_differences"] == []
    assert len(found["points"]) == 8
    assert found["on_other_plant"]["largest_nu_gap"] < 1e-6
    assert found["on_other_plant"]["points_held_by_margin"] == 8
    same = compared(client, design, design)
    assert (same["this"]["controller"], same["other"]["controller"]) == ("nf", "nf")
    assert all(g["difference"] == 0.0 for point in same["points"] for g in point["gains"])


def test_grids_that_do_not_meet(client: TestClient, design: dict[str, Any], quick: dict[str, Any]) -> None:
    quick["grid"] = {"altitude_m": [0.0], "airspeed_m_s": [30.0]}
    found = compared(client, design, posted(client, quick))
    assert "axes differ" in found["reason"]
    assert found["points"] == []
    assert found["on_other_plant"] == {
        "reason": "the grids have no point in common", "points_flown": 0, "points_stable": 0,
        "points_held_by_margin": 0, "largest_nu_gap": None, "largest_nu_gap_point": None,
    }  # fmt: skip
    quick["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [245.001]}
    assert "no point" in compared(client, design, posted(client, quick))["reason"]


@pytest.mark.parametrize(
    ("name", "controller", "said"),
    [
        ("lqr_sampled", "at_500_hz", "runs as code"),
        ("lqr_measured", "estimated", "model of its own point"),
        ("lqr_measured", "filtered", None),
        ("lqr_structures", "both", None),
        ("lqr_structures", "regulator", None),
        ("given_gains", "digital", None),
    ],
)
def test_every_kind_of_controller(
    client: TestClient, design: dict[str, Any], name: str, controller: str, said: str | None
) -> None:
    """What is not flown on another plant says why, and is compared all the same."""
    other = posted(client, design_requests()[name][1])
    found = compared(client, other, design, controller=controller, other_controller="lqr")
    assert len(found["points"]) == 8
    if said is None:
        assert found["on_other_plant"]["points_stable"] == found["on_other_plant"]["points_flown"] > 0
    else:
        assert said in found["on_other_plant"]["reason"]
        assert found["points"][0]["on_other_plant"]["stable"] is None
    assert found["other_on_this_plant"]["points_flown"] > 0


def test_without_gains_nothing_is_flown(client: TestClient, design: dict[str, Any], wanted: dict[str, Any]) -> None:
    wanted["controllers"] = wanted["controllers"][:1]
    wanted["controllers"][0]["specs"]["settling_time_s_max"] = 1e-3
    found = compared(client, design, posted(client, wanted))
    assert {point["other_outcome"] for point in found["points"]} == {"infeasible"}
    assert "gains" in found["other_on_this_plant"]["reason"]
    assert found["on_other_plant"]["points_flown"] == 8
    assert found["points"][0]["figures"][0]["other"] is None


def test_plants_of_different_states(client: TestClient, design: dict[str, Any], wanted: dict[str, Any]) -> None:
    wanted["aerodynamics"]["damping"] = "unsteady"
    wanted["controllers"] = wanted["controllers"][2:]
    found = compared(client, design, posted(client, wanted), controller="lqr")
    assert "lag states" in found["on_other_plant"]["reason"]
    assert "lag states" in found["other_on_this_plant"]["reason"]


@pytest.mark.parametrize(
    ("query", "status"),
    [
        ({"with": "0" * 32}, 404),
        ({"with": ""}, 404),
        ({"with": "\udc80".encode("utf-8", "replace").decode()}, 404),
        ({"controller": "nobody"}, 404),
        ({"other_controller": "nobody"}, 404),
        ({"other": "x"}, 422),
    ],
)
def test_what_cannot_be_asked(
    client: TestClient, design: dict[str, Any], refused: Any, query: dict[str, str], status: int
) -> None:
    refused(client.get(f"/v1/designs/{design['id']}/compare", params=query), status)


def test_the_limit_names_its_setting(tmp_path: Path, quick: dict[str, Any], refused: Any) -> None:
    quick["grid"]["dynamic_pressure_pa"] = [500.0, 980.0]
    with TestClient(create_app(Settings(data_dir=tmp_path, max_compared_points=1))) as client:
        problem = refused(client.get(f"/v1/designs/{posted(client, quick)['id']}/compare"), 422)
    assert problem["code"] == "limit_exceeded"
    assert "GAINFIELD_MAX_COMPARED_POINTS" in problem["detail"]


def test_differences_of_documents() -> None:
    def of(one: Any, other: Any) -> list[tuple[str, Any, Any, str | None]]:
        return [(d.pointer, d.value, d.other, d.only_in) for d in differences(one, other)]

    assert of({"a": 1, "b": [1, {"c": 2}]}, {"b": [1, {"c": 2}], "a": 1}) == []
    assert of(1, 1.0) == []
    assert of(True, 1) == [("", True, 1, None)]
    assert of({"a/b": {"~": 1}}, {"a/b": {"~": 2}}) == [("/a~1b/~0", 1, 2, None)]
    assert of({"a": None}, {}) == [("/a", None, None, "this")]
    assert of({"a": 1.0}, {"a": {"axis": "x"}}) == [("/a", 1.0, {"axis": "x"}, None)]
    assert of([1], [1, 2]) == [("/1", None, 2, "other")]
    ((_, shown, _, _),) = of("x" * 10_000, "y")
    assert len(shown) < 300
    assert MOST_LISTED >= 100
