"""`DELETE /v1/designs/{id}`: gone for good, and made again when it is posted again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.settings import Settings


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[TestClient]:
    with TestClient(create_app(Settings(data_dir=tmp_path)), raise_server_exceptions=False) as client:
        yield client


def test_deleted_is_gone(alone: TestClient, quick: dict[str, Any], refused: Any) -> None:
    where = alone.post("/v1/designs", json=quick).headers["location"]
    other = alone.post("/v1/designs", json=quick | {"name": "other"})
    assert alone.get(f"{where}/points/0").status_code == 200
    deleted = alone.delete(where)
    assert (deleted.status_code, deleted.content) == (204, b"")
    # Also what was ready in memory.
    for path in ("", "/points/0", "/schedules/lqr.csv"):
        refused(alone.get(where + path), 404)
    refused(alone.delete(where), 404)
    assert [design["id"] for design in alone.get("/v1/designs").json()["items"]] == [other.json()["id"]]
    assert alone.get(other.headers["location"]).content == other.content


def test_posted_again_it_is_new(alone: TestClient, quick: dict[str, Any]) -> None:
    first = alone.post("/v1/designs", json=quick)
    alone.delete(first.headers["location"])
    again = alone.post("/v1/designs", json=quick)
    assert again.status_code == 201
    assert again.json()["id"] == first.json()["id"]
    assert again.json()["controllers"] == first.json()["controllers"]


@pytest.mark.parametrize("ident", ["0" * 32, "%00", "a%00b", "%ff", "x" * 5000, "%27%3B--"])
def test_what_is_not_there(alone: TestClient, refused: Any, ident: str) -> None:
    problem = refused(alone.delete(f"/v1/designs/{ident}"), 404)
    assert problem["code"] == "not_found"


def test_the_document_declares_it(alone: TestClient) -> None:
    operation = alone.get("/openapi.json").json()["paths"]["/v1/designs/{id}"]["delete"]
    assert {"204", "404", "503"} <= set(operation["responses"])
    assert "content" not in operation["responses"]["204"]
