"""What every answer carries, and what the log says of it."""

from __future__ import annotations

import json
import logging
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.logs import JsonLines

SECURITY = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "x-frame-options": "DENY",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}


def answers(client: TestClient, design: Any) -> dict[int, Any]:
    """One answer of each status, faults of the server included."""
    found = client.get(f"/v1/designs/{design['id']}")
    same = {"If-None-Match": found.headers["etag"]}
    return {
        response.status_code: response
        for response in (
            found,
            client.get(f"/v1/designs/{design['id']}", headers=same),
            client.get("/v1/nowhere"),
            client.put("/v1/designs"),
            client.post("/v1/designs", content=b"{", headers={"Content-Type": "application/json"}),
            client.post("/v1/designs", content=b"{}"),
            client.post("/v1/designs", json={}),
            client.post("/v1/designs", content=b" " * (2 << 20)),
            client.get("/v1/limits", headers={"Accept": "text/html"}),
        )
    }


def test_every_answer_is_careful(client: TestClient, design: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    found = answers(client, design)
    assert set(found) == {200, 304, 404, 405, 400, 415, 422, 413, 406}
    monkeypatch.setattr("service.routes.meta.listed", lambda settings: 1 / 0)
    found[500] = client.get("/v1/limits")
    assert found[500].status_code == 500
    for status, response in found.items():
        assert {name: response.headers.get(name) for name in SECURITY} == SECURITY, status
        assert response.headers["content-security-policy"] == "default-src 'none'; frame-ancestors 'none'"
        assert (
            response.headers["server-timing"].startswith("total;dur=")
            or "total;dur=" in response.headers["server-timing"]
        )
        assert response.headers["x-request-id"]
        assert not {"server", "access-control-allow-origin"} & set(response.headers), status
        if status >= 400:
            assert response.headers["content-type"] == "application/problem+json"
            assert response.headers["cache-control"] == "no-store"
    assert set(found[405].headers["allow"].split(", ")) <= {"GET", "POST"}


def test_pages_keep_their_own_policy(client: TestClient) -> None:
    page = client.get("/docs")
    assert page.headers.get_list("content-security-policy") == [page.headers["content-security-policy"]]
    assert "script-src 'self'" in page.headers["content-security-policy"]
    assert page.headers["x-content-type-options"] == "nosniff"


def test_no_other_origin_is_let_in(client: TestClient) -> None:
    asked = {"Origin": "http://evil.example", "Access-Control-Request-Method": "POST"}
    for response in (client.options("/v1/designs", headers=asked), client.get("/v1/designs", headers=asked)):
        assert not [name for name in response.headers if name.startswith("access-control")]


def test_headers_of_a_head_are_those_of_the_get(client: TestClient, design: Any) -> None:
    path = f"/v1/designs/{design['id']}"
    got, head = client.get(path).headers, client.head(path)
    assert head.content == b""
    changing = {"x-request-id", "server-timing", "date"}
    assert {n: v for n, v in head.headers.items() if n not in changing} == {
        n: v for n, v in got.items() if n not in changing
    }


@pytest.mark.parametrize("ident", ["a", "A-b_c.d:e/f=", "0" * 128, "00-4bf92f3577b34da6a3ce929d0e0e4736-00"])
def test_a_sane_request_id_is_taken_over(client: TestClient, ident: str) -> None:
    assert client.get("/healthz", headers={"X-Request-Id": ident}).headers["x-request-id"] == ident


@pytest.mark.parametrize("ident", [b"", b"a b", b"a" * 129, b"\xe9", b'{"a":1}', b"<script>", b"a\x00b", b"-a"])
def test_another_request_id_is_replaced(client: TestClient, ident: bytes) -> None:
    given = client.get("/healthz", headers={"X-Request-Id": ident}).headers["x-request-id"]
    assert given.encode() != ident
    assert len(given) == 32


def test_two_request_ids_are_none(client: TestClient) -> None:
    given = client.get("/healthz", headers=[("X-Request-Id", "a"), ("X-Request-Id", "b")]).headers["x-request-id"]
    assert len(given) == 32


def test_the_log_has_a_line_and_no_secret(
    client: TestClient, design: Any, quick: Any, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "gainfield.access")
    headers = {"Authorization": "Basic c2VjcmV0OnNlY3JldA==", "X-Request-Id": "traced"}
    client.get(f"/v1/designs/{design['id']}/controllers/nf/gains?altitude_m=1234.5", headers=headers)
    client.post("/v1/designs", json=quick | {"name": "confidential-wing"})
    client.get("/confidential-path%0d%0aforged")
    lines = [JsonLines().format(record) for record in caplog.records if record.name == "gainfield.access"]
    documents = [json.loads(line) for line in lines]
    assert [document["status"] for document in documents] == [422, 201, 404]
    first = documents[0]
    assert first["route"] == "/v1/designs/{id}/controllers/{name}/gains"
    assert (first["request_id"], first["method"], first["owner"], first["level"]) == ("traced", "GET", "local", "info")
    assert first["ms"] > 0.0
    text = "\n".join(lines)
    assert len(text.splitlines()) == 3
    for secret in ("1234.5", "c2VjcmV0", "confidential", "forged", design["id"]):
        assert secret not in text
    assert documents[1]["route"] == "/v1/designs"


def test_a_line_of_the_log_is_one_line_whatever_it_says() -> None:
    try:
        raise ValueError("two\nlines \u2028 \ud800")
    except ValueError as error:
        record = logging.LogRecord("x", logging.ERROR, "", 0, "of %s", ("a\nb",), (ValueError, error, None))
    line = JsonLines().format(record)
    assert len(line.splitlines()) == 1
    assert "two\nlines" in json.loads(line)["traceback"]
