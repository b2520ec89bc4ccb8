"""Workers of this machine and of a cluster: the same bytes, problems instead of exceptions, and lost workers."""

from __future__ import annotations

import dataclasses
import multiprocessing
import time
from typing import Any

import orjson
import pytest

from service.designs import canonical, parts_of
from service.jobs.dask_cluster import check_address
from service.jobs.executors import Executor
from service.jobs.frames import cut, joined
from service.jobs.local_workers import LocalWorkers, WorkerLost
from service.jobs.outcome import Outcome
from service.jobs.worker import task_of, work
from service.schemas.requests import DesignRequest
from service.version import code_version


def tasks_of(wanted: dict[str, Any]) -> list[bytes]:
    request = DesignRequest.model_validate(wanted)
    spec = {"request": canonical(request).decode()}
    return [task_of("design", spec | {"part": dataclasses.asdict(part)}) for part in parts_of(request)]


def test_every_worker_answers_with_the_same_bytes(executor: Executor, large: Any) -> None:
    tasks = tasks_of(large(60, "nf", "pf"))
    futures = [executor.submit(task) for task in tasks]
    here = [work(task) for task in tasks]
    assert len(here) == 6
    assert [future.result(60) for future in futures] == here
    outcomes = [Outcome.from_bytes(content) for content in here]
    assert all(one.version == code_version() and one.problem is None and one.result for one in outcomes)
    assert len({one.result for one in outcomes}) == 6


@pytest.mark.parametrize(
    ("task", "code"),
    [
        (b"not json", "internal_error"),
        (b'{"kind": "none", "task": {}}', "internal_error"),
        (task_of("design", {"request": "{}", "part": {}}), "internal_error"),
        (task_of("answer", {"method": "GET", "path": "/v1/designs/x/points/0", "query": "", "body": None,
                            "designs": {}, "limits": {}}), "not_found"),
        (task_of("answer", {"method": "GET", "path": "/no/such", "query": "", "body": None,
                            "designs": {}, "limits": {}}), "not_found"),
        (task_of("answer", {"method": "POST", "path": "/v1/linear-models", "query": "", "body": "[1e999]",
                            "designs": {}, "limits": {}}), "invalid_request"),
    ],
)  # fmt: skip
def test_a_task_that_cannot_be_done_is_a_problem(task: bytes, code: str) -> None:
    outcome = Outcome.from_bytes(work(task))
    assert outcome.problem is not None
    assert (outcome.problem["code"], outcome.result) == (code, b"")
    assert ".py" not in orjson.dumps(outcome.problem).decode()


def test_a_dropped_task_frees_its_worker_and_leaves_the_others_alone(large: Any) -> None:
    long, short = tasks_of(large(25, "nf"))[0], tasks_of(large(2, "nf"))[0]
    workers = LocalWorkers(2)
    try:
        assert [workers.submit(short).result(60) for _ in range(2)] == [work(short)] * 2
        dropped, kept, waiting = (workers.submit(long) for _ in range(3))
        time.sleep(0.02)
        began = time.monotonic()
        workers.cancel(dropped)
        with pytest.raises(WorkerLost):
            dropped.result(10)
        assert time.monotonic() - began < 1.0
        workers.cancel(waiting)
        assert kept.result(60) == work(long)
        assert workers.submit(short).result(60) == work(short)
    finally:
        workers.close()
    assert not [child for child in multiprocessing.active_children() if child.is_alive()]


def test_a_killed_worker_is_said_to_be_lost_and_replaced(large: Any) -> None:
    (task,) = tasks_of(large(25, "nf"))
    workers = LocalWorkers(1)
    try:
        workers.submit(task).result(60)
        (child,) = multiprocessing.active_children()
        child.kill()
        with pytest.raises(WorkerLost):
            workers.submit(task).result(60)
        assert workers.submit(task).result(60) == work(task)
    finally:
        workers.close()


@pytest.mark.parametrize(
    ("address", "certificates", "insecure", "refused"),
    [
        ("tcp://127.0.0.1:8786", False, False, False),
        ("tcp://localhost:8786", False, False, False),
        ("tcp://[::1]:8786", False, False, False),
        ("tcp://10.0.0.7:8786", False, False, True),
        ("tcp://0.0.0.0:8786", False, False, True),
        ("tcp://localhost.example.org:8786", False, False, True),
        ("tcp://10.0.0.7:8786", False, True, False),
        ("tls://10.0.0.7:8786", True, False, False),
        ("tls://10.0.0.7:8786", False, True, True),
        ("inproc://1", False, True, True),
        ("tcp://127.0.0.1", False, False, True),
        ("127.0.0.1:8786", False, False, True),
    ],
)
def test_an_open_scheduler_elsewhere_is_refused(
    address: str, certificates: bool, insecure: bool, refused: bool
) -> None:
    if refused:
        with pytest.raises(ValueError, match=r"Dask|GAINFIELD"):
            check_address(address, certificates, insecure)
    else:
        check_address(address, certificates, insecure)


def test_pieces_come_back_as_they_were() -> None:
    pieces = [b"", b"x", bytes(300), b"\n"]
    assert cut(joined(pieces)) == pieces
    for damaged in (joined(pieces)[:-1], b"\xff" * 9):
        with pytest.raises(ValueError, match="within a piece"):
            cut(damaged)
