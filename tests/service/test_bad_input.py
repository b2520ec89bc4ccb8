"""Whatever a client sends, the answer is a problem document that names field, unit and allowed range; never a 500."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest
from fastapi.testclient import TestClient

JSON = {"Content-Type": "application/json"}


def at(document: Any, pointer: str, value: Any) -> Any:
    """The document with a value put at a pointer."""
    changed = copy.deepcopy(document)
    *parents, last = pointer.split("/")[1:]
    place = changed
    for part in parents:
        place = place[int(part) if isinstance(place, list) else part]
    place[int(last) if isinstance(place, list) else last] = value
    return changed


def raw(document: Any, pointer: str, text: str) -> bytes:
    """The document as JSON with this text, which Python's encoder would not write, at a pointer."""
    return json.dumps(at(document, pointer, "<here>")).replace('"<here>"', text).encode()


# pointer changed, value put there, pointer named, unit named, allowed named
FIELDS = [
    ("/geometry/chord_m", -1, "/geometry/chord_m", "m", ">= 0.001 and <= 100"),
    ("/geometry/chord_m", 0, "/geometry/chord_m", "m", ">= 0.001 and <= 100"),
    ("/geometry/chord_m", "0.6", "/geometry/chord_m", "m", ">= 0.001 and <= 100"),
    ("/geometry/chord_m", True, "/geometry/chord_m", "m", ">= 0.001 and <= 100"),
    ("/geometry/chord_m", None, "/geometry/chord_m", "m", ">= 0.001 and <= 100"),
    ("/geometry/chord_m", 10**400, "/geometry/chord_m", "m", ">= 0.001 and <= 100"),
    ("/geometry/colour", "red", "/geometry/colour", None, "fields aileron_hinge, tab_hinge, chord_m, span_m"),
    ("/geometry/a~b~1c", 1, "/geometry/a~0b~01c", None, "fields aileron_hinge, tab_hinge, chord_m, span_m"),
    ("/geometry/tab_hinge", 0.72, "/geometry/tab_hinge", "1", "> 0.72 and < 1"),
    ("/geometry/tab_hinge", 0.5, "/geometry/tab_hinge", "1", "> 0.72 and < 1"),
    ("/geometry/tab_hinge", 1.0, "/geometry/tab_hinge", "1", "> 0 and < 1"),
    ("/inertia/tab/mass_kg", 0, "/inertia/tab/mass_kg", "kg", ">= 1e-06 and <= 100000"),
    ("/inertia/aileron/mass_kg", -0.5, "/inertia/aileron/mass_kg", "kg", ">= 1e-06 and <= 100000"),
    ("/inertia/tab/inertia_kg_m2", 0, "/inertia/tab/inertia_kg_m2", "kg m^2", ">= 1e-10 and <= 1e+06"),
    ("/inertia/tab", 3, "/inertia/tab", None, "an object with the fields mass_kg, cg_offset_m, inertia_kg_m2"),
    ("/aerodynamics/source", "panel", "/aerodynamics/source", None, "one of derivatives, table, thin_aerofoil"),
    ("/aerodynamics/damping", "none", "/aerodynamics/damping", None, "one of thesis, quasi_steady, unsteady"),
    ("/aerodynamics/virtual_inertia", 1, "/aerodynamics/virtual_inertia", None, "true or false"),
    ("/atmosphere/temperature_offset_k", 300, "/atmosphere/temperature_offset_k", "K", ">= -100 and <= 100"),
    ("/trim/alpha_deg", 91, "/trim/alpha_deg", "deg", ">= -30 and <= 30"),
    ("/trim/tab_deg", 91, "/trim/tab_deg", "deg", ">= -60 and <= 60"),
    (
        "/trim/tab_deg",
        "floating",
        "/trim/tab_deg",
        "deg",
        "one of zero_aileron_torque, zero_tab_torque, least_torque",
    ),
    (
        "/trim/tab_deg",
        [],
        "/trim/tab_deg",
        "deg",
        ">= -60 and <= 60; or one of zero_aileron_torque, zero_tab_torque, least_torque; or an object with the fields "
        "surface, torque_n_m",
    ),
    ("/trim/tab_deg", {"surface": "tab"}, "/trim/tab_deg/torque_n_m", "N m", ">= -1e+09 and <= 1e+09"),
    ("/trim/aileron_deg", "zero_tab_torque", "/trim/aileron_deg", "deg", "only zero_aileron_torque"),
    ("/trim/tab_limit_deg", 0, "/trim/tab_limit_deg", "deg", "> 0 and <= 90, or null"),
    ("/grid/altitude_m", [], "/grid/altitude_m", "m", "a list, at least 1 items, at most 10000 items"),
    ("/grid/altitude_m", 0, "/grid/altitude_m", "m", None),
    ("/grid/altitude_m", [0, 40000], "/grid/altitude_m/1", "m", ">= -2000 and <= 32000"),
    ("/grid/altitude_m", [3000, 0], "/grid/altitude_m/1", "m", "> 3000"),
    ("/grid/altitude_m", [0, 3000, 3000], "/grid/altitude_m/2", "m", "> 3000"),
    ("/grid/dynamic_pressure_pa", [], "/grid/dynamic_pressure_pa", "Pa", None),
    ("/grid/dynamic_pressure_pa", [245, 200], "/grid/dynamic_pressure_pa/1", "Pa", "> 245"),
    ("/grid/dynamic_pressure_pa", [-1], "/grid/dynamic_pressure_pa/0", "Pa", ">= 0.1 and <= 1e+06"),
    ("/grid/dynamic_pressure_pa", {"from": 9, "to": 5, "count": 3}, "/grid/dynamic_pressure_pa/to", "Pa", "> 9"),
    (
        "/grid/altitude_m",
        {"from": 0, "to": 5, "count": 3, "spacing": "log"},
        "/grid/altitude_m/from",
        "m",
        "> 0",
    ),
    (
        "/grid/altitude_m",
        {"from": 0, "to": 5, "count": 1},
        "/grid/altitude_m/count",
        None,
        "an integer >= 2 and <= 10000",
    ),
    ("/grid/mach", [0.5], "/grid", None, "one of dynamic_pressure_pa, airspeed_m_s, mach"),
    ("/grid", {"altitude_m": [0], "mach": [0.5, 1.0]}, "/grid/mach/1", "1", ">= 0.001 and < 1"),
    ("/grid", {"altitude_m": [0], "airspeed_m_s": [400]}, "/grid", "1", "Mach < 1 at one point at least"),
    (
        "/actuators/tab/servo_bandwidth_hz",
        None,
        "/actuators/tab/servo_damping_ratio",
        "1",
        "null, or servo_bandwidth_hz beside it",
    ),
    (
        "/actuators/tab",
        {},
        "/actuators/tab/servo_bandwidth_hz",
        "Hz",
        "a number; or null where all gains are given and, for negative_feedback, a rate_filter_hz",
    ),
    *(
        (f"/actuators/{surface}/{field}", value, f"/actuators/{surface}/{field}", unit, allowed)
        for surface in ("tab", "aileron")
        for field, value, unit, allowed in (
            ("torque_loop_bandwidth_hz", 0, "Hz", ">= 0.001 and <= 10000, or null"),
            ("torque_loop_bandwidth_hz", 1.1e4, "Hz", ">= 0.001 and <= 10000, or null"),
            ("delay_s", -1e-9, "s", ">= 0 and <= 1"),
            ("delay_s", None, "s", ">= 0 and <= 1"),
        )
    ),
    ("/actuators/tab/delay_s", 1.5, "/actuators/tab/delay_s", "s", ">= 0 and <= 1"),
    (
        "/actuators/tab/limits/rate_deg_s",
        0,
        "/actuators/tab/limits/rate_deg_s",
        "deg/s",
        "> 0 and <= 1e+06, or null",
    ),
    ("/reference/kind", "ramp", "/reference/kind", None, "only step"),
    ("/reference/aileron_deg", 0, "/reference/aileron_deg", "deg", ">= -60 and <= 60, not 0"),
    (
        "/reference/tab_deg",
        1,
        "/reference/tab_deg",
        "deg",
        "0 unless a controller has the reference aileron_and_tab",
    ),
    ("/reference/tab_deg", 61, "/reference/tab_deg", "deg", ">= -60 and <= 60"),
    ("/reference/rate_limit_deg_s", 0, "/reference/rate_limit_deg_s", "deg/s", ">= 0.001 and <= 1e+06, or null"),
    ("/reference/duration_s", 0, "/reference/duration_s", "s", ">= 0.001 and <= 1000"),
    ("/controllers", [], "/controllers", None, "a list, at least 1 items"),
    (
        "/controllers/0/kind",
        "pid",
        "/controllers/0/kind",
        None,
        "one of lqr, negative_feedback, positive_feedback",
    ),
    ("/controllers/0/tab_command", "torque", "/controllers/0/tab_command", None, "one of deflection, rate"),
    ("/controllers/0/name", "1x", "/controllers/0/name", None, "text, matching ^[A-Za-z][A-Za-z0-9_-]{0,62}$"),
    ("/controllers/0/name", "n\n", "/controllers/0/name", None, "text, matching ^[A-Za-z][A-Za-z0-9_-]{0,62}$"),
    ("/controllers/1/name", "nf", "/controllers/1/name", None, "a new name"),
    (
        "/controllers/0/specs/damping_ratio_min",
        2,
        "/controllers/0/specs/damping_ratio_min",
        "1",
        ">= 0 and <= 1",
    ),
    (
        "/controllers/0/specs/phase_margin_deg_min",
        -3,
        "/controllers/0/specs/phase_margin_deg_min",
        "deg",
        ">= 0 and <= 90",
    ),
    ("/controllers/2/reference", "tab", "/controllers/2/reference", None, "one of none, aileron, aileron_and_tab"),
    (
        "/controllers/2/weights/rule",
        "lqg",
        "/controllers/2/weights/rule",
        None,
        "one of bryson, explicit, output, power",
    ),
    (
        "/controllers/2/weights/aileron_integral_deg_s",
        0,
        "/controllers/2/weights/aileron_integral_deg_s",
        "deg s",
        ">= 1e-06 and <= 1e+06, or null",
    ),
    ("/spec_pack", "mil", "/spec_pack", None, "one of default, limit_speed"),
    (
        "/spec_pack",
        3,
        "/spec_pack",
        None,
        "one of default, limit_speed; or an object with the fields name, specs",
    ),
    ("/spec_pack", {"name": "x"}, "/spec_pack/specs", None, None),
    (
        "/spec_pack",
        {"name": "default", "specs": {}},
        "/spec_pack/name",
        None,
        "text other than default, limit_speed",
    ),
    (
        "/spec_pack",
        {"name": "x", "specs": {"tab_power_w_max": 0.0}},
        "/spec_pack/specs/tab_power_w_max",
        "W",
        "> 0 and <= 1e+09",
    ),
    ("/spec_pack", {"name": "x", "specs": {"power_w_max": 1.0}}, "/spec_pack/specs/power_w_max", None, None),
    (
        "/spec_pack",
        {"name": "x", "specs": {"aileron_rate_deg_s_max": {"axis": "altitude_m", "values": [1.0]}}},
        "/spec_pack/specs/aileron_rate_deg_s_max/values",
        "deg/s",
        "a list of 2 numbers",
    ),
    ("/name", "x" * 201, "/name", None, "text, at least 1 characters, at most 200 characters"),
    ("/name", "", "/name", None, "text, at least 1 characters, at most 200 characters"),
]


@pytest.mark.parametrize(("change", "value", "pointer", "unit", "allowed"), FIELDS)
def test_names_field_unit_and_range(
    client: TestClient, wanted: Any, refused: Any, change: str, value: Any, pointer: str, unit: Any, allowed: Any
) -> None:
    problem = refused(client.post("/v1/designs", json=at(wanted, change, value)), 422)
    (error,) = problem["errors"]
    assert error["pointer"] == pointer
    assert error["unit"] == unit
    assert error["allowed"] is not None
    assert allowed is None or error["allowed"] == allowed
    assert pointer in problem["detail"]


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"])
@pytest.mark.parametrize(
    "pointer",
    [
        "/geometry/chord_m",
        "/trim/tab_deg",
        "/grid/altitude_m/1",
        "/controllers/0/specs/phase_margin_deg_min",
        "/controllers/1/specs/damping_ratio_min/values/1",
        "/controllers/1/gains/K_f/values/1/3",
    ],
)
def test_numbers_that_are_not_finite(client: TestClient, wanted: Any, refused: Any, pointer: str, text: str) -> None:
    wanted["controllers"][1] |= {
        "specs": {"damping_ratio_min": {"axis": "altitude_m", "values": [0.3, 0.4]}},
        "gains": {"K_f": {"values": [[0.4, 0.3, 0.3, 0.2], [0.4, 0.3, 0.3, 0.2]]}},
    }
    response = client.post("/v1/designs", content=raw(wanted, pointer, text), headers=JSON)
    (error,) = refused(response, 422)["errors"]
    assert error["pointer"] == pointer
    assert error["unit"] in ("m", "deg", "1")
    assert error["allowed"]


@pytest.mark.parametrize("missing", ["name", "geometry", "inertia", "aerodynamics", "grid", "actuators", "controllers"])
def test_missing_field(client: TestClient, wanted: Any, refused: Any, missing: str) -> None:
    del wanted[missing]
    (error,) = refused(client.post("/v1/designs", json=wanted), 422)["errors"]
    assert (error["pointer"], error["detail"]) == (f"/{missing}", "this field is required")


@pytest.mark.parametrize(
    ("pointer", "named"),
    [
        ("/name", "/name"),
        ("/aerodynamics/section", "/aerodynamics/section"),
        ("/controllers/0/name", "/controllers/0/name"),
        ("/controllers/0/kind", "/controllers/0/kind"),
        ("/spec_pack", "/spec_pack"),
        ("/geometry/chord_m", "/geometry/chord_m"),
    ],
)
@pytest.mark.parametrize("text", [r'"\ud800"', r'"x\udfffy"'])
def test_lone_surrogates_in_text(
    client: TestClient, wanted: Any, refused: Any, pointer: str, named: str, text: str
) -> None:
    response = client.post("/v1/designs", content=raw(wanted, pointer, text), headers=JSON)
    assert [error["pointer"] for error in refused(response, 422)["errors"]] == [named]


def test_lone_surrogate_in_the_name_of_a_field(client: TestClient, wanted: Any, refused: Any) -> None:
    body = json.dumps(wanted).replace('"chord_m"', r'"chord_\ud800"').encode()
    problem = refused(client.post("/v1/designs", content=body, headers=JSON), 422)
    assert "lone surrogate" in problem["errors"][0]["detail"]


BODIES = {
    "empty": b"",
    "truncated": b'{"name": "x", "geometry": {"chord_m": 0.6',
    "not JSON": b"name=x",
    "two documents": b"{} {}",
    "not UTF-8": b'{"name": "\xff\xfe"}',
    "UTF-16": '{"name": "x"}'.encode("utf-16"),
    "a key twice": b'{"name": "x", "name": "y"}',
    "a key twice, deep": b'{"geometry": {"chord_m": 1, "chord_m": 2}}',
    "nested too deeply": b"[" * 200_000,
    "objects nested too deeply": b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
    "an integer of 5000 digits": b'{"geometry": {"chord_m": ' + b"9" * 5000 + b"}}",
    "a bare control character": b'{"name": "\x01"}',
}


@pytest.mark.parametrize("path", ["/v1/designs", "/v1/linear-models", "/v1/hinge-moments"])
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_unreadable_bodies(client: TestClient, refused: Any, path: str, body: bytes) -> None:
    assert refused(client.post(path, content=body, headers=JSON), 400)["code"] == "unreadable_body"


@pytest.mark.parametrize("path", ["/v1/designs", "/v1/linear-models", "/v1/hinge-moments"])
@pytest.mark.parametrize("body", [b"null", b"3", b'"x"', b"[]", b"true", b"NaN"])
def test_a_body_that_is_no_object(client: TestClient, refused: Any, path: str, body: bytes) -> None:
    problem = refused(client.post(path, content=body, headers=JSON), 422)
    assert problem["errors"][0]["pointer"] == ""


@pytest.mark.parametrize(
    "kind", ["text/plain", "application/x-www-form-urlencoded", "application/jsonx", "", "x" * 500]
)
def test_a_body_not_declared_as_json(client: TestClient, wanted: Any, refused: Any, kind: str) -> None:
    response = client.post("/v1/designs", content=json.dumps(wanted), headers={"Content-Type": kind})
    assert "Content-Type: application/json" in refused(response, 415)["detail"]


@pytest.mark.parametrize("kind", ["application/json; charset=utf-8", "APPLICATION/JSON", "application/vnd.x+json"])
def test_json_under_its_other_names(client: TestClient, quick: Any, kind: str) -> None:
    response = client.post("/v1/designs", content=json.dumps(quick), headers={"Content-Type": kind})
    assert response.status_code in (200, 201), response.text


def test_byte_order_mark_is_tolerated(client: TestClient, quick: Any) -> None:
    response = client.post("/v1/designs", content=b"\xef\xbb\xbf" + json.dumps(quick).encode(), headers=JSON)
    assert response.status_code in (200, 201), response.text


def test_grid_over_the_limit(client: TestClient, wanted: Any, refused: Any) -> None:
    wanted["grid"] = {
        "altitude_m": {"from": 0, "to": 9000, "count": 10_000},
        "mach": {"from": 0.1, "to": 0.6, "count": 10_000},
    }
    problem = refused(client.post("/v1/designs", json=wanted), 422)
    assert problem["code"] == "limit_exceeded"
    assert "max_grid_points" in problem["detail"]
    assert "GAINFIELD_MAX_GRID_POINTS" in problem["detail"]
    assert problem["errors"][0] == {
        "pointer": "/grid",
        "detail": "100000000 grid points",
        "unit": "1",
        "allowed": "<= 2500",
    }
    parts = {key: wanted[key] for key in ("geometry", "inertia", "aerodynamics", "grid")}
    assert refused(client.post("/v1/linear-models", json=parts), 422)["code"] == "limit_exceeded"


def test_controllers_over_the_limit(client: TestClient, quick: Any, refused: Any) -> None:
    quick["controllers"] = [dict(quick["controllers"][0], name=f"c{i}") for i in range(17)]
    problem = refused(client.post("/v1/designs", json=quick), 422)
    assert (problem["code"], problem["errors"][0]["allowed"]) == ("limit_exceeded", "<= 16")


def test_work_over_the_limit(client: TestClient, wanted: Any, refused: Any) -> None:
    wanted["grid"] = {
        "altitude_m": {"from": 0, "to": 9000, "count": 50},
        "mach": {"from": 0.1, "to": 0.6, "count": 50},
    }
    wanted["controllers"] = [dict(wanted["controllers"][2], name=f"c{i}") for i in range(4)]
    problem = refused(client.post("/v1/designs", json=wanted), 422)
    assert "max_point_designs" in problem["detail"]


WEIGHTS = {"rule": "explicit", "Q": [[1.0 * (i == j) for j in range(5)] for i in range(5)], "R": [[1, 0], [0, 1]]}


@pytest.mark.parametrize(
    ("change", "pointer", "words"),
    [
        ({"R": [[1, 0], [0, 0]]}, "/controllers/0/weights/R", "not positive definite"),
        ({"R": [[1, 0], [0, -1]]}, "/controllers/0/weights/R", "not positive definite"),
        ({"R": [[1, 2], [0, 1]]}, "/controllers/0/weights/R", "not symmetric"),
        ({"Q": [[-1.0 * (i == j) for j in range(5)] for i in range(5)]}, "/controllers/0/weights/Q", "semidefinite"),
        ({"Q": [[0.0] * 5] * 5}, "/controllers/0/weights/Q", ""),
        ({"N": [[9.0, 9.0]] * 5}, "/controllers/0/weights/N", "semidefinite"),
    ],
)
def test_weights_that_cannot_work(
    client: TestClient, quick: Any, refused: Any, change: Any, pointer: str, words: str
) -> None:
    quick["controllers"][0]["weights"] = WEIGHTS | change
    problem = refused(client.post("/v1/designs", json=quick), 422)
    (error,) = problem["errors"]
    assert error["pointer"] == pointer
    assert words in error["detail"]
    assert "positive definite" in error["allowed"]


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"Q": [[1.0]]}, "/controllers/0/weights/Q"),
        ({"R": [[1.0, 0.0]]}, "/controllers/0/weights/R"),
        ({"R": [["a", 0.0], [0.0, 1.0]]}, "/controllers/0/weights/R/0/0"),
    ],
)
def test_weights_of_the_wrong_form(client: TestClient, quick: Any, refused: Any, change: Any, pointer: str) -> None:
    quick["controllers"][0]["weights"] = WEIGHTS | change
    (error,) = refused(client.post("/v1/designs", json=quick), 422)["errors"]
    assert error["pointer"] == pointer


def test_weights_of_the_second_of_two_regulators(client: TestClient, quick: Any, refused: Any) -> None:
    bad = dict(quick["controllers"][0], name="bad", weights=WEIGHTS | {"R": [[0, 0], [0, 1]]})
    quick["controllers"].append(bad)
    (error,) = refused(client.post("/v1/designs", json=quick), 422)["errors"]
    assert error["pointer"] == "/controllers/1/weights/R"


def test_many_errors_are_answered_in_part(client: TestClient, wanted: Any, refused: Any) -> None:
    wanted["grid"]["dynamic_pressure_pa"] = ["x"] * 5000
    problem = refused(client.post("/v1/designs", json=wanted), 422)
    assert len(problem["errors"]) == 50
    assert "4999 more" in problem["detail"]


def test_unknown_names_of_the_name_itself_are_not_echoed_whole(client: TestClient, refused: Any) -> None:
    problem = refused(client.get("/v1/designs/" + "a" * 5000), 404)
    assert len(problem["detail"]) < 200
