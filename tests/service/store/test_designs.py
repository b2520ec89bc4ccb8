"""The store: what it keeps, in which order, for how many at once, and how durably it is set up."""

from __future__ import annotations

import sqlite3
import threading
from pathlib import Path

import pytest
from sqlalchemy import text

from service.refusals import StoreUnavailable
from service.store.database import FILE_NAME
from service.store.designs import StoredDesign
from service.store.store import Store


def made(ident: str, answer: bytes = b"{}") -> StoredDesign:
    return StoredDesign(ident, f"name of {ident}", "2026-01-01T00:00:00.000Z", "1", b'{"a":1}', answer)


def test_write_ahead_and_every_commit_on_the_disk(tmp_path: Path) -> None:
    store = Store(tmp_path / "deep" / "data")
    with store.database.reading() as connection:
        assert connection.scalar(text("PRAGMA journal_mode")) == "wal"
        assert connection.scalar(text("PRAGMA synchronous")) == 2  # FULL
    assert (tmp_path / "deep" / "data" / FILE_NAME).exists()
    store.close()


def test_keeps_bytes_across_a_restart(tmp_path: Path) -> None:
    store = Store(tmp_path)
    design = made("a", bytes(range(256)))
    assert store.designs.add(design) is design
    assert store.designs.get("b") is None
    store.close()
    again = Store(tmp_path)
    assert again.designs.get("a") == design
    again.close()


def test_the_first_under_an_id_stays(tmp_path: Path) -> None:
    store = Store(tmp_path)
    first = store.designs.add(made("a", b"first"))
    assert store.designs.add(made("a", b"second")) == first
    assert store.designs.get("a") == first
    store.close()


def test_pages_run_from_new_to_old(tmp_path: Path) -> None:
    store = Store(tmp_path)
    for ident in "abcde":
        store.designs.add(made(ident))
    first = store.designs.page(2)
    second = store.designs.page(2, before=first[-1].seq)
    assert [d.id for d in first + second] == ["e", "d", "c", "b"]
    assert [d.id for d in store.designs.page(9, before=second[-1].seq)] == ["a"]
    assert store.designs.page(9, before=0) == []
    store.close()


def test_many_threads_at_once(tmp_path: Path) -> None:
    store = Store(tmp_path)
    kept: list[StoredDesign] = []

    def work(number: int) -> None:
        for k in range(5):
            kept.append(store.designs.add(made(f"shared {k}", str(number).encode())))
            store.designs.add(made(f"own {number} {k}"))
            assert store.designs.get(f"own {number} {k}") is not None
            store.designs.page(3)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(store.designs.page(100)) == 5 + 8 * 5
    for k in range(5):
        assert len({design.answer for design in kept if design.id == f"shared {k}"}) == 1
    store.close()


def test_two_processes_may_share_the_file(tmp_path: Path) -> None:
    one, other = Store(tmp_path), Store(tmp_path)
    one.designs.add(made("a"))
    assert other.designs.get("a") == made("a")
    other.designs.add(made("b"))
    assert [design.id for design in one.designs.page(9)] == ["b", "a"]
    one.close()
    other.close()


def test_a_failed_write_leaves_the_store_usable(tmp_path: Path) -> None:
    store = Store(tmp_path)
    with pytest.raises(StoreUnavailable):
        store.designs.add(StoredDesign("a", None, "", "", b"", b""))  # type: ignore[arg-type]
    assert store.designs.add(made("a")).id == "a"
    store.close()


def test_refuses_another_layout(tmp_path: Path) -> None:
    Store(tmp_path).close()
    connection = sqlite3.connect(tmp_path / FILE_NAME)
    with connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
    connection.close()
    with pytest.raises(StoreUnavailable, match="version 9999"):
        Store(tmp_path)


def test_refuses_a_file_that_is_no_database(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"not a database" * 100)
    with pytest.raises(StoreUnavailable):
        Store(tmp_path)
