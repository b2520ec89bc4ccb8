"""What is let go in time, and what is not, on SQLite and on PostgreSQL."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import insert, select, update

from service.jobs.kinds.answer import answer_job, asked
from service.settings import Settings
from service.store.designs import StoredDesign
from service.store.jobs import packed
from service.store.store import Store
from service.store.tables import chunks, designs, jobs, ownerships, repeated
from tests.service.store.test_designs import at_once

Made = Callable[..., StoredDesign]
Age = Callable[[Store, float], None]
Open = Callable[[], Store]
DAY = 86400.0
IDS = [f"{number:032x}" for number in range(6)]


def used(store: Store, ident: str, days_ago: float) -> None:
    with store.database.writing() as connection:
        connection.execute(update(designs).where(designs.c.id == ident).values(used_at=time.time() - days_ago * DAY))


def add_job(store: Store, ident: str, state: str, finished_at: float | None, spec: bytes = b"{}") -> None:
    values = {"id": ident, "owner": "local", "kind": "answer", "state": state, "spec": packed(spec), "created_at": 0.0}
    counts = {"done": 0, "total": 1, "revision": 0, "attempts": 0, "finished_at": finished_at}
    blob = store.blobs.put(b"result of " + ident.encode())
    with store.database.writing() as connection:
        connection.execute(insert(jobs).values(values | counts | {"result_blob": blob}))
        connection.execute(insert(chunks).values(job_id=ident, number=0, result_blob=blob))


def add_repeated(store: Store, key: str, created_at: float) -> None:
    values = {"owner": "local", "key": key, "request_digest": "0" * 64, "created_at": created_at}
    with store.database.writing() as connection:
        connection.execute(insert(repeated).values(values | {"answer_blob": store.blobs.put(key.encode())}))


def there(store: Store) -> set[str]:
    return {design.id for design in store.designs.page(99)}


@pytest.fixture
def six(store: Store, made: Made) -> Store:
    """Six designs of 103 bytes each, the first unused for longest."""
    for number, ident in enumerate(IDS):
        store.designs.add(made(ident, bytes([number]) * 96), "ann")
        store.designs.add(made(ident), "bob")
        used(store, ident, 60 - 10 * number)
    return store


def test_nothing_goes_unless_it_is_asked_for(six: Store, tmp_path: Path, aged: Age) -> None:
    aged(six, 400 * DAY)
    done = six.keep_house(Settings(data_dir=tmp_path), time.time())
    assert done.rows.designs == 0
    assert there(six) == set(IDS)
    # The answers of the second posting were put in vain.
    assert done.files == 1
    assert six.inspect(thorough=True) == ()


def test_unused_designs_go_after_their_time(six: Store, tmp_path: Path, aged: Age) -> None:
    aged(six, 2 * DAY)
    settings = Settings(data_dir=tmp_path, retention_days=35.0)
    assert six.keep_house(settings, time.time()).rows.designs == 3
    assert there(six) == set(IDS[3:])
    with six.database.reading() as connection:
        assert set(connection.scalars(select(ownerships.c.design_id))) == set(IDS[3:])
    assert len(list(six.blobs.digests())) == 3
    assert six.inspect(thorough=True) == ()


def test_what_was_read_lately_stays(six: Store, tmp_path: Path) -> None:
    assert six.designs.get(IDS[0]) is not None
    six.keep_house(Settings(data_dir=tmp_path, retention_days=15.0), time.time())
    assert there(six) == {IDS[0], IDS[5]}


@pytest.mark.parametrize(("most", "left"), [(10_000, 6), (618, 6), (617, 5), (309, 3), (308, 2), (0, 0)])
def test_too_many_bytes_let_the_longest_unused_go(six: Store, tmp_path: Path, most: int, left: int) -> None:
    six.keep_house(Settings(data_dir=tmp_path, max_stored_bytes=most), time.time())
    assert there(six) == set(IDS[6 - left :])


def test_designs_that_jobs_are_about_stay(six: Store, tmp_path: Path) -> None:
    add_job(six, "j1", "running", None, b'{"designs": {"' + IDS[0].encode() + b'": 1}}')
    add_job(six, "j2", "queued", None, b'"/v1/designs/' + IDS[1].encode() + b'/cross-check"')
    add_job(six, "j3", "succeeded", time.time(), IDS[2].encode())
    settings = Settings(data_dir=tmp_path, retention_days=1.0, max_stored_bytes=0)
    six.keep_house(settings, time.time())
    assert there(six) == {IDS[0], IDS[1]}


def test_the_design_of_a_real_job_stays(six: Store, made: Made, tmp_path: Path) -> None:
    """Queued as the routes queue it, whatever its row looks like inside."""
    request = asked("GET", f"/v1/designs/{IDS[0]}/cross-check", "points=0", None)
    job = six.jobs.add(answer_job(request, "f" * 32, {IDS[0]: made(IDS[0])}, {}), 10)
    assert job is not None
    six.keep_house(Settings(data_dir=tmp_path, retention_days=1.0, max_stored_bytes=0), time.time())
    assert there(six) == {IDS[0]}


def test_jobs_that_ended_long_ago_go_with_their_files(store: Store, tmp_path: Path, aged: Age) -> None:
    now = time.time()
    for state in ("queued", "running", "cancelling"):
        add_job(store, state, state, None)
    for state in ("cancelled", "failed", "succeeded"):
        add_job(store, f"old {state}", state, now - 8 * DAY)
        add_job(store, f"new {state}", state, now - 6 * DAY)
    aged(store, 2 * DAY)
    done = store.keep_house(Settings(data_dir=tmp_path), now)
    assert (done.rows.jobs, done.files) == (3, 3)
    with store.database.reading() as connection:
        left = set(connection.scalars(select(jobs.c.id)))
        assert set(connection.scalars(select(chunks.c.job_id))) == left
    assert left == {"queued", "running", "cancelling", "new cancelled", "new failed", "new succeeded"}
    assert store.inspect(thorough=True) == ()


def test_repeated_answers_go_after_a_day(store: Store, tmp_path: Path, aged: Age) -> None:
    now = time.time()
    add_repeated(store, "old", now - 1.01 * DAY)
    add_repeated(store, "new", now - 0.99 * DAY)
    aged(store, 2 * DAY)
    assert store.keep_house(Settings(data_dir=tmp_path), now).rows.repeated == 1
    with store.database.reading() as connection:
        assert list(connection.scalars(select(repeated.c.key))) == ["new"]
    assert [store.blobs.get(digest) for digest in store.blobs.digests()] == [b"new"]


def test_a_file_whose_row_is_not_committed_yet_stays(opened: Open, made: Made, tmp_path: Path) -> None:
    one, other = opened(), opened()
    one.blobs.put(b"answer")
    assert other.keep_house(Settings(data_dir=tmp_path), time.time()).files == 0
    one.designs.add(made("a", b"answer"))
    assert one.designs.get("a") == made("a", b"answer")


def test_several_processes_keep_house_and_post_at_once(opened: Open, made: Made, tmp_path: Path) -> None:
    """Housekeeping races with itself and with posting; what it does not let go is whole."""
    stores = [opened() for _ in range(3)]
    settings = Settings(data_dir=tmp_path, max_stored_bytes=103 * 4)

    def posts() -> None:
        for number in range(30):
            stores[0].designs.add(made(f"{number:032x}", bytes([number]) * 100))

    def keeps(store: Store) -> None:
        for _ in range(6):
            store.keep_house(settings, time.time())

    assert at_once(posts, lambda: keeps(stores[1]), lambda: keeps(stores[2])) == [None] * 3
    stores[0].keep_house(settings, time.time())
    assert there(stores[0]) == {f"{number:032x}" for number in (27, 28, 29)}
    assert stores[0].inspect(thorough=True) == ()
