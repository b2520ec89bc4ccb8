"""Executors of both sorts, a Dask cluster of this machine, and a store with jobs."""

from __future__ import annotations

import copy
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from service.examples import example
from service.jobs.dask_cluster import DaskCluster
from service.jobs.executors import Executor
from service.jobs.local_workers import LocalWorkers
from service.store.store import Store

ROOT = Path(__file__).resolve().parents[3]


def eventually(condition: Callable[[], Any], seconds: float = 30.0) -> Any:
    """What `condition` answers as soon as it is true."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.02)
    return found


@pytest.fixture(scope="session")
def waits() -> Callable[..., Any]:
    return eventually


def spread(points: int, *controllers: str) -> dict[str, Any]:
    """The request of the first example with these of its controllers at so many points."""
    wanted = copy.deepcopy(example("wind_tunnel"))
    wanted["name"] = f"{points} points"
    wanted["grid"] = {
        "altitude_m": [0.0], "dynamic_pressure_pa": {"from": 245.0, "to": 1531.25, "count": points},
    }  # fmt: skip
    wanted["controllers"] = [one for one in wanted["controllers"] if one["name"] in controllers]
    return wanted


@pytest.fixture(scope="session")
def large() -> Callable[..., dict[str, Any]]:
    return spread


class Cluster:
    """A scheduler and two workers, each a process."""

    def __init__(self, directory: Path) -> None:
        with socket.socket() as sock:
            sock.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{sock.getsockname()[1]}"
        self._directory = directory
        port = self.address.rpartition(":")[2]
        self._processes = [self._start("dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")]
        self.workers = [self.add_worker(), self.add_worker()]

    def add_worker(self) -> subprocess.Popen[bytes]:
        return self._start("dask_worker", self.address, "--no-nanny", "--nthreads", "1", "--no-dashboard")

    def _start(self, module: str, *arguments: str) -> subprocess.Popen[bytes]:
        environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments]
        return subprocess.Popen(command, cwd=self._directory, env=environment, stderr=subprocess.DEVNULL)

    def close(self) -> None:
        for process in (*self.workers, *self._processes):
            process.kill()
            process.wait()


@pytest.fixture(scope="session")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    found = Cluster(tmp_path_factory.mktemp("dask"))
    try:
        yield found
    finally:
        found.close()


def connected(address: str, workers: int = 2) -> DaskCluster:
    """The cluster, once it has its workers."""

    def ready() -> DaskCluster | None:
        try:
            there = DaskCluster(address, None, None, None)
        except OSError:
            return None
        if there.capacity() >= 2 * workers:
            return there
        there.close()
        return None

    found: DaskCluster = eventually(ready, 90.0)
    return found


@pytest.fixture(params=["local", "dask"])
def executor(request: pytest.FixtureRequest) -> Iterator[Executor]:
    """Two workers: processes of this one, or a cluster's."""
    if request.param == "local":
        found: Executor = LocalWorkers(2)
    else:
        found = connected(request.getfixturevalue("cluster").address)
    try:
        yield found
    finally:
        found.close()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    found = Store(tmp_path)
    try:
        yield found
    finally:
        found.close()
