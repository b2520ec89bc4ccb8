"""The runner: the same bytes by any workers, fair turns, cancellation, lost workers, lost leases, failing stores."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import orjson
import pytest

from service.designs import parts_of as pieces
from service.designs import stored_design, synthesised
from service.jobs.executors import Executor
from service.jobs.kinds.answer import answer_job, asked, kept_answer
from service.jobs.kinds.design import design_job
from service.jobs.outcome import Outcome
from service.jobs.runner import ROLE, Runner
from service.jobs.worker import work
from service.schemas.requests import DesignRequest
from service.store.jobs import Job
from service.store.store import Store
from service.wire.refusals import StoreUnavailable

LEASE = 1.0


class ByHand:
    """An executor whose tasks end when the test says so."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self.submitted: list[tuple[bytes, Future[bytes]]] = []
        self.dropped: list[Future[bytes]] = []

    def capacity(self) -> int:
        return self._capacity

    def submit(self, task: bytes) -> Future[bytes]:
        future: Future[bytes] = Future()
        self.submitted.append((task, future))
        return future

    def cancel(self, future: Future[bytes]) -> None:
        self.dropped.append(future)

    def close(self) -> None:
        pass


@contextmanager
def running(store: Store, executor: Executor, most: int = 4) -> Iterator[Runner]:
    runner = Runner(store, lambda: executor, most, LEASE)
    runner.start()
    try:
        yield runner
    finally:
        runner.stop()


def asking(store: Store, wanted: dict[str, Any], owner: str = "local") -> str:
    job = store.jobs.add(design_job(DesignRequest.model_validate(wanted), owner), 99, owner=owner)
    assert job is not None
    return job.id


def answering(store: Store, number: int, owner: str) -> str:
    new = answer_job(asked("GET", f"/v1/atmosphere/{owner}/{number}", "", None), f"{owner}{number}", {}, {})
    job = store.jobs.add(new, 99, owner=owner)
    assert job is not None
    return job.id


def done_of(store: Store, ident: str) -> int:
    job = store.jobs.get(ident)
    assert job is not None
    return job.done


def ended(store: Store, ident: str, waits: Callable[..., Any], seconds: float = 60.0) -> Job:
    def found() -> Job | None:
        job = store.jobs.get(ident)
        return job if job is not None and job.ended else None

    job: Job = waits(found, seconds)
    return job


def test_a_job_makes_the_design_that_is_made_in_line(store: Store, executor: Executor, large: Any, waits: Any) -> None:
    wanted = large(30, "nf", "lqr")
    with running(store, executor):
        job = ended(store, asking(store, wanted), waits)
    assert (job.state, job.done, job.total) == ("succeeded", 3, 3)
    request = DesignRequest.model_validate(wanted)
    here = [synthesised(request, part) for part in pieces(request)]
    ident = (job.result or "").rpartition("/")[2]
    expected, _ = stored_design(ident, request, here, job.created_at)
    assert store.designs.get(ident, "local") == expected


def test_an_answer_has_the_bytes_of_the_route(store: Store, executor: Executor, waits: Any) -> None:
    wanted = asked("GET", "/v1/atmosphere", "altitude_m=0&altitude_m=3000", None)
    store.jobs.add(answer_job(wanted, "air", {}, {}), 9)
    with running(store, executor):
        assert ended(store, "air", waits).state == "succeeded"
    job = store.jobs.get("air")
    assert job is not None
    headers, body = kept_answer(store.jobs.result(job))
    assert headers["content-type"] == "application/json"
    assert orjson.loads(body)["pressure_pa"][0] == pytest.approx(101325.0)


def test_a_running_job_is_cancelled_within_a_second(store: Store, executor: Executor, large: Any, waits: Any) -> None:
    with running(store, executor):
        ident = asking(store, large(1000, "nf"))
        waits(lambda: done_of(store, ident) >= 2, 60.0)
        began = time.monotonic()
        store.jobs.ask_to_cancel(ident)
        assert ended(store, ident, waits).state == "cancelled"
        took = time.monotonic() - began
        after = asking(store, large(2, "pf"))
        assert ended(store, after, waits).state == "succeeded"
    assert took < 1.0
    assert store.jobs.chunks(ident) == {}


def test_a_job_outlives_a_worker_of_the_cluster(store: Store, cluster: Any, large: Any, waits: Any) -> None:
    from service.jobs.dask_cluster import DaskCluster

    executor = DaskCluster(cluster.address, None, None, None)
    try:
        with running(store, executor):
            ident = asking(store, large(300, "nf"))
            waits(lambda: done_of(store, ident) >= 3, 60.0)
            lost = cluster.workers.pop()
            lost.kill()
            lost.wait()
            cluster.workers.append(cluster.add_worker())
            job = ended(store, ident, waits)
    finally:
        executor.close()
    assert (job.state, job.done) == ("succeeded", 13)


def test_owners_take_turns(store: Store, waits: Any) -> None:
    for number in range(6):
        answering(store, number, "ann")
    for owner in ("bob", "eve"):
        answering(store, 0, owner)
    by_hand, order = ByHand(1), []
    with running(store, by_hand, most=3):
        for count in range(1, 9):
            task, future = waits(lambda count=count: by_hand.submitted[count - 1 : count] or None)[0]
            order.append(orjson.loads(task)["task"]["path"].split("/")[3])
            future.set_result(work(task))
    assert sorted(order[:3]) == ["ann", "bob", "eve"]
    assert order[3:] == ["ann"] * 5


def test_a_task_that_kills_its_workers_fails_its_job_alone(store: Store, waits: Any) -> None:
    poison = answering(store, 0, "ann")
    by_hand = ByHand(2)
    with running(store, by_hand):
        for count in range(3):
            waits(lambda count=count: len(by_hand.submitted) > count)
            by_hand.submitted[count][1].set_exception(EOFError())
        job = ended(store, poison, waits)
        good = answering(store, 1, "ann")
        waits(lambda: len(by_hand.submitted) > 3)
        by_hand.submitted[3][1].set_result(Outcome("other code", None, b"").to_bytes())
        other = ended(store, good, waits)
        time.sleep(0.3)
    assert (job.state, orjson.loads(job.error or "{}")["code"]) == ("failed", "worker_lost")
    assert orjson.loads(other.error or "{}")["code"] == "other_code"
    assert len(by_hand.submitted) == 4


def test_nonsense_of_a_worker_or_a_job_stops_nobody_else(store: Store, waits: Any) -> None:
    first, by_hand = answering(store, 0, "ann"), ByHand(1)
    damaged = store.jobs.add(design_job_damaged(), 9, owner="eve")
    assert damaged is not None
    with running(store, by_hand):
        waits(lambda: by_hand.submitted)
        by_hand.submitted[0][1].set_result(b"nonsense")
        assert orjson.loads(ended(store, first, waits).error or "{}")["code"] == "internal_error"
        assert orjson.loads(ended(store, damaged.id, waits).error or "{}")["code"] == "internal_error"


def design_job_damaged() -> Any:
    from service.store.jobs import NewJob

    return NewJob("damaged", "design", b"not compressed", 2)


def test_a_store_that_fails_for_a_while_loses_nothing(
    store: Store, waits: Any, large: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing, failed = threading.Event(), []

    def sometimes(method: Callable[..., Any]) -> Callable[..., Any]:
        def called(*arguments: Any, **named: Any) -> Any:
            if failing.is_set():
                failed.append(method.__name__)
                raise StoreUnavailable("the store does not answer: test")
            return method(*arguments, **named)

        return called

    for name in ("record", "finish", "lease", "claim", "waiting", "cancelling", "chunks", "requeue"):
        monkeypatch.setattr(store.jobs, name, sometimes(getattr(store.jobs, name)))
    by_hand = ByHand(1)
    with running(store, by_hand):
        ident = asking(store, large(30, "nf"))
        for count in range(3):
            task, future = waits(lambda count=count: by_hand.submitted[count : count + 1] or None)[0]
            failing.set()
            future.set_result(work(task))
            before = len(failed)
            waits(lambda before=before: len(failed) >= before + 2)
            failing.clear()
        job = ended(store, ident, waits)
    assert (job.state, job.done, job.attempts) == ("succeeded", 3, 1)
    assert {"record"} <= set(failed)


def test_who_loses_the_lease_stops_and_the_next_goes_on(
    store: Store, tmp_path: Path, waits: Any, large: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second, other = ByHand(1), ByHand(1), Store(tmp_path)
    try:
        with running(store, first):
            ident = asking(store, large(30, "nf"))
            waits(lambda: first.submitted)
            first.submitted[0][1].set_result(work(first.submitted[0][0]))
            waits(lambda: len(first.submitted) == 2)
            # The first runner is held up for longer than its lease, as by a machine that sleeps.
            held, real = threading.Event(), store.jobs.lease

            def stuck(*arguments: Any) -> Any:
                held.wait(20)
                return real(*arguments)

            monkeypatch.setattr(store.jobs, "lease", stuck)
            with running(other, second):
                waits(lambda: second.submitted)
                held.set()
                waits(lambda: first.dropped == [first.submitted[1][1]])
                for count in range(2):
                    task, future = waits(lambda count=count: second.submitted[count : count + 1] or None)[0]
                    future.set_result(work(task))
                job = ended(store, ident, waits)
        assert (job.state, job.attempts) == ("succeeded", 2)
        assert second.submitted[0][0] == first.submitted[1][0]
        assert len(first.submitted) == 2
    finally:
        other.close()


def test_stopping_parks_what_runs(store: Store, waits: Any, large: Any) -> None:
    by_hand = ByHand(1)
    with running(store, by_hand):
        ident = asking(store, large(30, "nf"))
        waits(lambda: by_hand.submitted)
        by_hand.submitted[0][1].set_result(work(by_hand.submitted[0][0]))
        waits(lambda: len(by_hand.submitted) == 2)
    job = store.jobs.get(ident)
    assert job is not None
    assert (job.state, job.done) == ("queued", 1)
    assert store.jobs.lease(ROLE, "another", LEASE) == "taken"
