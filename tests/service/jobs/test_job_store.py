"""Jobs in the database: one for the same work, each step of its life, what dead runners leave, and the lease."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest

from service.store.jobs import NewJob
from service.store.store import Store


def new(ident: str, spec: bytes = b"spec") -> NewJob:
    return NewJob(ident, "answer", spec, 3)


def test_the_same_work_is_one_job_until_it_has_ended(store: Store) -> None:
    jobs = store.jobs
    first = jobs.add(new("a"), 9)
    assert first is not None
    assert (first.state, first.revision, first.done, first.total) == ("queued", 1, 0, 3)
    assert jobs.add(new("a"), 9) == first
    claimed, spec = jobs.claim("local") or (None, b"")
    assert claimed is not None
    assert (claimed.state, claimed.attempts, spec) == ("running", 1, b"spec")
    assert jobs.add(new("a", b"other"), 9) == claimed
    assert jobs.finish("a", 1, "/there", b"result")
    done = jobs.add(new("a"), 9, again=False)
    assert done is not None
    assert (done.state, done.result, done.done) == ("succeeded", "/there", 3)
    assert jobs.result(done) == b"result"
    again = jobs.add(new("a"), 9)
    assert again is not None
    assert (again.state, again.result, again.done, again.started_at) == ("queued", None, 0, None)
    assert again.revision > done.revision


@pytest.mark.parametrize("end", ["failed", "cancelled"])
def test_what_failed_or_was_cancelled_is_queued_again(store: Store, end: str) -> None:
    jobs = store.jobs
    jobs.add(new("a"), 9)
    assert jobs.claim("local")
    assert jobs.record("a", 1, 0, b"chunk")
    if end == "failed":
        assert jobs.fail("a", 1, '{"code": "x"}')
    else:
        asked = jobs.ask_to_cancel("a")
        assert asked is not None
        assert asked.state == "cancelling"
        assert jobs.cancelling() == {"a"}
        assert not jobs.finish("a", 1, "/there")
        assert jobs.cancelled("a", 1)
    ended = jobs.get("a")
    assert ended is not None
    assert (ended.state, ended.error) == (end, '{"code": "x"}' if end == "failed" else None)
    assert jobs.chunks("a") == {}
    again = jobs.add(new("a"), 9, again=False)
    assert again is not None
    assert (again.state, again.error) == ("queued", None)


def test_a_full_queue_takes_no_more_and_counts_only_what_waits(store: Store) -> None:
    jobs = store.jobs
    assert jobs.add(new("a"), 2)
    assert jobs.add(new("b"), 2)
    assert jobs.add(new("c"), 2) is None
    assert jobs.add(new("a"), 2) is not None
    assert jobs.get("c") is None
    assert jobs.claim("local")
    assert jobs.add(new("c"), 2)


def test_owners_see_their_own(store: Store) -> None:
    jobs = store.jobs
    for number in range(5):
        jobs.add(new(f"a{number}"), 99, owner="ann")
        jobs.add(new(f"b{number}"), 99, owner="bob")
    assert jobs.get("a0", "bob") is None
    assert jobs.ask_to_cancel("a0", "bob") is None
    state = jobs.get("a0")
    assert state is not None
    assert state.state == "queued"
    seen, before = [], None
    while page := jobs.page(2, before, "ann"):
        seen += [job.id for job in page]
        before = page[-1].seq
    assert seen == [f"a{number}" for number in (4, 3, 2, 1, 0)]
    assert len(jobs.page(99)) == 10
    assert jobs.waiting() == ["ann", "bob"]
    claimed = jobs.claim("bob")
    assert claimed is not None
    assert claimed[0].id == "b0"
    assert jobs.claim("nobody") is None


def test_finished_tasks_are_kept_once_and_outlive_their_runner(store: Store) -> None:
    jobs = store.jobs
    jobs.add(new("a"), 9)
    assert jobs.claim("local")
    assert jobs.record("a", 1, 1, b"first")
    assert jobs.record("a", 1, 1, b"second")
    assert jobs.record("a", 1, 0, b"zero")
    now = jobs.get("a")
    assert now is not None
    assert now.done == 2
    jobs.requeue()
    waiting = jobs.get("a")
    assert waiting is not None
    assert (waiting.state, waiting.done) == ("queued", 2)
    assert jobs.claim("local")
    assert jobs.chunks("a") == {0: b"zero", 1: b"second"}
    # The runner that is thought dead still lives: it is at an attempt that is over.
    assert not jobs.record("a", 1, 2, b"late")
    assert not jobs.finish("a", 1, "/there")
    assert not jobs.fail("a", 1, "{}")
    assert not jobs.park("a", 1)
    assert jobs.finish("a", 2, "/there")
    assert jobs.chunks("a") == {}


def test_a_damaged_chunk_is_as_one_that_is_not_there(store: Store, tmp_path: Path) -> None:
    store.jobs.add(new("a"), 9)
    store.jobs.claim("local")
    for number in range(3):
        store.jobs.record("a", 1, number, b"chunk %d" % number)
    whole, lost = sorted(path for path in (tmp_path / "files").glob("??/*"))[:2]
    whole.write_bytes(b"other bytes")
    lost.unlink()
    found = store.jobs.chunks("a")
    assert len(found) == 1
    assert all(content == b"chunk %d" % number for number, content in found.items())


def test_requeue_spares_what_is_at_hand_and_ends_what_was_to_be_cancelled(store: Store) -> None:
    jobs = store.jobs
    for ident in "abcd":
        jobs.add(new(ident), 9)
        jobs.claim("local")
    jobs.ask_to_cancel("c")
    jobs.ask_to_cancel("d")
    jobs.requeue({"a", "c"})
    assert {job.id: job.state for job in jobs.page(9)} == {
        "a": "running", "b": "queued", "c": "cancelling", "d": "cancelled",
    }  # fmt: skip


def test_a_waiting_job_is_cancelled_at_once_and_an_ended_one_forgotten(store: Store) -> None:
    jobs = store.jobs
    jobs.add(new("a"), 9)
    jobs.forget("a")
    assert jobs.get("a") is not None
    cancelled = jobs.ask_to_cancel("a")
    assert cancelled is not None
    assert cancelled.state == "cancelled"
    assert jobs.claim("local") is None
    jobs.forget("a")
    assert jobs.get("a") is None
    assert jobs.ask_to_cancel("a") is None


def test_one_holder_at_a_time_has_the_lease(store: Store, tmp_path: Path) -> None:
    jobs = store.jobs
    other = Store(tmp_path)
    try:
        assert jobs.lease("runner", "one", 0.3) == "taken"
        assert other.jobs.lease("runner", "two", 0.3) is None
        assert jobs.lease("runner", "one", 0.3) == "kept"
        time.sleep(0.35)
        assert other.jobs.lease("runner", "two", 30.0) == "taken"
        assert jobs.lease("runner", "one", 0.3) is None
        jobs.release("runner", "one")
        assert jobs.lease("runner", "one", 0.3) is None
        other.jobs.release("runner", "two")
        assert jobs.lease("runner", "one", 0.3) == "taken"
    finally:
        other.close()


def test_many_at_once_take_one_lease_and_make_one_job(store: Store, tmp_path: Path) -> None:
    others = [Store(tmp_path) for _ in range(4)]
    taken, added, start = [], [], threading.Barrier(4)

    def race(one: Store, name: str) -> None:
        start.wait()
        taken.append(one.jobs.lease("runner", name, 30.0))
        added.append(one.jobs.add(new("a"), 9))

    threads = [threading.Thread(target=race, args=(one, str(number))) for number, one in enumerate(others)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one in others:
        one.close()
    assert sorted(map(str, taken)) == ["None"] * 3 + ["taken"]
    assert len({job.seq for job in added if job is not None}) == 1
    assert len(store.jobs.page(9)) == 1
