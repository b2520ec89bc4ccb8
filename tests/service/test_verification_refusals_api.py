"""What requests for a proof are refused for, by field, and that no table is a fault of the server."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from schedules.rules import INTEGRATOR_PLACEMENTS, INTERPOLATIONS
from service.app import create_app
from service.documentation.body_examples import BODIES
from service.examples import example
from service.settings import Settings
from tests.service.flown_answers import posted

VERIFY = "/v1/schedules/verify"
Refused = Callable[[Any, int], dict[str, Any]]


@pytest.fixture
def body() -> dict[str, Any]:
    """The uploaded table of the documentation that holds, free to be changed."""
    return copy.deepcopy(BODIES[VERIFY]()["proved"]["value"])


def uploaded(client: TestClient, request: dict[str, Any]) -> dict[str, Any]:
    response = client.post(VERIFY, json=request)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def at(pointer: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """A change of the body: the value put there."""

    def change(document: Any) -> None:
        *parents, last = pointer.split("/")[1:]
        for part in parents:
            document = document[int(part) if part.isdigit() else part]
        document[int(last) if last.isdigit() else last] = value

    return change


def first_gains(count: int) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        document["schedule"]["gains"] = document["schedule"]["gains"][:count]

    return change


BAD: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (first_gains(2), "/schedule/gains"),
    (first_gains(0), "/schedule/gains"),
    (at("/schedule/gains/1/name", "K_q"), "/schedule/gains/1/name"),
    (at("/schedule/gains/1/name", "K_d"), "/schedule/gains/1/name"),
    (at("/schedule/gains/1/name", "N_T_t_r_a"), "/schedule/gains/1/name"),
    (at("/schedule/gains/0/unit", "deg"), "/schedule/gains/0/unit"),
    (at("/schedule/gains/2/values", [[1.0, 2.0, 3.0]]), "/schedule/gains/2/values"),
    (at("/schedule/gains/2/values/1", [1.0, 2.0]), "/schedule/gains/2/values/1"),
    (at("/schedule/gains/2/values/1/2", None), "/schedule/gains/2/values/1/2"),
    (at("/schedule/gains/2/values/1/2", "1"), "/schedule/gains/2/values/1/2"),
    (at("/schedule/gains/2/values/1/2", 1e300), "/schedule/gains/2/values/1/2"),
    (at("/schedule/gains/2/values/1/2", -1.0), "/schedule/gains/2/values/1/2"),
    (at("/schedule/axes/0/name", "height_m"), "/schedule/axes/0/name"),
    (at("/schedule/axes/0", {"name": "mach", "values": [0.1, 0.2]}), "/schedule/axes/0/name"),
    (at("/schedule/axes/1", {"name": "altitude_m", "values": [0.0, 1.0, 2.0]}), "/schedule/axes/1/name"),
    (at("/schedule/axes/1/unit", "kPa"), "/schedule/axes/1/unit"),
    (at("/schedule/axes/1/values/1", 200.0), "/schedule/axes/1/values/1"),
    (at("/schedule/axes/0/values/1", 1e9), "/schedule/axes/0/values/1"),
    (at("/schedule/axes", []), "/schedule/axes"),
    (at("/schedule/outcomes", [["ok"] * 3]), "/schedule/outcomes"),
    (at("/schedule/outcomes", [["ok"] * 3, ["ok", "infeasible", "ok"]]), "/schedule/outcomes/1/1"),
    (at("/schedule/outcomes", [["ok"] * 3, ["ok", "fine", "ok"]]), "/schedule/outcomes/1/1"),
    (at("/schedule/interpolation", "cubic"), "/schedule/interpolation"),
    (at("/schedule/out_of_range", "extrapolated"), "/schedule/out_of_range"),
    (at("/schedule/interpolation", INTERPOLATIONS["monotone_cubic"]), "/schedule/interpolation"),
    (at("/schedule/integrator_placement", INTEGRATOR_PLACEMENTS["after_gain"]), "/schedule/integrator_placement"),
    (at("/schedule/sign_convention", "trailing edge down"), "/schedule/sign_convention"),
    (at("/schedule/schema_version", 3), "/schedule/schema_version"),
    (at("/schedule/format", "other"), "/schedule/format"),
    (at("/schedule/kind", "lqr"), "/schedule/kind"),
    (at("/schedule/extra", 1), "/schedule/extra"),
    (at("/controller", "nf"), "/controller"),
    (at("/controller", 3), "/controller"),
    (at("/controller/kind", "pid"), "/controller/kind"),
    (at("/controller/reference", "none"), "/controller/reference"),
    (at("/controller/specs", {}), "/controller/specs"),
    (at("/controller/sample_time_s", 1e-4), "/controller/computational_delay_s"),
    (at("/controller", {"kind": "lqr", "rate_filter_hz": 10.0}), "/controller/rate_filter_hz"),
    (at("/controller", {"kind": "lqr", "sample_time_s": 0.01}), "/controller/sample_time_s"),
    (at("/controller", {"kind": "lqr", "measurement": {"kind": "kalman"}}), "/controller/measurement/kind"),
    (at("/controller", {"kind": "lqr"}), "/schedule/gains/0/name"),
    (at("/design", None), "/design"),
    (at("/design_id", "abc"), "/design"),
    (at("/design/geometry/chord_m", 0.0), "/design/geometry/chord_m"),
    (at("/design/grid", {}), "/design/grid"),
    (at("/design/aerodynamics", {"source": "table", "rows": [[0, 0, 0, 0, 0]] * 3}), "/design/aerodynamics/rows"),
    (at("/proof/fraction", 1.0), "/proof/fraction"),
    (at("/proof/decay_rate_1_s", -1.0), "/proof/decay_rate_1_s"),
    (at("/proof/pieces", 0), "/proof/pieces"),
    (at("/proof", {"hinge_moment_percent": 1.0, "inertia_percent": 1.0, "mass_percent": 1.0, "together": True}),
     "/proof/together"),
    (at("/certificate", "yes"), "/certificate"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "pointer"), BAD)
def test_what_is_refused_names_the_field(
    client: TestClient, body: dict[str, Any], refused: Refused, change: Callable[[dict[str, Any]], None], pointer: str
) -> None:
    if pointer == "/controller/computational_delay_s":
        body["controller"]["computational_delay_s"] = 0.5
    change(body)
    problem = refused(client.post(VERIFY, json=body), 422)
    assert problem["errors"][0]["pointer"] == pointer, problem
    assert problem["errors"][0]["allowed"]


def test_outside_the_model(client: TestClient, body: dict[str, Any], refused: Refused) -> None:
    speeds = body["schedule"]["axes"][1]["values"]
    speeds[2] = 9e4
    found = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert [cell["status"] for cell in found] == ["proved", "undecided"]
    assert "outside_model" in found[1]["reason"]
    speeds[:] = [8e4, 9e4, 9.5e4]
    problem = refused(client.post(VERIFY, json=body), 422)
    assert problem["errors"][0]["pointer"] == "/schedule/axes"
    assert "Mach" in problem["detail"]


def test_things_that_are_not_there(
    client: TestClient, design: dict[str, Any], body: dict[str, Any], refused: Refused
) -> None:
    link = design["links"]["verification"]
    refused(client.get(f"{link}?controller=none"), 404)
    refused(client.get("/v1/designs/0/verification"), 404)
    refused(client.get(design["links"]["certificate"]["nf"].replace("/nf/", "/none/")), 404)
    for query in ("fraction=1", "pieces=0", "controller=1x", "margins=perhaps", "decay=1", "together=2",
                  "hinge_moment_percent=100", "tab_mass_percent=nan"):  # fmt: skip
        problem = refused(client.get(f"{link}?{query}"), 422)
        assert problem["errors"][0]["pointer"].startswith(f"/{query.partition('=')[0]}")
    refused(client.get(f"{design['links']['certificate']['nf']}?margins=true"), 422)
    del body["design"]
    refused(client.post(VERIFY, json=body | {"design_id": "0"}), 404)
    refused(client.post(VERIFY, json=body | {"design_id": design["id"], "controller": "none"}), 404)


def test_controllers_that_no_table_flies(
    client: TestClient, wanted: dict[str, Any], body: dict[str, Any], refused: Refused
) -> None:
    wanted["controllers"] = [wanted["controllers"][2] | {"sample_time_s": 0.005}]
    document = posted(client, wanted | {"name": "digital"})
    del body["design"]
    problem = refused(client.post(VERIFY, json=body | {"design_id": document["id"], "controller": "lqr"}), 409)
    assert problem["code"] == "study_not_possible"


def test_limits_name_their_setting(tmp_path: Path, body: dict[str, Any], refused: Refused) -> None:
    few = Settings(data_dir=tmp_path, max_proof_pieces=144, max_grid_points=8, max_delayed_loops=5)
    with TestClient(create_app(few), raise_server_exceptions=False) as client:
        document = posted(client, example("wind_tunnel"))
        link = document["links"]["verification"]
        assert client.get(link).status_code == 200  # 3 controllers, 3 cells, 16 pieces
        for query, size in (("pieces=17", 153), ("hinge_moment_percent=1", 1152), ("margins=true", 378),
                            ("rates=true", 1494), ("hinge_moment_percent=1&together=true", 2304)):  # fmt: skip
            problem = refused(client.get(f"{link}?{query}"), 422)
            assert problem["code"] == "limit_exceeded"
            assert "GAINFIELD_MAX_PROOF_PIECES" in problem["detail"]
            (error,) = problem["errors"]
            assert (error["pointer"], error["allowed"]) == ("/pieces", "<= 144")
            assert problem["detail"].startswith(f"{size} ")
        problem = refused(client.get(f"{document['links']['certificate']['nf']}?pieces=49"), 422)
        assert problem["detail"].startswith("147 ")
        problem = refused(client.post(VERIFY, json=body | {"proof": {"pieces": 73}}), 422)
        assert problem["errors"][0]["pointer"] == "/proof/pieces"
        body["design"]["actuators"]["tab"]["delay_s"] = 0.01
        problem = refused(client.post(VERIFY, json=body), 422)
        assert "GAINFIELD_MAX_DELAYED_LOOPS" in problem["detail"]
        body["schedule"]["axes"][0]["values"] = [0.0, 1.0, 2.0]
        for gain in body["schedule"]["gains"]:
            gain["values"] = [[1.0] * 3] * 3
        assert "GAINFIELD_MAX_GRID_POINTS" in refused(client.post(VERIFY, json=body), 422)["detail"]


WILD = st.one_of(
    st.none(), st.floats(allow_nan=False, allow_infinity=False), st.sampled_from([0.0, -0.0, 5e-324, 1e6, 1e12, -1.0])
)
TAME = st.one_of(st.floats(0.0, 1e6), st.floats(0.0, 10.0), st.sampled_from([0.0, 5e-324, 1e-300, 1e6]))


@given(
    values=st.one_of(
        *(st.lists(st.lists(g, min_size=3, max_size=3), min_size=6, max_size=6) for g in (TAME, TAME, WILD))
    ),
    holes=st.lists(st.tuples(st.integers(0, 1), st.integers(0, 2)), max_size=3),
    altitude=st.tuples(st.floats(-1000.0, 32000.0), st.floats(1e-9, 20000.0)),
    speed=st.tuples(st.floats(0.1, 2e4), st.floats(1e-9, 2e4), st.one_of(st.floats(1e-9, 2e4), st.just(1e5))),
    delay=st.sampled_from([0.0, 0.0, 1e-12, 1e-3, 1.0]),
    servo=st.sampled_from([40.0, 1e-3, 1e4, None]),
    law=st.sampled_from(["measured", "filtered", "sampled", "rate"]),
    damping=st.sampled_from(["thesis", "quasi_steady", "unsteady"]),
)
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
def test_no_table_is_a_fault_of_the_server(
    client: TestClient, values: Any, holes: Any, altitude: Any, speed: Any, delay: float, servo: float | None, law: str,
    damping: str,
) -> None:  # fmt: skip
    body = copy.deepcopy(BODIES[VERIFY]()["proved"]["value"])
    for axis, steps in zip(body["schedule"]["axes"], (altitude, speed), strict=True):
        axis["values"] = np.cumsum(steps).tolist()
    for k, gain in enumerate(body["schedule"]["gains"]):
        gain["values"] = values[2 * k : 2 * k + 2]
        for i, j in holes:
            gain["values"][i][j] = None
    tab = body["design"]["actuators"]["tab"]
    tab |= {"delay_s": delay, "servo_bandwidth_hz": servo, "servo_damping_ratio": None if servo is None else 0.7}
    body["design"]["aerodynamics"]["damping"] = damping
    if law == "measured":
        body["controller"]["rate_filter_hz"] = None
    if law == "sampled":
        body["controller"] |= {"sample_time_s": 1e-3}
    if law == "rate":
        body["controller"] |= {"tab_command": "rate"}
        body["schedule"]["gains"].append(body["schedule"]["gains"][0] | {"name": "K_theta", "unit": "1/s"})
    body["proof"] = {"decay_rate_1_s": 0.0, "pieces": 2}
    response = client.post(VERIFY, json=body)
    assert response.status_code in (200, 422), response.text
