"""Servers that are killed or stopped in the middle of a job: the next one goes on and ends with the same bytes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from service.designs import parts_of, stored_design, synthesised
from service.schemas.requests import DesignRequest

ROOT = Path(__file__).resolve().parents[3]
POINTS = 500


class Server:
    """A server of its own process group."""

    def __init__(self, data_dir: Path, port: int) -> None:
        environment = os.environ | {
            "GAINFIELD_DATA_DIR": str(data_dir), "GAINFIELD_PORT": str(port), "GAINFIELD_JOB_LEASE_S": "1.5",
        }  # fmt: skip
        self.address = f"http://127.0.0.1:{port}"
        self.process = subprocess.Popen(
            [sys.executable, "-m", "service"], cwd=ROOT, env=environment, stderr=subprocess.DEVNULL
        )

    def ask(self, path: str, body: Any = None) -> Any:
        headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.address + path, data, headers)
        with urllib.request.urlopen(request, timeout=20) as answer:
            return json.loads(answer.read())

    def up(self) -> bool:
        try:
            return bool(self.ask("/healthz"))
        except (urllib.error.URLError, OSError):
            return False

    def end(self, number: int) -> float:
        began = time.monotonic()
        self.process.send_signal(number)
        self.process.wait(20)
        return time.monotonic() - began


@contextmanager
def serving(data_dir: Path, waits: Any) -> Iterator[Server]:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
    server = Server(data_dir, port)
    try:
        waits(server.up)
        yield server
    finally:
        server.process.kill()
        server.process.wait()


def children_of(process: int) -> set[int]:
    """All processes below one."""
    tree: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        tree.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    found, below = set(), [process]
    while below:
        below = [child for each in below for child in tree.get(each, [])]
        found.update(below)
    return found


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_a_job_outlives_killed_workers_killed_servers_and_stopped_ones(tmp_path: Path, large: Any, waits: Any) -> None:
    wanted = large(POINTS, "nf", "lqr")
    with serving(tmp_path, waits) as server:
        job = server.ask("/v1/designs", wanted)

        def done(count: int) -> bool:
            now = server.ask(f"/v1/jobs/{job['id']}")
            assert now["state"] in ("queued", "running"), now
            return bool(now["progress"]["done"] >= count)

        waits(lambda: done(2))
        workers = [each for each in children_of(server.process.pid) if children_of(each) == set()]
        os.kill(max(workers), signal.SIGKILL)
        waits(lambda: done(5))
        left = children_of(server.process.pid)
        server.end(signal.SIGKILL)
        waits(lambda: not any(map(alive, left)), 5.0)
    with serving(tmp_path, waits) as server:
        before = server.ask(f"/v1/jobs/{job['id']}")["progress"]["done"]
        assert before >= 5
        waits(lambda: done(before + 3))
        assert server.end(signal.SIGTERM) < 5.0
    with serving(tmp_path, waits) as server:
        parked = server.ask(f"/v1/jobs/{job['id']}")
        assert parked["progress"]["done"] >= before + 3
        ended = waits(lambda: (now := server.ask(f"/v1/jobs/{job['id']}"))["state"] == "succeeded" and now, 60.0)
        with urllib.request.urlopen(server.address + ended["result"], timeout=20) as answer:
            content = answer.read()
        server.end(signal.SIGTERM)
    assert ended["created_at"] == job["created_at"]
    request = DesignRequest.model_validate(wanted)
    pieces = [synthesised(request, part) for part in parts_of(request)]
    undisturbed, _ = stored_design(json.loads(content)["id"], request, pieces, 0.0)
    moment = json.loads(undisturbed.answer)["provenance"]["created_at"]
    assert content.replace(job["created_at"].encode(), moment.encode()) == undisturbed.answer
