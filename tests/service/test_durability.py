"""An acknowledged design is there after the server was killed and started again; and designs of other code."""

from __future__ import annotations

import functools
import http.client
import itertools
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import orjson
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.designs import design_id
from service.examples import example
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.store.designs import StoredDesign
from service.store.store import Store

ROOT = Path(__file__).resolve().parents[2]


def free_port() -> int:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


@contextmanager
def server(data_dir: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A server of its own process; its address, once it answers."""
    port = free_port()
    environment = os.environ | {"GAINFIELD_DATA_DIR": str(data_dir), "GAINFIELD_PORT": str(port)}
    process = subprocess.Popen(
        [sys.executable, "-m", "service", "--host", "127.0.0.1"],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    base = f"http://127.0.0.1:{port}"
    try:
        wait_for(base, process)
        yield base, process
    finally:
        process.kill()
        process.wait()


def wait_for(base: str, process: subprocess.Popen[Any]) -> None:
    """Wait until the server of a process answers."""
    deadline = time.monotonic() + 60
    while True:
        try:
            call(base, "/healthz")
            return
        except OSError:
            assert process.poll() is None, "the server stopped"
            assert time.monotonic() < deadline, "the server does not answer"
            time.sleep(0.05)


def call(base: str, path: str, body: Any = None) -> tuple[int, bytes]:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(base + path, data=data, headers={"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=60) as answer:
        return answer.status, answer.read()


def status_of(base: str, path: str, body: Any) -> int:
    try:
        return call(base, path, body)[0]
    except urllib.error.HTTPError as refused:
        with refused:
            return refused.code


#: Imports take most of a start: a process that has them becomes one server after the other.
STARTS = """
import os, sys
import uvicorn
from service.app import create_app
from service.settings import Settings
for port in sys.stdin:
    child = os.fork()
    if child == 0:
        uvicorn.run(create_app(Settings()), port=int(port), log_level="critical")
        os._exit(0)
    print(child, flush=True)
    os.waitpid(child, 0)
"""


def quick_starts(data_dir: Path, times: int) -> Iterator[tuple[str, Callable[[], None]]]:
    """Address of a server of its own process, and what kills it; so many, one after the other."""
    process = subprocess.Popen(
        [sys.executable, "-c", STARTS],
        cwd=ROOT,
        env=os.environ | {"GAINFIELD_DATA_DIR": str(data_dir), "OPENBLAS_NUM_THREADS": "1"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    child = 0
    try:
        for _ in range(times):
            port = free_port()
            process.stdin.write(f"{port}\n")
            process.stdin.flush()
            child = int(process.stdout.readline())
            base = f"http://127.0.0.1:{port}"
            wait_for(base, process)
            yield base, functools.partial(os.kill, child, signal.SIGKILL)
    finally:
        process.kill()
        with suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        process.communicate()


def test_survives_being_killed_again_and_again(tmp_path: Path, quick: Any) -> None:
    """While others write, at random moments: every acknowledged design is there, byte for byte, and nothing torn."""
    moments = random.Random(20_261_123)
    acknowledged: dict[str, bytes] = {}

    def posts(base: str, writer: str) -> None:
        with suppress(OSError, http.client.HTTPException):
            for number in itertools.count():
                _, answered = call(base, "/v1/designs", quick | {"name": f"{writer} {number}"})
                acknowledged[json.loads(answered)["id"]] = answered

    for turn, (base, kill) in enumerate(quick_starts(tmp_path, 10)):
        known = len(acknowledged)
        for ident in moments.sample(sorted(acknowledged), min(known, 5)):
            assert call(base, f"/v1/designs/{ident}") == (200, acknowledged[ident])
        writers = [threading.Thread(target=posts, args=(base, f"{turn} {k}")) for k in range(3)]
        for writer in writers:
            writer.start()
        deadline = time.monotonic() + 20
        while len(acknowledged) < known + 3:
            assert time.monotonic() < deadline, "nothing is acknowledged"
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, 0.2))
        kill()
        for writer in writers:
            writer.join()
    store = Store(tmp_path)
    assert store.findings == ()
    assert store.inspect(thorough=True) == ()
    for ident, answered in acknowledged.items():
        found = store.designs.get(ident)
        assert found is not None
        assert found.answer == answered
    store.close()


def test_survives_kill(tmp_path: Path, wanted: Any) -> None:
    wanted["controllers"] = wanted["controllers"][2:]
    with server(tmp_path) as (base, process):
        status, answered = call(base, "/v1/designs", wanted)
        assert status == 201
        process.send_signal(signal.SIGKILL)
        process.wait()
    ident = json.loads(answered)["id"]
    with server(tmp_path) as (base, _):
        assert call(base, f"/v1/designs/{ident}") == (200, answered)
        assert call(base, "/v1/designs", wanted) == (200, answered)
        # What the stored bytes do not hold is made again from the stored request.
        status, point = call(base, f"/v1/designs/{ident}/points/3")
        assert status == 200
        gains = {g["name"]: g["value"] for g in json.loads(point)["controllers"][0]["gains"]}
        for gain in json.loads(answered)["controllers"][0]["gains"]:
            assert gains[gain["name"]] == gain["values"][0][3]


def test_a_design_of_other_code_is_read_but_not_continued(tmp_path: Path, quick: Any, refused: Any) -> None:
    """Gains that this code does not find again are answered as stored, and never mixed with new figures."""
    request = DesignRequest.model_validate(quick)
    with TestClient(create_app(Settings(data_dir=tmp_path))) as client:
        document = client.post("/v1/designs", json=quick).json()
    document["controllers"][0]["gains"][0]["values"][0][0] *= 1 + 1e-7
    store = Store(tmp_path)
    old = StoredDesign(
        "0" * 32, "old", "2020-01-01T00:00:00.000Z", "0.0.1", orjson.dumps(request.normalised()), orjson.dumps(document)
    )
    store.designs.add(old)
    store.close()
    with TestClient(create_app(Settings(data_dir=tmp_path)), raise_server_exceptions=False) as client:
        assert client.get(f"/v1/designs/{old.id}").content == old.answer
        for path in ("points/0", "controllers/lqr/response?point=0", "schedules/lqr.csv"):
            problem = refused(client.get(f"/v1/designs/{old.id}/{path}"), 409)
            assert problem["code"] == "stale_design"
            assert "0.0.1" in problem["detail"]
        assert client.get(f"/v1/designs/{design_id(request)}/points/0").status_code == 200


@pytest.mark.parametrize("options", [["--port", "99999"], ["--port", "x"], ["--nonsense"]])
def test_wrong_options_are_refused_in_words(options: list[str]) -> None:
    process = subprocess.run(
        [sys.executable, "-m", "service", *options], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert process.returncode != 0
    assert "port" in process.stderr or "nonsense" in process.stderr
    assert "Traceback" not in process.stderr


def test_one_blas_thread_before_numpy() -> None:
    """Importing the entry sets the threads and does not import numpy."""
    code = (
        "import os, sys; import service.__main__;"
        "assert 'numpy' not in sys.modules;"
        "print(os.environ['OPENBLAS_NUM_THREADS'], os.environ['OMP_NUM_THREADS'], os.environ['MKL_NUM_THREADS'])"
    )
    bare = {key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")}
    process = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=bare, capture_output=True, text=True)
    assert process.stdout.split() == ["1", "1", "1"], process.stderr


def test_environment_sets_the_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: Any) -> None:
    monkeypatch.setenv("GAINFIELD_DATA_DIR", str(tmp_path))
    monkeypatch.setenv("GAINFIELD_MAX_GRID_POINTS", "7")
    with TestClient(create_app()) as client:
        limits = {limit["name"]: limit for limit in client.get("/v1/limits").json()["limits"]}
        assert limits["max_grid_points"]["value"] == 7
        assert limits["max_grid_points"]["setting"] == "GAINFIELD_MAX_GRID_POINTS"
        problem = refused(client.post("/v1/designs", json=example("wind_tunnel")), 422)
        assert problem["errors"][0]["allowed"] == "<= 7"
