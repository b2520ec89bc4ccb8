"""Perturbed plants as a job: block by block, and to the last byte what is answered in line."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.jobs.kinds.perturbed import PerturbedJobs
from service.settings import Settings

ASYNC = {"Prefer": "respond-async"}


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("perturbed"))
    with TestClient(create_app(settings), raise_server_exceptions=False) as running:
        yield running


@pytest.fixture(scope="module")
def path(here: TestClient, large: Any) -> str:
    ident = here.post("/v1/designs", json=large(20, "nf", "lqr")).json()["id"]
    return f"/v1/designs/{ident}/controllers/nf/robust-performance"


def ended(client: TestClient, job: dict[str, Any]) -> dict[str, Any]:
    deadline = time.monotonic() + 120.0
    while job["state"] in ("queued", "running"):
        assert time.monotonic() < deadline, job
        time.sleep(0.1)
        job = client.get(job["links"]["self"]).json()
    return job


@pytest.mark.parametrize("query", ["?method=monte_carlo&draws=500&seed=7&margins=true", "?method=corners"])
def test_the_same_bytes_as_in_line(here: TestClient, path: str, query: str) -> None:
    started = here.get(path + query, headers=ASYNC)
    assert started.status_code == 202, started.text
    job = ended(here, started.json())
    assert job["state"] == "succeeded", job
    result, in_line = here.get(job["result"]), here.get(path + query)
    assert in_line.status_code == 200
    assert result.content == in_line.content
    assert result.headers["content-type"] == in_line.headers["content-type"]
    if "draws" in query:
        assert job["progress"]["total"] > 2
    assert here.get(path + query, headers=ASYNC).json()["id"] == job["id"]


def test_blocks_in_any_order_by_anybody(here: TestClient, path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tasks alone, worked on here, backwards: nothing but the spec goes in."""
    seen: list[dict[str, Any]] = []
    plan = PerturbedJobs.plan
    monkeypatch.setattr(PerturbedJobs, "plan", lambda self, spec: seen.append(spec) or plan(self, spec))
    query = "?method=monte_carlo&draws=300&seed=1"
    job = ended(here, here.get(path + query, headers=ASYNC).json())
    spec, kind = seen[0], PerturbedJobs()
    tasks = kind.plan(spec)
    assert len(tasks) > 1
    results = [kind.work(task) for task in reversed(tasks)][::-1]
    answer = kind.work(kind.last(spec, results, 0.0))
    assert answer.endswith(here.get(job["result"]).content)


@pytest.mark.parametrize(
    ("query", "status"),
    [("?method=monte_carlo&draws=0", 422), ("?hinge_moment_percent=0&inertia_percent=0", 422), ("?draws=5", 422)],
)
def test_what_is_refused_is_refused_at_once(here: TestClient, path: str, query: str, status: int, refused: Any) -> None:
    refused(here.get(path + query, headers=ASYNC), status)
    refused(here.get(path.replace("/nf/", "/none/") + query.partition("?")[0], headers=ASYNC), 404)
