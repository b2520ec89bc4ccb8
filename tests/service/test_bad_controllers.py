"""Bad requests of classical controllers, their actuators and spec packs: field, unit and range; never a 500."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from service.designs import canonical
from service.examples import example
from service.schemas.requests import DesignRequest
from service.to_domain import study_of
from service.wire.pointers import field_refusal


def at(document: Any, pointer: str, value: Any) -> Any:
    """The document with a value put at a pointer."""
    changed = copy.deepcopy(document)
    *parents, last = pointer.split("/")[1:]
    place = changed
    for part in parents:
        place = place[int(part) if isinstance(place, list) else part]
    place[int(last) if isinstance(place, list) else last] = value
    return changed


OVER_GRID = "2 lists of 4 numbers, by altitude_m and dynamic_pressure_pa; or a list along an axis that is named"

# field of the first classical controller, value put there, pointer named below it, unit named, allowed named
CLASSICAL = [
    ("specs/damping_ratio_min", 1.1, "", "1", ">= 0 and <= 1"),
    ("specs/gain_margin_db_min", 61, "", "dB", ">= 0 and <= 60"),
    ("specs/phase_margin_deg_min", 91, "", "deg", ">= 0 and <= 90"),
    ("specs/delay_margin_s_min", -1e-3, "", "s", ">= 0 and <= 10"),
    ("specs/disk_margin_min", 2.1, "", "1", ">= 0 and <= 2"),
    ("specs/sensitivity_peak_max", 0.9, "", "1", ">= 1 and <= 1000"),
    ("specs/settling_time_s_max", 0, "", "s", ">= 0.0001 and <= 1000"),
    ("specs/overshoot_percent_max", 101, "", "%", ">= 0 and <= 100"),
    ("specs/bandwidth_rad_s_min", 0, "", "rad/s", ">= 0.001 and <= 100000"),
    ("specs/noise_gain_max", 0, "", "1", ">= 1e-06 and <= 1e+06"),
    ("specs/tab_rate_deg_s_max", 0, "", "deg/s", "> 0 and <= 1e+06"),
    ("specs/tab_deflection_deg_max", 181, "", "deg", "> 0 and <= 180"),
    ("specs/tab_torque_n_m_max", 1, "", None, None),
    ("specs/bandwidth_deg_s_min", 1, "", None, None),
    ("specs/bandwidth_rad_s_min", "30", "", "rad/s", None),
    ("specs/bandwidth_rad_s_min", [30.0], "", "rad/s", None),
    ("specs/bandwidth_rad_s_min", {}, "/values", "rad/s", "a list, at least 1 items, at most 10000 items"),
    ("specs/bandwidth_rad_s_min", {"values": []}, "/values", "rad/s", None),
    ("specs/bandwidth_rad_s_min", {"values": 3}, "/values", "rad/s", None),
    ("specs/bandwidth_rad_s_min", {"values": [[30.0] * 4, [30.0, 1, 1, None]]}, "/values/1/3", "rad/s", None),
    ("specs/bandwidth_rad_s_min", {"values": [[30.0] * 4, []]}, "/values/1", "rad/s", None),
    ("specs/bandwidth_rad_s_min", {"values": [{}]}, "/values/0", "rad/s", None),
    ("specs/bandwidth_rad_s_min", {"values": [[30.0] * 4] * 3}, "/values", "rad/s", OVER_GRID),
    ("specs/bandwidth_rad_s_min", {"values": [[30.0] * 4, [30.0] * 3]}, "/values/1", "rad/s", "a list of 4 numbers"),
    ("specs/bandwidth_rad_s_min", {"values": [30.0] * 4}, "/values", "rad/s", OVER_GRID),
    ("specs/bandwidth_rad_s_min", {"values": [30.0, [30.0]]}, "/values", "rad/s", OVER_GRID),
    ("specs/bandwidth_rad_s_min", {"axis": "mach", "values": [30.0] * 4}, "/axis", None, None),
    ("specs/bandwidth_rad_s_min", {"axis": "alpha", "values": [30.0] * 4}, "/axis", None, None),
    (
        "specs/phase_margin_deg_min",
        {"axis": "dynamic_pressure_pa", "values": [30.0] * 3},
        "/values",
        "deg",
        "a list of 4 numbers",
    ),
    ("specs/phase_margin_deg_min", {"axis": "altitude_m", "values": [[1.0] * 4] * 2}, "/values", "deg", None),
    ("specs/phase_margin_deg_min", {"axis": "altitude_m", "values": [1.0, 91]}, "/values/1", "deg", ">= 0 and <= 90"),
    ("specs/phase_margin_deg_min", {"axis": "altitude_m", "values": [1.0, 1.0], "unit": "deg"}, "/unit", None, None),
    ("gains", 3, "", None, "an object with the fields K_theta, K_d, K_p, K_i, or null"),
    ("gains/K_d", -1e-9, "", "s", ">= 0 and <= 1e+06"),
    ("gains/K_p", -1, "", "1", ">= 0 and <= 1e+06"),
    ("gains/K_i", 1e7, "", "1/s", ">= 0 and <= 1e+06"),
    ("gains/K_f", 1, "", None, "fields K_theta, K_d, K_p, K_i"),
    ("gains/K_x", 1, "", None, "fields K_theta, K_d, K_p, K_i"),
    ("gains/K_theta", 1, "", "1/s", "fields K_d, K_p, K_i, or tab_command rate"),
    ("gains/K_d", {"axis": "altitude_m", "values": [1.0, 2.0, 3.0]}, "/values", "s", "a list of 2 numbers"),
    ("gains/K_i", {"axis": "altitude_m", "values": [-1.0, 2.0]}, "/values/0", "1/s", ">= 0 and <= 1e+06"),
    ("gains/K_p", {"axis": "airspeed_m_s", "values": [1.0]}, "/axis", None, None),
    ("smoothing", 5, "", None, "an object with the fields bandwidth_loss_percent_max, or null"),
    ("smoothing", {}, "/bandwidth_loss_percent_max", "%", ">= 0 and <= 50"),
    ("smoothing", {"bandwidth_loss_percent_max": 51}, "/bandwidth_loss_percent_max", "%", ">= 0 and <= 50"),
    ("sample_time_s", 0, "", "s", ">= 1e-05 and <= 1, or null"),
    ("sample_time_s", 1.01, "", "s", ">= 1e-05 and <= 1, or null"),
    ("computational_delay_s", 0.0, "", "s", "null, or sample_time_s beside it"),
    ("computational_delay_s", -1, "", "s", ">= 0 and <= 10, or null"),
    ("rate_filter_hz", 0, "", "Hz", ">= 0.001 and <= 10000, or null"),
]


@pytest.fixture
def classical(wanted: Any) -> Any:
    """The example with its two classical controllers alone, no gain given."""
    wanted["controllers"] = [dict(controller, gains={}) for controller in wanted["controllers"][:2]]
    return wanted


@pytest.mark.parametrize(("field", "value", "below", "unit", "allowed"), CLASSICAL)
def test_classical_controllers_name_field_unit_and_range(
    client: TestClient, classical: Any, refused: Any, field: str, value: Any, below: str, unit: Any, allowed: Any
) -> None:
    field = f"/controllers/0/{field}"
    (error,) = refused(client.post("/v1/designs", json=at(classical, field, value)), 422)["errors"]
    assert (error["pointer"], error["unit"]) == (field + below, unit)
    assert error["allowed"] is not None
    assert allowed is None or error["allowed"] == allowed


def test_wrong_sizes_say_how_many_are_needed(client: TestClient, classical: Any, refused: Any) -> None:
    def detail(value: Any) -> str:
        answer = client.post("/v1/designs", json=at(classical, "/controllers/1/gains/K_f", value))
        (error,) = refused(answer, 422)["errors"]
        assert error["pointer"].startswith("/controllers/1/gains/K_f/values")
        said: str = error["detail"]
        return said

    along = {"axis": "dynamic_pressure_pa", "values": [0.5] * 3}
    assert detail(along) == "3 values along dynamic_pressure_pa, which has 4 breakpoints"
    assert detail({"values": [[0.5] * 4]}) == "1 rows of values on a grid of 2 by 4 points"
    assert detail({"values": [[0.5] * 5, [0.5] * 4]}) == "5 values in a row on a grid of 2 by 4 points"
    classical["grid"]["dynamic_pressure_pa"] = {"from": 245.0, "to": 1531.25, "count": 5}
    assert "5 breakpoints" in detail(along)


def test_a_delay_of_too_many_samples(client: TestClient, classical: Any, refused: Any) -> None:
    classical["controllers"][1] |= {"sample_time_s": 0.001, "computational_delay_s": 0.0101}
    (error,) = refused(client.post("/v1/designs", json=classical), 422)["errors"]
    assert error["pointer"] == "/controllers/1/computational_delay_s"
    assert (error["unit"], error["allowed"]) == ("s", ">= 0 and <= 0.01, or null")


def test_specs_are_left_out_only_where_nothing_is_chosen(client: TestClient, classical: Any, refused: Any) -> None:
    classical["controllers"][1] |= {"gains": {"K_f": 0.5}}
    del classical["controllers"][1]["specs"]
    (error,) = refused(client.post("/v1/designs", json=classical), 422)["errors"]
    assert error["pointer"] == "/controllers/1/specs"
    assert error["allowed"] == "an object of specs, or all the gains K_f, K_i given"


ALL_GAINS = {"K_d": 0.02, "K_p": 0.7, "K_i": 40.0}


@pytest.mark.parametrize(
    ("controller", "tab", "pointer", "words"),
    [
        ({"gains": {"K_d": 0.02, "K_p": 0.7}}, {}, "servo_bandwidth_hz", "K_d, K_p, K_i are given"),
        ({"gains": ALL_GAINS, "rate_filter_hz": None}, {}, "servo_bandwidth_hz", "must be filtered"),
        ({"gains": ALL_GAINS}, {"servo_damping_ratio": 0.7}, "servo_damping_ratio", "no bandwidth"),
        ({"tab_command": "rate"}, {}, "rate_loop_bandwidth_hz", "K_theta"),
        ({"tab_command": "rate", "gains": ALL_GAINS}, {}, "rate_loop_bandwidth_hz", "K_theta"),
    ],
)
def test_ideal_tab_actuators(
    client: TestClient, classical: Any, refused: Any, controller: Any, tab: Any, pointer: str, words: str
) -> None:
    classical["actuators"]["tab"] = tab
    classical["controllers"] = [classical["controllers"][0] | controller]
    (error,) = refused(client.post("/v1/designs", json=classical), 422)["errors"]
    assert error["pointer"] == f"/actuators/tab/{pointer}"
    assert words in error["detail"]
    assert "null" in error["allowed"]


def full() -> dict[str, Any]:
    """A request of classical controllers that leaves out no field and no form of a value."""
    document = example("wind_tunnel")
    varying = {"damping_ratio_min": {"axis": "altitude_m", "values": [0.3, 0.4]}, "delay_margin_s_min": 0.01}
    given = {"K_theta": 100.0, "K_f": {"values": [[0.4, 0.3, 0.3, 0.2], [0.4, 0.3, 0.3, 0.1]]}}
    digital = {"sample_time_s": 0.01, "computational_delay_s": 0.005, "smoothing": {"bandwidth_loss_percent_max": 5.0}}
    document["controllers"] = [
        document["controllers"][0] | {"tab_command": "deflection", "gains": {"K_p": 0.5}},
        {"name": "pf", "kind": "positive_feedback", "tab_command": "rate", "specs": varying, "gains": given} | digital,
    ]
    torques = {"axis": "dynamic_pressure_pa", "values": [1.0, 2.0, 3.0, 4.0]}
    document["spec_pack"] = {"name": "ours", "specs": {"tab_torque_n_m_max": torques, "noise_gain_max": 9.0}}
    return document


def places(document: Any, pointer: str = "") -> Iterator[str]:
    """Pointers to everything inside a document."""
    inside = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in inside:
        yield f"{pointer}/{key}"
        if isinstance(value, dict | list):
            yield from places(value, f"{pointer}/{key}")


@pytest.fixture(scope="module")
def openapi(client: TestClient) -> dict[str, Any]:
    document: dict[str, Any] = client.get("/openapi.json").json()
    return document


NUMBERS = st.integers() | st.floats() | st.sampled_from([-0.0, 0.5, 1e308, 5e-324, 10**400])
ANYTHING = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(max_size=8) | st.sampled_from(["rate", "default", "altitude_m"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["values", "axis", "K_i", "specs", "name", "x/~y"]), inner, max_size=3)
    ),
    max_leaves=8,
)
DAMAGED = [pointer for pointer in places(full()) if pointer.startswith(("/actuators", "/grid", "/contr", "/spec_pack"))]


@settings(max_examples=300, deadline=None)
@given(damage=st.lists(st.tuples(st.sampled_from(DAMAGED), ANYTHING), min_size=1, max_size=2))
def test_a_damaged_request_is_read_or_refused_at_a_place_in_it(
    openapi: dict[str, Any], damage: list[tuple[str, Any]]
) -> None:
    """Without a design: what is let through becomes a study, all else names a field of an object that is there."""
    document = full()
    for pointer, value in damage:
        try:
            document = at(document, pointer, value)
        except (KeyError, IndexError, TypeError, ValueError):
            continue
    try:
        request = DesignRequest.model_validate(document)
    except ValidationError as invalid:
        for error in invalid.errors():
            located = dict(error) | {"loc": ("body", *error["loc"])}
            refusal = field_refusal(located, openapi, openapi["paths"]["/v1/designs"]["post"])
            assert refusal.allowed
            place = document
            for part in refusal.pointer.split("/")[1:-1]:
                place = place[int(part) if isinstance(place, list) else part.replace("~1", "/").replace("~0", "~")]
            assert isinstance(place, dict | list)
    else:
        study_of.study(request)
        assert canonical(DesignRequest.model_validate_json(canonical(request))) == canonical(request)


def test_the_whole_request_is_one() -> None:
    """What is damaged above is a request as it stands."""
    (nf, pf) = study_of.study(DesignRequest.model_validate(full())).controllers
    assert (nf.name, pf.name) == ("nf", "pf")
