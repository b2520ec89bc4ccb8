"""The server processes: where they may listen, several of them, and how they end."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from service.access.keys import add_key
from service.server import raise_file_limit
from service.store.store import Store
from tests.service.http.running import ROOT, server


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"HOST": "0.0.0.0"}, "keys are required and there are none"),
        ({"HOST": "0.0.0.0", "REQUIRE_KEYS": "false"}, "can be reached from other machines"),
        ({"REQUIRE_KEYS": "true"}, "keys are required and there are none"),
        ({"WORKERS": "0"}, "settings: "),
    ],
)
def test_a_start_that_is_refused(tmp_path: Path, settings: dict[str, str], said: str) -> None:
    environment = os.environ | {f"GAINFIELD_{name}": value for name, value in settings.items()}
    command = [sys.executable, "-m", "service", "--port", "0", "--data-dir", str(tmp_path)]
    ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=60, text=True)
    assert ended.returncode == 1
    assert said in ended.stderr
    assert "Traceback" not in ended.stderr


def test_beyond_this_machine_with_a_key(tmp_path: Path) -> None:
    store = Store(tmp_path)
    new = add_key(store.keys, "ann", "read")
    store.close()
    with server(tmp_path, "--host", "0.0.0.0") as running:
        assert running.get("/v1/designs", **{"X-API-Key": new.token})[0] == 200
        connection = http.client.HTTPConnection("127.0.0.1", running.port, timeout=20)
        connection.request("GET", "/v1/designs")
        assert connection.getresponse().status == 401
        connection.close()
        log = running.log.read_text()
    assert new.token not in log
    assert new.token.rpartition("_")[2] not in log


def test_several_workers(tmp_path: Path, quick: Any) -> None:
    with server(tmp_path, "--workers", "2") as running:
        status, made = running.post("/v1/designs", quick)
        assert status == 201
        ident = json.loads(made)["id"]
        workers, deadline = set(), time.monotonic() + 30
        while len(workers) < 2 and time.monotonic() < deadline:
            assert running.get(f"/v1/designs/{ident}")[1] == made
            text = running.get("/metrics")[1].decode()
            workers |= {part.split('"')[0] for part in text.split('worker="')[1:]}
            assert "gainfield_designs 1.0" in text
        assert len(workers) == 2
        running.process.send_signal(signal.SIGTERM)
        assert running.process.wait(30) == 0
        for pid in workers:
            assert not Path(f"/proc/{pid}").exists()
        assert all(line.startswith("{") for line in running.log.read_text().splitlines())


def test_what_is_under_way_is_answered_before_the_end(tmp_path: Path, wanted: Any) -> None:
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": {"from": 300, "to": 1500, "count": 60}}
    with server(tmp_path, shutdown_timeout_s=30) as running:
        found: list[Any] = []
        thread = threading.Thread(target=lambda: found.append(running.post("/v1/designs", wanted)))
        thread.start()
        under_way = f'gainfield_computations_in_flight{{worker="{running.process.pid}"}} 1.0'
        while under_way not in running.get("/metrics")[1].decode():
            time.sleep(0.01)
        running.process.send_signal(signal.SIGTERM)
        thread.join(60)
        running.process.wait(30)
        assert found[0][0] == 201


def test_a_client_that_stays_does_not_keep_it_from_ending(tmp_path: Path) -> None:
    with server(tmp_path, shutdown_timeout_s=1) as running:
        with running.connect() as idle, running.connect() as half:
            half.sendall(b"POST /v1/designs HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n")
            idle.sendall(b"GET /heal")
            time.sleep(0.2)
            began = time.monotonic()
            running.process.send_signal(signal.SIGTERM)
            running.process.wait(20)
        assert time.monotonic() - began < 6.0


def test_the_file_limit_is_raised_in_a_process_of_its_own() -> None:
    script = (
        "import resource; from service.server import raise_file_limit as r\n"
        "hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]\n"
        "resource.setrlimit(resource.RLIMIT_NOFILE, (400, min(hard, 2000) if hard > 0 else 2000))\n"
        "print(r(500), resource.getrlimit(resource.RLIMIT_NOFILE)[0], r(10_000))\n"
    )
    ended = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, timeout=60, text=True)
    assert ended.stdout.split() == ["500", "756", "1744"], ended.stderr
    assert raise_file_limit(8) == 8
