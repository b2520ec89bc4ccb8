"""The service over HTTP, in a process of its own: a design that is new to it, and many requests for one that is not."""

from __future__ import annotations

import http.client
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from statistics import median
from threading import Thread
from typing import Any

import numpy as np

from service.examples import example
from tests.benchmarks import peers
from tests.benchmarks.cases import Case
from tests.benchmarks.measure import Row

ROOT = Path(__file__).resolve().parents[2]
#: Connections at the same time, and requests of each.
CONNECTIONS, REQUESTS = 4, 500
#: Median time of a cached design [s], and requests per second.
MEDIAN_GOAL, RATE_GOAL = 0.005, 500.0


@dataclass(frozen=True)
class Load:
    """Requests for a cached design: the median time of one alone [s], and how many a second from all connections."""

    median: float
    rate: float


class Served:
    """A client of the server."""

    def __init__(self, port: int) -> None:
        self._port = port

    def connection(self) -> http.client.HTTPConnection:
        """A connection that stays open."""
        return http.client.HTTPConnection("127.0.0.1", self._port, timeout=60.0)

    def post(self, connection: http.client.HTTPConnection, path: str, body: dict[str, Any]) -> bytes:
        """The answer to a request that the server does not know."""
        connection.request("POST", path, json.dumps(body), {"Content-Type": "application/json"})
        answer = connection.getresponse()
        content = answer.read()
        assert answer.status in (200, 201), content[:300]
        return content


def cold_rows(case: Case, served: Served) -> tuple[Row, Row]:
    """A new design of 25 points, from JSON to JSON: looked at only, and on the disk before it is answered."""
    request = example("wind_tunnel")
    request["grid"] = {
        "altitude_m": np.linspace(0.0, 6000.0, 5).tolist(),
        "dynamic_pressure_pa": np.geomspace(245.0, 1531.25, 5).tolist(),
    }
    request["controllers"] = request["controllers"][2:]
    connection, numbers = served.connection(), count()

    def agree(ours: bytes, theirs: bytes) -> None:
        document = json.loads(ours)
        designed = document.get("design", document)["controllers"][0]
        gains = {gain["name"]: gain["values"] for gain in designed["gains"]}
        K = np.array([point["K"] for point in json.loads(theirs)])
        for i, u in enumerate(("T_t", "T_a")):
            for j, x in enumerate(("dt", "dt_rate", "da", "da_rate", "int_a")):
                np.testing.assert_allclose(np.ravel(gains[f"K_{u}_{x}"]), K[:, i, j], rtol=1e-6, atol=1e-9)

    def theirs() -> bytes:
        return peers.control_whole(case.plant, case.weights, locus=False)

    def looked_at() -> bytes:
        return served.post(connection, "/v1/previews", {"request": request})

    def kept() -> bytes:
        return served.post(connection, "/v1/designs", request | {"name": f"bench {next(numbers)}"})

    peer = "python-control loop"
    return (
        Row("new design over HTTP, looked at", peer, 40.0, looked_at, theirs, agree),
        Row("new design over HTTP, synced to the disk", peer, 20.0, kept, theirs, agree),
    )


def cached_load(served: Served) -> Load:
    """Ask for one design again and again."""
    first = served.connection()
    ident = json.loads(served.post(first, "/v1/designs", example("wind_tunnel") | {"name": "bench, cached"}))["id"]
    alone = _asked(first, ident)
    connections = [served.connection() for _ in range(CONNECTIONS)]
    for each in connections:
        each.connect()
    threads = [Thread(target=_asked, args=(each, ident)) for each in connections]
    start = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    rate = CONNECTIONS * REQUESTS / (time.perf_counter() - start)
    for each in (first, *connections):
        each.close()
    return Load(median(alone), rate)


def _asked(connection: http.client.HTTPConnection, ident: str) -> list[float]:
    times = []
    for _ in range(REQUESTS):
        start = time.perf_counter()
        connection.request("GET", f"/v1/designs/{ident}")
        answer = connection.getresponse()
        content = answer.read()
        times.append(time.perf_counter() - start)
        assert answer.status == 200, content[:300]
    return times


@contextmanager
def served_here() -> Iterator[Served]:
    """The service as `python -m service` runs it, on a free port of this machine."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = int(free.getsockname()[1])
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [sys.executable, "-m", "service", "--port", str(port), "--data-dir", folder],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            _wait_for(port, process)
            yield Served(port)
        finally:
            process.terminate()
            process.wait()


def _wait_for(port: int, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 60.0
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
            return
        except OSError:
            if process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("the service did not start") from None
            time.sleep(0.05)
