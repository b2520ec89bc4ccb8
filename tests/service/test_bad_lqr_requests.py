"""Bad requests of concurrent actuation: field, unit and range, at the matrix at fault; never a 500."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from service.app import create_app
from service.designs import canonical
from service.examples import example
from service.schemas.lqr_requests import Lqr
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.to_domain import study_of
from service.wire.pointers import field_refusal
from tests.service.lqr_bodies import (
    BALANCED,
    BRYSON,
    DELAY,
    EXPLICIT,
    KALMAN,
    LAGS,
    NET_WORK,
    OUTPUT,
    WITH_TAB,
    asked,
    at,
    eye,
    taken,
)

WEIGHTS = "/controllers/0/weights"


def refusals(client: TestClient, refused: Any, document: Any) -> list[dict[str, Any]]:
    errors: list[dict[str, Any]] = refused(client.post("/v1/designs", json=document), 422)["errors"]
    return errors


TWO_SIZES = (
    "7 rows of 7 numbers, over dt dt_rate da da_rate int_a tab_torque aileron_torque; or 5 rows of 5 numbers, over dt "
    "dt_rate da da_rate int_a"
)
OUTPUT_NAMES = (
    "one of dt, dt_rate, da, da_rate, int_a, da_error, dt_acceleration, da_acceleration, T_t, T_a, T_t_command, "
    "T_a_command"
)
NO_INTEGRAL = "null, or the reference aileron_and_tab"
OVER_INPUTS = "5 rows of 2 numbers, over dt dt_rate da da_rate int_a and the inputs T_t T_a"
OF_BALANCED = "null; of this form tab_power_w, aileron_power_w"
OF_NET_WORK = "null; of this form tab_price, aileron_price, part"
INTEGRAL = ">= 1e-06 and <= 1e+06"
FOLLOWING = "or the reference aileron or aileron_and_tab"
PART = "> 0 and <= 1, or null"
CONTINUOUS = "null, or no sample_time_s"

# fields of the regulator, pointer named below it, unit named, allowed named
BAD: list[tuple[Any, str, str | None, str | None]] = [
    ({"weights": BRYSON | {"tab_integral_deg_s": 1}}, "weights/tab_integral_deg_s", "deg s", NO_INTEGRAL),
    ({"reference": "aileron_and_tab"}, "weights/tab_integral_deg_s", "deg s", INTEGRAL),
    ({"weights": BRYSON | {"aileron_integral_deg_s": None}}, "weights/aileron_integral_deg_s", "deg s", INTEGRAL),
    ({"reference": "none", "weights": WITH_TAB}, "weights/tab_integral_deg_s", "deg s", None),
    ({"weights": BRYSON | {"tab_torque_n_m": 0}}, "weights/tab_torque_n_m", "N m", ">= 1e-09 and <= 1e+09"),
    ({"weights": {}}, "weights/rule", None, "one of bryson, explicit, output, power"),
    ({"weights": None}, "weights", None, None),
    ({"weights": EXPLICIT | {"Q": eye(4)}}, "weights/Q", "SI", "5 rows of 5 numbers, over dt dt_rate da da_rate int_a"),
    ({"weights": EXPLICIT | {"Q": [[1.0] * 4] * 5}}, "weights/Q", "SI", None),
    ({"weights": EXPLICIT | {"Q": [*eye(5)[:4], [0.0]]}}, "weights/Q", "SI", None),
    ({"weights": EXPLICIT | {"Q": []}}, "weights/Q", "SI", None),
    ({"weights": EXPLICIT | {"Q": [*eye(4), []]}}, "weights/Q/4", "SI", None),
    ({"weights": EXPLICIT | {"Q": [[0, "x"]]}}, "weights/Q/0/1", "SI", ">= -1e+12 and <= 1e+12"),
    ({"weights": EXPLICIT | {"R": [[1, 0]]}}, "weights/R", "SI", "a list, at least 2 items, at most 2 items"),
    ({"weights": EXPLICIT | {"R": [[1, 0], [0]]}}, "weights/R/1", "SI", "a list, at least 2 items, at most 2 items"),
    ({"weights": EXPLICIT | {"N": eye(5)}}, "weights/N", "SI", OVER_INPUTS),
    ({"weights": EXPLICIT | {"N": [[0, 0]] * 4}}, "weights/N", "SI", None),
    ({"weights": EXPLICIT, "reference": "none"}, "weights/Q", "SI", "4 rows of 4 numbers, over dt dt_rate da da_rate"),
    ({"weights": OUTPUT | {"W_y": eye(3)}}, "weights/W_y", "SI", "2 rows of 2 numbers, over da_error int_a"),
    ({"weights": OUTPUT | {"W_y": [[1, 0], [0]]}}, "weights/W_y", "SI", None),
    ({"weights": OUTPUT | {"W_u": eye(3)}}, "weights/W_u", "SI", None),
    ({"weights": OUTPUT | {"outputs": ["da", "int_t"]}}, "weights/outputs/1", None, OUTPUT_NAMES),
    ({"weights": OUTPUT | {"outputs": ["da", "da"]}}, "weights/outputs/1", None, "each output once"),
    ({"weights": OUTPUT | {"outputs": []}}, "weights/outputs", None, None),
    ({"weights": OUTPUT | {"outputs": ["da", 3]}}, "weights/outputs/1", None, None),
    ({"weights": OUTPUT | {"outputs": ["da", "\ud800"]}}, "weights/outputs/1", None, None),
    ({"weights": OUTPUT, "reference": "none"}, "weights/outputs/0", None, None),
    ({"weights": BALANCED | {"form": "peak"}}, "weights/form", None, "one of net_work, balanced"),
    ({"weights": BALANCED | {"base": BALANCED}}, "weights/base/rule", None, "one of bryson, explicit, output"),
    ({"weights": BALANCED | {"base": WITH_TAB}}, "weights/base/tab_integral_deg_s", "deg s", None),
    ({"weights": BALANCED | {"base": EXPLICIT | {"Q": eye(3)}}}, "weights/base/Q", "SI", None),
    ({"weights": NET_WORK | {"base": OUTPUT | {"outputs": ["x", "y"]}}}, "weights/base/outputs/0", None, OUTPUT_NAMES),
    ({"weights": BALANCED | {"tab_power_w": 0}}, "weights/tab_power_w", "W", ">= 1e-09 and <= 1e+09, or null"),
    ({"weights": BALANCED | {"tab_power_w": None}}, "weights/tab_power_w", "W", ">= 1e-09 and <= 1e+09"),
    ({"weights": BALANCED | {"tab_price": 0}}, "weights/tab_price", "1/W", OF_BALANCED),
    ({"weights": BALANCED | {"part": 0.5}}, "weights/part", "1", OF_BALANCED),
    ({"weights": NET_WORK | {"aileron_power_w": 1}}, "weights/aileron_power_w", "W", OF_NET_WORK),
    ({"weights": NET_WORK | {"tab_price": 0}}, "weights/tab_price", "1/W", "> 0 and <= 1e+12"),
    ({"weights": NET_WORK | {"tab_price": -1}}, "weights/tab_price", "1/W", ">= 0 and <= 1e+12, or null"),
    ({"weights": NET_WORK | {"part": 0}}, "weights/part", "1", PART),
    ({"weights": NET_WORK | {"part": 1.1}}, "weights/part", "1", PART),
    ({"weights": NET_WORK | {"keep_settling": 1}}, "weights/keep_settling", None, "true or false, or null"),
    ({"weights": BALANCED, "reference": "none"}, "weights/form", None, f"net_work, {FOLLOWING}"),
    (
        {"weights": NET_WORK | {"keep_settling": True}, "reference": "none"},
        "weights/keep_settling", None, f"false, {FOLLOWING}",
    ),
    ({"tab_allocation": "least"}, "tab_allocation", None, "one of zero_aileron_torque, least_torque, least_power"),
    ({"tab_allocation": 3}, "tab_allocation", None, None),
    ({"tab_allocation": {}}, "tab_allocation/tab_per_aileron", "1", ">= -1000 and <= 1000"),
    ({"tab_allocation": {"tab_per_aileron": 1001}}, "tab_allocation/tab_per_aileron", "1", ">= -1000 and <= 1000"),
    ({"tab_allocation": "least_power", "reference": "none"}, "tab_allocation", None, None),
    ({"measurement": {"kind": "luenberger"}}, "measurement/kind", None, "one of kalman, rate_filters"),
    ({"measurement": "kalman"}, "measurement", None, None),
    ({"measurement": {"kind": "rate_filters"}}, "measurement/cutoff_hz", "Hz", ">= 0.001 and <= 10000"),
    ({"measurement": KALMAN | {"cutoff_hz": 1}}, "measurement/cutoff_hz", None, None),
    (
        {"measurement": KALMAN | {"tab_torque_noise": -1}},
        "measurement/tab_torque_noise", "N m/sqrt(Hz)", ">= 0 and <= 1e+06",
    ),
    (
        {"measurement": KALMAN | {"aileron_angle_noise_deg": 0}},
        "measurement/aileron_angle_noise_deg", "deg/sqrt(Hz)", ">= 1e-12 and <= 1000",
    ),
    ({"measurement": KALMAN | {"recovery": -0.1}}, "measurement/recovery", "1", ">= 0 and <= 1e+12"),
    ({"measurement": KALMAN, "sample_time_s": 0.01}, "measurement", None, CONTINUOUS),
    ({"delay_states": 1, "sample_time_s": 0.01}, "delay_states", None, "0, or no sample_time_s"),
    ({"sample_time_s": 0}, "sample_time_s", "s", ">= 1e-05 and <= 1, or null"),
    ({"computational_delay_s": 0.01}, "computational_delay_s", "s", "null, or sample_time_s beside it"),
    (
        {"sample_time_s": 0.001, "computational_delay_s": 0.0101},
        "computational_delay_s", "s", ">= 0 and <= 0.01, or null",
    ),
    ({"delay_states": 9}, "delay_states", None, "an integer >= 0 and <= 8"),
    ({"delay_states": 1.0}, "delay_states", None, "an integer >= 0 and <= 8"),
    ({"delay_states": -1}, "delay_states", None, "an integer >= 0 and <= 8"),
    ({"specs": {}}, "specs", None, None),
]  # fmt: skip


@pytest.mark.parametrize(("fields", "below", "unit", "allowed"), BAD)
def test_names_field_unit_and_range(
    client: TestClient, refused: Any, fields: Any, below: str, unit: str | None, allowed: str | None
) -> None:
    body = json.dumps(asked(fields)).encode()
    answer = client.post("/v1/designs", content=body, headers={"Content-Type": "application/json"})
    (error,) = refused(answer, 422)["errors"]
    assert (error["pointer"], error["unit"]) == (f"/controllers/0/{below}", unit)
    assert error["allowed"]
    assert allowed is None or error["allowed"] == allowed


def test_states_of_the_actuators_are_named(client: TestClient, refused: Any) -> None:
    document = asked({"weights": EXPLICIT | {"Q": eye(6)}}, LAGS, LAGS)
    (error,) = refusals(client, refused, document)
    assert (error["pointer"], error["allowed"]) == (f"{WEIGHTS}/Q", TWO_SIZES)
    assert error["detail"] == "Q has 6 rows of 6 numbers"
    document["controllers"][0]["weights"] = EXPLICIT | {"Q": [*eye(5)[:4], [0.0]]}
    assert refusals(client, refused, document)[0]["detail"] == "Q has 5 rows of 1 to 5 numbers"


@pytest.mark.parametrize(
    ("fields", "delays", "most"),
    [
        ({"sample_time_s": 1e-5}, (1.0, 0.0), 24),
        ({"sample_time_s": 0.001}, (0.0221, 0.0), 24),
        ({"sample_time_s": 0.001, "computational_delay_s": 0.0}, (0.0121, 0.012), 24),
        ({"kind": "positive_feedback", "specs": {}, "sample_time_s": 0.001}, (0.0471, 1.0), 48),
    ],
)
def test_commands_on_their_way(
    client: TestClient, refused: Any, fields: Any, delays: tuple[float, float], most: int
) -> None:
    """Delays of thousands of samples would make as many states of the loop from sample to sample."""
    tab, aileron = ({"delay_s": delay} for delay in delays)
    document = asked(fields, tab, aileron)
    if "kind" in fields:
        del document["controllers"][0]["weights"]
    document["reference"]["duration_s"] = 0.2
    (error,) = refusals(client, refused, document)
    assert (error["pointer"], error["unit"]) == ("/controllers/0/sample_time_s", "s")
    assert f"at most {most} commands" in error["allowed"]
    document["actuators"]["tab"]["delay_s"] = round(delays[0] - 0.0001, 4) if delays[0] < 1.0 else 0.0
    assert taken(document)


def test_a_step_of_too_many_samples(client: TestClient, refused: Any) -> None:
    document = asked({"sample_time_s": 1e-5})
    (error,) = refusals(client, refused, document)
    assert (error["pointer"], error["unit"]) == ("/controllers/0/sample_time_s", "s")
    assert error["allowed"] == ">= 5e-05 and <= 1, or null"
    assert "100000 samples" in error["detail"]
    assert taken(asked({"sample_time_s": 5e-5}))


@pytest.mark.parametrize(
    ("delays", "sampling", "needed"),
    [
        ((0.5, 0.0), {}, "> 0.5 and <= 1000"),
        ((0.1, 0.6), {}, "> 0.6 and <= 1000"),
        ((0.0, 0.0), {"sample_time_s": 0.4}, "> 0.6 and <= 1000"),
        ((0.2, 0.0), {"sample_time_s": 0.4, "computational_delay_s": 0.3}, "> 0.7 and <= 1000"),
    ],
)
def test_a_response_longer_than_the_delays(
    client: TestClient, refused: Any, delays: tuple[float, float], sampling: Any, needed: str
) -> None:
    tab, aileron = ({"delay_s": delay} for delay in delays)
    document = asked(sampling, tab, aileron)
    document["reference"]["duration_s"] = 0.5
    (error,) = refusals(client, refused, document)
    assert (error["pointer"], error["unit"], error["allowed"]) == ("/reference/duration_s", "s", needed)
    document["reference"]["duration_s"] = float(needed.split()[1]) + 1e-9
    assert taken(document)


# weights, actuators, pointer below the weights, words of the detail
CANNOT_WORK: list[tuple[Any, str, str, str]] = [
    (EXPLICIT | {"R": [[1, 0], [0, -1]]}, "/R", "R: R is not positive definite", "R symmetric positive definite"),
    (EXPLICIT | {"Q": (-np.eye(5)).tolist()}, "/Q", "Q: Q is not positive semidefinite", "positive semidefinite"),
    (EXPLICIT | {"N": [[9, 9]] * 5}, "/N", "N: Q - N R^-1 N'", "positive semidefinite"),
    (EXPLICIT | {"Q": np.zeros((5, 5)).tolist()}, "/Q", "Q: ", "sees every mode"),
    (OUTPUT | {"W_u": [[1, 0], [0, 0]]}, "/W_u", "W_u: ", "W_u symmetric positive definite"),
    (OUTPUT | {"W_y": [[1, 2], [0, 1]]}, "/W_y", "W_y: ", "W_y symmetric positive semidefinite"),
    # Blind to the integral: a fault of Q inside, of the outputs on the wire.
    (OUTPUT | {"outputs": ["dt", "da"]}, "/W_y", "Q: ", "show every mode"),
    (OUTPUT | {"outputs": ["dt", "da_acceleration"]}, "/W_y", "", "show every mode"),
    (BALANCED | {"base": EXPLICIT | {"R": [[0, 0], [0, 1]]}}, "/base/R", "R: ", "R symmetric positive definite"),
    (NET_WORK | {"base": EXPLICIT | {"Q": (-np.eye(5)).tolist()}}, "/base/Q", "Q: ", "semidefinite"),
    (BALANCED | {"base": OUTPUT | {"W_y": (-np.eye(2)).tolist()}}, "/base/W_y", "W_y: ", "W_y symmetric"),
    (NET_WORK | {"tab_price": 1e9}, "", "N: Q - N R^-1 N'", "prices of work"),
    (NET_WORK | {"base": OUTPUT, "part": 0.5}, "", "N: no price of net work", "whose rate has a weight"),
]  # fmt: skip


@pytest.mark.parametrize(("weights", "below", "words", "allowed"), CANNOT_WORK)
def test_weights_that_cannot_work(
    client: TestClient, refused: Any, weights: Any, below: str, words: str, allowed: str
) -> None:
    """Of the second of two controllers, at the matrix that the fault comes from."""
    document = asked({})
    document["controllers"].append({"name": "bad", "kind": "lqr", "weights": weights})
    (error,) = refusals(client, refused, document)
    assert (error["pointer"], error["unit"]) == (f"/controllers/1/weights{below}", "SI")
    assert error["detail"].startswith(words)
    assert allowed in error["allowed"]


def test_work_over_the_limit(tmp_path: Any, refused: Any) -> None:
    """Powers to meet and delays take searches, 1 + delay_states // 2 of them; plain regulators take none."""
    app = create_app(Settings(data_dir=tmp_path, max_tab_only_designs=3))
    grid = {"altitude_m": [0.0], "dynamic_pressure_pa": [500.0, 980.0]}
    with TestClient(app) as client:
        for document, searches in (
            (asked({"delay_states": 8}), 0),
            (asked({"weights": NET_WORK}), 0),
            (asked({"weights": NET_WORK | {"keep_settling": True}}), 2),
            (asked({"weights": BALANCED, "delay_states": 1}, DELAY), 4),
            (asked({"delay_states": 5}, aileron=DELAY), 6),
        ):
            response = client.post("/v1/designs", json=document | {"grid": grid})
            if searches <= 3:
                assert response.status_code == 201, response.text
                continue
            problem = refused(response, 422)
            assert problem["code"] == "limit_exceeded"
            assert "max_tab_only_designs" in problem["detail"]
            assert problem["errors"][0]["detail"].startswith(f"{searches} searches: grid points times tab-only")


# fields, tab, aileron: the ends of ranges, which must end in a design or a reason
EXTREMES: list[tuple[Any, Any, Any]] = [
    ({"weights": BRYSON | dict.fromkeys(("aileron_deg", "tab_rate_deg_s", "aileron_integral_deg_s"), 1e-6)}, {}, {}),
    ({"weights": BRYSON | {"aileron_integral_deg_s": 1e6, "tab_torque_n_m": 1e-9, "aileron_torque_n_m": 1e9}}, {}, {}),
    ({"weights": EXPLICIT | {"Q": (1e12 * np.eye(5)).tolist(), "N": [[1e12, -1e12]] * 5}}, {}, {}),
    ({"weights": EXPLICIT | {"Q": np.full((5, 5), 1e12).tolist(), "R": (1e12 * np.eye(2)).tolist()}}, {}, {}),
    ({"weights": OUTPUT | {"W_y": (1e12 * np.eye(2)).tolist(), "W_u": (1e-12 * np.eye(2)).tolist()}}, {}, {}),
    ({"weights": NET_WORK | {"tab_price": 1e12, "part": 5e-324}}, {}, {}),
    ({"weights": NET_WORK | {"tab_price": 5e-324, "aileron_price": 1e12, "part": 1.0, "keep_settling": True}}, {}, {}),
    ({"weights": BALANCED | {"tab_power_w": 1e-9, "aileron_power_w": 1e9}}, {}, {}),
    ({"tab_allocation": {"tab_per_aileron": -1000}}, {}, {}),
    ({"tab_allocation": "least_power"}, {"limits": {"power_w": 1e-12}}, {"limits": {"power_w": 1e9}}),
    ({}, {"torque_loop_bandwidth_hz": 1e-3}, {"torque_loop_bandwidth_hz": 1e4}),
    ({}, {"delay_s": 0.999}, {"delay_s": 1e-9}),
    ({"delay_states": 8}, {"delay_s": 1e-9}, {}),
]  # fmt: skip


@pytest.mark.parametrize(("fields", "tab", "aileron"), EXTREMES)
def test_the_ends_of_ranges_end_in_a_design_or_a_reason(
    client: TestClient, refused: Any, fields: Any, tab: Any, aileron: Any
) -> None:
    response = client.post("/v1/designs", json=asked(fields, tab, aileron))
    if response.status_code == 422:
        refused(response, 422)
        return
    assert response.status_code in (200, 201), response.text
    (controller,) = response.json()["controllers"]
    ok = controller["outcomes"] == [["ok"]]
    assert {gain["values"][0][0] is not None for gain in controller["gains"]} == {ok}
    assert ok or controller["reasons"][0][0]


def full() -> dict[str, Any]:
    """A request of regulators that leaves out no field and no form of a value."""
    document = example("wind_tunnel")
    document["reference"] |= {"tab_deg": 5.0}
    document["actuators"]["tab"] |= LAGS | DELAY
    document["actuators"]["aileron"] |= DELAY
    price = {"tab_price": 1.0, "aileron_price": 1.0, "part": 0.5, "keep_settling": True}
    fields: list[dict[str, Any]] = [
        {"reference": "aileron_and_tab", "weights": WITH_TAB, "delay_states": 2},
        {"weights": BRYSON, "sample_time_s": 0.01, "computational_delay_s": 0.02},
        {"weights": EXPLICIT | {"N": [[0.0, 0.0]] * 5}, "tab_allocation": {"tab_per_aileron": -1.0}},
        {"weights": BALANCED | {"base": OUTPUT, "aileron_power_w": 9.0}, "measurement": KALMAN | {"recovery": 1.0}},
        {
            "reference": "aileron",
            "weights": NET_WORK | price,
            "measurement": {"kind": "rate_filters", "cutoff_hz": 9.0},
        },
    ]
    document["controllers"] = [
        {"name": f"c{place}", "kind": "lqr", "computational_delay_s": None} | each for place, each in enumerate(fields)
    ]
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


WORDS = ["none", "aileron_and_tab", "bryson", "explicit", "output", "power", "net_work", "kalman", "least_torque", "da"]
NAMES = ["rule", "form", "base", "kind", "Q", "outputs", "tab_per_aileron", "x/~y"]
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.sampled_from(WORDS),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(NAMES), inner, max_size=3),
    max_leaves=8,
)
DAMAGED = [pointer for pointer in places(full()) if pointer.startswith(("/actuators", "/reference", "/controllers"))]


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
    """What is damaged above is a request as it stands, and leaves out no field of a regulator."""
    request = DesignRequest.model_validate(full())
    assert [wanted.name for wanted in study_of.study(request).controllers] == ["c0", "c1", "c2", "c3", "c4"]
    given_fields = {name for wanted in full()["controllers"] for name in wanted}
    assert given_fields == set(Lqr.model_fields)
