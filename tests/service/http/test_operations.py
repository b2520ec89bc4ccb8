"""Counts, readiness, and how much may wait."""

from __future__ import annotations

import shutil
import threading
from collections import namedtuple
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy import text

import service.designs
from schedules.run import run
from service.app import create_app
from service.settings import Settings


@pytest.fixture
def own(tmp_path: Path) -> Iterator[TestClient]:
    with TestClient(create_app(Settings(data_dir=tmp_path)), raise_server_exceptions=False) as client:
        yield client


def counted(client: TestClient) -> dict[tuple[str, ...], float]:
    """Samples by name and labels but the process."""
    families = text_string_to_metric_families(client.get("/metrics").text)
    return {
        (sample.name, *(value for name, value in sorted(sample.labels.items()) if name != "worker")): sample.value
        for family in families
        for sample in family.samples
    }


def test_requests_are_counted_by_template(own: TestClient, quick: Any) -> None:
    ident = own.post("/v1/designs", json=quick).json()["id"]
    for path in (f"/v1/designs/{ident}", "/v1/designs/none", "/a", "/b?secret=1", "/v1/examples/x"):
        own.get(path)
    own.head(f"/v1/designs/{ident}")
    own.request("BREW", "/v1/designs")
    found = counted(own)
    requests = "gainfield_requests_total"
    assert found[requests, "GET", "/v1/designs/{id}", "200"] == 1
    assert found[requests, "HEAD", "/v1/designs/{id}", "200"] == 1
    assert found[requests, "GET", "/v1/designs/{id}", "404"] == 1
    assert found[requests, "GET", "(none)", "404"] == 2
    assert found[requests, "other", "/v1/designs", "405"] == 1
    assert found["gainfield_request_seconds_count", "POST", "/v1/designs"] == 1
    assert found["gainfield_requests_in_flight",] == 1  # the one that asks
    assert found["gainfield_designs",] == 1
    assert found["gainfield_design_bytes",] > 1000
    assert found["gainfield_jobs", "queued"] == 0
    assert not [name for name in found if ident in name or "secret" in str(name)]


def test_two_apps_count_for_themselves(own: TestClient, tmp_path: Path) -> None:
    own.get("/v1/limits")
    with TestClient(create_app(Settings(data_dir=tmp_path / "other"))) as other:
        assert not [name for name in counted(other) if "/v1/limits" in name]


def test_ready(own: TestClient) -> None:
    assert own.get("/readyz").json() == {"status": "ready", "checks": ["database", "disk"]}


def test_not_ready_with_tables_of_another_version(own: TestClient, refused: Any) -> None:
    database = own.app.state.shared.store.database  # type: ignore[attr-defined]
    with database.writing() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = 'other'"))
    problem = refused(own.get("/readyz"), 503)
    assert problem["code"] == "not_ready"
    assert [error["pointer"] for error in problem["errors"]] == ["/database"]
    assert own.get("/healthz").status_code == 200


def test_not_ready_without_room(own: TestClient, refused: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(100, 100, 0))
    problem = refused(own.get("/readyz"), 503)
    assert "GAINFIELD_MIN_FREE_BYTES" in problem["errors"][0]["detail"]


def test_not_ready_without_a_directory(own: TestClient, refused: Any, tmp_path: Path) -> None:
    shutil.move(tmp_path, tmp_path.with_name("away"))
    problem = refused(own.get("/readyz"), 503)
    assert "/disk" in [error["pointer"] for error in problem["errors"]]
    assert str(tmp_path) not in str(problem)
    shutil.move(tmp_path.with_name("away"), tmp_path)
    assert own.get("/readyz").status_code == 200


def test_only_so_many_wait_and_light_routes_go_on(
    tmp_path: Path, refused: Any, quick: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, release = threading.Event(), threading.Event()

    def slow(study: Any) -> Any:
        begun.set()
        release.wait(20)
        return run(study)

    settings = Settings(data_dir=tmp_path, max_concurrent_designs=1, max_waiting_designs=2)
    with TestClient(create_app(settings)) as client:
        monkeypatch.setattr(service.designs, "run", slow)
        bodies = [quick | {"name": str(number)} for number in range(3)]
        found: list[Any] = []
        threads = [
            threading.Thread(target=lambda body=body: found.append(client.post("/v1/designs", json=body)))
            for body in bodies
        ]
        for thread in threads:
            thread.start()
        assert begun.wait(20)
        while counted(client)["gainfield_computations_waiting",] < 2:
            threading.Event().wait(0.01)
        assert counted(client)["gainfield_computations_in_flight",] == 1
        response = client.post("/v1/designs", json=quick)
        assert refused(response, 503)["code"] == "overloaded"
        assert int(response.headers["retry-after"]) >= 1
        release.set()
        for thread in threads:
            thread.join()
        assert [one.status_code for one in found] == [201] * 3
        assert any("queue;dur=" in one.headers["server-timing"] for one in found)
        assert counted(client)["gainfield_computations_in_flight",] == 0
