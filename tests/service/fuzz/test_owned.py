"""With keys required: nothing without one but what is open, and nothing of another owner, however it is asked for."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.access.door import OPEN
from service.access.keys import add_key
from service.app import create_app
from service.settings import Settings
from tests.service.openapi_examples import address, operations

Key = dict[str, str]


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("owned"), require_keys=True)
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client


def key(client: TestClient, name: str, scope: Any = "write") -> Key:
    return {"X-API-Key": add_key(client.app.state.shared.store.keys, name, scope).token}  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def ann(guarded: TestClient) -> Key:
    return key(guarded, "ann")


@pytest.fixture(scope="module")
def bob(guarded: TestClient) -> Key:
    return key(guarded, "bob")


@pytest.fixture(scope="module")
def job(guarded: TestClient, ann: Key) -> dict[str, Any]:
    """A job of ann's that has ended: the models of one point."""
    from service.jobs.example import EXAMPLE_PATH, example_body

    asked = guarded.post(EXAMPLE_PATH, json=example_body(), headers=ann | {"Prefer": "respond-async"})
    assert asked.status_code == 202
    deadline = time.monotonic() + 60.0
    while True:
        document: dict[str, Any] = guarded.get(asked.headers["location"], headers=ann).json()
        if document["finished_at"]:
            assert document["state"] == "succeeded"
            return document
        assert time.monotonic() < deadline
        time.sleep(0.05)


SHOWN = [
    {},
    {"Authorization": b"Bearer"},
    {"Authorization": b"Basic Z2Y6Z2Y="},
    {"X-API-Key": b""},
    {"X-API-Key": b"gf_0123456789abcdef_" + b"0" * 64},
    {"X-API-Key": b"gf_\xd9\xa3"},
    {"Cookie": b"key=1"},
]


def test_no_route_without_a_key_but_the_open_ones(tmp_path: Path) -> None:
    """In every spelling of its path; what is refused is refused before it is looked for, read or computed."""
    # An application of its own: who shows wrong keys is locked out for a while.
    with TestClient(create_app(Settings(data_dir=tmp_path, require_keys=True))) as client:
        routes = list(operations(client.get("/openapi.json").json()))
        for path, method, operation in routes:
            if path in OPEN:
                assert client.request(method, path).status_code == 200
                continue
            url, _ = address(path, operation)
            for spelling in (url, url + "/", "/" + url, url.upper(), url + "?key=1"):
                for verb in (method.upper(), "OPTIONS", "HEAD", "BREW"):
                    response = client.request(verb, f"http://testserver{spelling}", content=b"{")
                    assert response.status_code == 401, (verb, spelling, response.status_code, response.text[:200])
        for shown in SHOWN:
            for path, method, operation in routes:
                if path not in OPEN:
                    response = client.request(method, address(path, operation)[0], headers=shown)
                    assert response.status_code in (401, 429), (method, path, shown, response.text[:200])


def test_a_path_that_only_looks_open_is_not(guarded: TestClient) -> None:
    for path in (
        "/workbench/../v1/designs",
        "/workbench/..%2fv1/designs",
        "/docs-assets/%2e%2e/v1/limits",
        "//v1/limits",
    ):
        response = guarded.get(path)
        assert response.status_code in (401, 404, 429), (path, response.status_code)
        assert b"items" not in response.content


def test_designs_are_nobody_elses(guarded: TestClient, refused: Any, ann: Key, bob: Key, quick: Any) -> None:
    """Every route below a design, reading or not, answers as if there were none."""
    ident = guarded.post("/v1/designs", json=quick, headers=ann).json()["id"]
    other = guarded.post("/v1/designs", json=quick | {"name": "bobs"}, headers=bob).json()["id"]
    tried = 0
    for path, method, operation in operations(guarded.get("/openapi.json").json()):
        if "/designs/{id}" not in path:
            continue
        kept = [
            each | {"example": "lqr"} if each["in"] == "path" and each["name"] in ("name", "controller") else each
            for each in operation.get("parameters", [])
        ]
        url, query = address(path.replace("{id}", ident), operation | {"parameters": kept})
        query.pop("Idempotency-Key", None)
        body = None
        if "requestBody" in operation:
            body = next(iter(operation["requestBody"]["content"]["application/json"]["examples"].values()))["value"]
        for prefer in ({}, {"Prefer": "respond-async"}):
            response = guarded.request(method, url, params=query, json=body, headers=bob | prefer)
            assert response.status_code in (404, 422), (method, url, prefer, response.status_code, response.text[:300])
            assert "wind_tunnel" not in response.text
            tried += 1
    assert tried > 60
    assert guarded.get(f"/v1/designs/{ident}", headers=ann).status_code == 200
    for prefer in ({}, {"Prefer": "respond-async"}):
        refused(guarded.get(f"/v1/designs/{other}/compare?with={ident}", headers=bob | prefer), 404)
    assert guarded.get("/v1/jobs", headers=bob).json()["items"] == []


def test_jobs_are_nobody_elses(guarded: TestClient, refused: Any, ann: Key, bob: Key, job: dict[str, Any]) -> None:
    where = f"/v1/jobs/{job['id']}"
    for path in (where, f"{where}/result", f"{where}/events"):
        mine = refused(guarded.get(path, headers=bob), 404)
        assert mine["detail"].replace(job["id"], "x") == refused(
            guarded.get(path.replace(job["id"], "0" * 32), headers=bob), 404
        )["detail"].replace("0" * 32, "x")
    refused(guarded.delete(where, headers=bob), 404)
    assert guarded.get("/v1/jobs", headers=bob).json()["items"] == []
    assert guarded.get(where, headers=ann).json()["state"] == "succeeded"
    assert guarded.get(f"{where}/result", headers=ann).status_code == 200


def test_repeated_answers_are_nobody_elses(guarded: TestClient, ann: Key, bob: Key, quick: Any) -> None:
    """One key of two owners is two keys, with the same request or another."""
    same = {"Idempotency-Key": "order-1"}
    mine = guarded.post("/v1/designs", json=quick | {"name": "secret of ann"}, headers=ann | same)
    theirs = guarded.post("/v1/designs", json=quick | {"name": "other"}, headers=bob | same)
    assert (mine.status_code, theirs.status_code) == (201, 201)
    assert "idempotency-replayed" not in theirs.headers
    assert b"secret of ann" not in theirs.content


def test_what_is_only_to_be_read_is_only_read(guarded: TestClient, refused: Any, ann: Key) -> None:
    reader = key(guarded, "ann", "read")
    before = guarded.get("/v1/designs", headers=ann).content
    for path, method, operation in operations(guarded.get("/openapi.json").json()):
        if method in ("post", "delete"):
            url, _ = address(path, operation)
            assert refused(guarded.request(method, url, headers=reader), 403)["code"] == "not_allowed"
    assert guarded.get("/v1/designs", headers=ann).content == before


def test_figures_of_all_are_for_administrators(guarded: TestClient, refused: Any, ann: Key) -> None:
    for path in ("/metrics", "/metrics?x=1"):
        refused(guarded.get(path, headers=ann), 403)
        found = guarded.get(path, headers=key(guarded, "boss", "admin"))
        assert found.status_code == 200
        assert ann["X-API-Key"] not in found.text


def test_keys_are_nowhere_in_what_is_kept(guarded: TestClient, ann: Key, caplog: pytest.LogCaptureFixture) -> None:
    secret = ann["X-API-Key"]
    with caplog.at_level("DEBUG", logger="gainfield"), caplog.at_level("CRITICAL", logger="httpx2"):
        for path in ("/v1/designs", f"/{secret}", f"/v1/designs?key={secret}", f"/v1/designs/{secret[:5]}"):
            guarded.get(path, headers=ann)
    said = caplog.text + "".join(
        str(record.__dict__) for record in caplog.records if record.name.startswith("gainfield")
    )
    assert secret not in said
    directory = Path(guarded.app.state.shared.settings.data_dir)  # type: ignore[attr-defined]
    tail = secret.rpartition("_")[2].encode()
    assert not [file for file in directory.rglob("*") if file.is_file() and tail in file.read_bytes()]
