"""Accept: the answer in a form that the client takes, or a refusal before any work; JSON Lines."""

from __future__ import annotations

import json
from typing import Any

import pytest
from fastapi.testclient import TestClient

import service.designs
from service.http.negotiation import preferred

BOTH = ("application/json", "application/jsonl")


@pytest.mark.parametrize(
    ("accept", "best"),
    [
        (None, BOTH[0]),
        ("", BOTH[0]),
        ("*/*", BOTH[0]),
        ("application/*", BOTH[0]),
        ("application/jsonl", BOTH[1]),
        ("application/json;q=0.5, application/jsonl", BOTH[1]),
        ("application/json, application/jsonl;q=0.9", BOTH[0]),
        ("*/*;q=0.1, application/json;q=0", BOTH[1]),
        ("application/json;q=0, application/*;q=0", None),
        ("text/html, */*;q=0.8", BOTH[0]),
        ("text/html", None),
        ("APPLICATION/JSONL", BOTH[1]),
        ("application/json;charset=utf-8", BOTH[0]),
        ("application/jsonl; q=oops, application/json", BOTH[0]),
        ("application/jsonl;q=nan", None),
        ("application/jsonl;q=9, application/json;q=1", BOTH[0]),
        ("garbage", BOTH[0]),
        (",;,;q=1,", BOTH[0]),
        ("application/problem+json", None),
    ],
)
def test_what_is_preferred(accept: str | None, best: str | None) -> None:
    assert preferred(accept, BOTH) == best


@pytest.mark.parametrize("accept", ["text/html", "application/xml", "application/json;q=0", "image/*, text/csv"])
def test_json_that_is_not_taken(
    client: TestClient, refused: Any, quick: Any, accept: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service.designs, "run", lambda study: pytest.fail("it was computed"))
    for response in (
        client.get("/v1/designs", headers={"Accept": accept}),
        client.get("/v1/version", headers={"Accept": accept}),
        client.post("/v1/designs", json=quick | {"name": "not taken"}, headers={"Accept": accept}),
    ):
        problem = refused(response, 406)
        assert problem["code"] == "not_acceptable"
        assert "application/json" in problem["errors"][0]["allowed"]


def test_files_and_counts_have_their_own_types(client: TestClient, refused: Any, design: Any) -> None:
    file = f"/v1/designs/{design['id']}/schedules/nf.csv"
    assert client.get(file, headers={"Accept": "text/csv"}).status_code == 200
    refused(client.get(file, headers={"Accept": "image/png"}), 406)
    assert client.get("/metrics", headers={"Accept": "text/plain"}).status_code == 200
    refused(client.get("/metrics", headers={"Accept": "application/json"}), 406)
    assert client.get("/docs", headers={"Accept": "text/html"}).status_code == 200


def test_the_list_as_lines(client: TestClient, design: Any) -> None:
    lines = client.get("/v1/designs?limit=1", headers={"Accept": "application/jsonl"})
    page = client.get("/v1/designs?limit=1")
    assert lines.headers["content-type"] == "application/jsonl"
    assert [json.loads(line) for line in lines.content.splitlines()] == page.json()["items"]
    assert lines.headers.get("link") == page.headers.get("link")
    assert lines.headers["vary"] == page.headers["vary"] == "Accept"
    assert lines.headers["etag"] != page.headers["etag"]
    again = {"Accept": "application/jsonl", "If-None-Match": lines.headers["etag"]}
    assert client.get("/v1/designs?limit=1", headers=again).status_code == 304


def test_points_as_lines(client: TestClient, refused: Any, design: Any) -> None:
    where = f"/v1/designs/{design['id']}/points"
    response = client.get(where)
    assert response.headers["content-type"] == "application/jsonl"
    lines = response.content.splitlines()
    assert len(lines) == 8
    for index, line in enumerate(lines):
        assert line == client.get(f"{where}/{index}").content
    assert client.get(where, headers={"If-None-Match": response.headers["etag"]}).status_code == 304
    head = client.head(where)
    assert (head.status_code, head.content, head.headers["etag"]) == (200, b"", response.headers["etag"])
    refused(client.get(where, headers={"Accept": "application/json"}), 406)
    refused(client.get(f"/v1/designs/{'0' * 32}/points"), 404)
