"""Work at the same time: bounded, each design made once, and small requests never behind large ones."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

import service.designs
from schedules.run import run
from service.app import create_app
from service.settings import Settings


def test_equal_requests_at_once_are_one_design(tmp_path: Path, quick: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    runs, answers = [], []

    def counted(study: Any) -> Any:
        runs.append(study.name)
        threading.Event().wait(0.1)
        return run(study)

    monkeypatch.setattr(service.designs, "run", counted)
    settings = Settings(data_dir=tmp_path, max_concurrent_designs=4)
    with TestClient(create_app(settings)) as client:
        threads = [
            threading.Thread(target=lambda: answers.append(client.post("/v1/designs", json=quick))) for _ in range(6)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(runs) == 1
    assert len({answer.content for answer in answers}) == 1
    assert sorted(answer.status_code for answer in answers) == [200] * 5 + [201]


def test_heavy_work_is_bounded_and_light_work_goes_on(
    tmp_path: Path, quick: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock, now, most, release = threading.Lock(), [0], [0], threading.Event()

    def slow(study: Any) -> Any:
        with lock:
            now[0] += 1
            most[0] = max(most[0], now[0])
        release.wait(10)
        with lock:
            now[0] -= 1
        return run(study)

    with TestClient(create_app(Settings(data_dir=tmp_path, max_concurrent_designs=2))) as client:
        ready = client.post("/v1/designs", json=quick).json()["id"]
        monkeypatch.setattr(service.designs, "run", slow)
        requests = [quick | {"name": f"heavy {number}"} for number in range(50)]
        threads = [
            threading.Thread(target=lambda body=body: client.post("/v1/designs", json=body)) for body in requests
        ]
        for thread in threads:
            thread.start()
        while now[0] < 2:
            threading.Event().wait(0.01)
        # More requests wait than the server has threads; what needs no computation is still answered.
        assert client.get("/healthz").status_code == 200
        assert client.get(f"/v1/designs/{ready}").status_code == 200
        assert client.get(f"/v1/designs/{ready}/points/0").status_code == 200
        release.set()
        for thread in threads:
            thread.join()
        assert most[0] == 2
        assert len(client.get("/v1/designs?limit=200").json()["items"]) == 51
