"""Encoding: numpy by orjson, bit for bit; what JSON does not know becomes null or ``{re, im}``."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import orjson
import pytest
from fastapi.testclient import TestClient

from design.outcome import Outcome
from service.wire.answering import download_headers, encode


def test_doubles_survive_to_the_last_bit() -> None:
    values = np.random.default_rng(1).standard_normal((7, 5)) * 10.0 ** np.arange(-150, 200, 70)
    np.testing.assert_array_equal(np.array(json.loads(encode({"v": values}))["v"]), values)


def test_arrays_of_every_layout() -> None:
    a = np.arange(24.0).reshape(4, 6)
    for view in (a, a.T, a[::2, ::-1], np.asfortranarray(a), np.broadcast_to(a[0], (3, 6)), a[0, 0], np.array(1.5)):
        assert json.loads(encode(view)) == np.asarray(view).tolist()


def test_what_does_not_exist_is_null() -> None:
    values = np.array([1.0, np.nan, np.inf, -np.inf])
    assert json.loads(encode({"a": values, "b": float("nan")})) == {"a": [1.0, None, None, None], "b": None}


def test_complex_numbers() -> None:
    values = np.array([[1 + 2j, complex(np.nan, 0)], [-0.5j, 3.0]])
    one, none, two, three = {"re": 1.0, "im": 2.0}, None, {"re": -0.0, "im": -0.5}, {"re": 3.0, "im": 0.0}
    assert json.loads(encode(values)) == [[one, none], [two, three]]


def test_outcomes_are_their_words() -> None:
    codes = np.array([[Outcome.OK, Outcome.INFEASIBLE]], dtype=object)
    assert json.loads(encode({"o": codes, "r": np.array([None, "why"], dtype=object)})) == {
        "o": [["ok", "infeasible"]],
        "r": [None, "why"],
    }


def test_what_has_no_place_in_an_answer() -> None:
    with pytest.raises(orjson.JSONEncodeError):
        encode({"x": object()})


def test_no_answer_goes_through_the_generic_encoder(
    client: TestClient, design: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With FastAPI's encoder and Starlette's JSON broken, every kind of answer still comes."""
    assert client.get("/openapi.json").status_code == 200

    def broken(*args: Any, **kwargs: Any) -> Any:
        raise AssertionError("the generic encoder was used")

    monkeypatch.setattr("fastapi.routing.jsonable_encoder", broken)
    monkeypatch.setattr("starlette.responses.JSONResponse.render", broken)
    assert client.get("/openapi.json").status_code == 500
    here = f"/v1/designs/{design['id']}"
    for path in (
        here,
        f"{here}/points/0",
        f"{here}/controllers/lqr/actuator-requirements",
        "/v1/designs",
        "/v1/limits",
    ):
        assert client.get(path).status_code == 200
    assert client.post("/v1/designs", json=design["request"]).status_code == 200
    assert client.post("/v1/designs", json={}).status_code == 422
    assert client.get("/nowhere").status_code == 404


def test_safe_file_names() -> None:
    def name(*parts: str) -> str:
        return download_headers(*parts, suffix="csv")["Content-Disposition"]

    assert name("wind_tunnel", "nf") == 'attachment; filename="wind_tunnel_nf.csv"'
    assert name('../../etc/x"; filename=y', "nf") == 'attachment; filename="etc-x-filename-y_nf.csv"'
    assert name("\r\nSet-Cookie: a", "nf") == 'attachment; filename="Set-Cookie-a_nf.csv"'
    assert name("高度", "nf") == 'attachment; filename="design_nf.csv"'
    assert name("x" * 200, "nf") == f'attachment; filename="{"x" * 64}_nf.csv"'
