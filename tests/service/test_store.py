"""The store: what it keeps, in which order, for how many at once, and how durably it is set up."""

from __future__ import annotations

import sqlite3
import threading
from pathlib import Path

import pytest

from service.refusals import StoreUnavailable
from service.store import FILE_NAME, DesignStore, StoredDesign


def made(ident: str, answer: bytes = b"{}") -> StoredDesign:
    return StoredDesign(ident, f"name of {ident}", "2026-01-01T00:00:00.000Z", "1", b'{"a":1}', answer)


def test_write_ahead_and_every_commit_on_the_disk(tmp_path: Path) -> None:
    store = DesignStore(tmp_path / "deep" / "data")
    assert store.pragma("journal_mode") == "wal"
    assert store.pragma("synchronous") == 2  # FULL
    assert (tmp_path / "deep" / "data" / FILE_NAME).exists()
    store.close()


def test_keeps_bytes_across_a_restart(tmp_path: Path) -> None:
    store = DesignStore(tmp_path)
    design = made("a", bytes(range(256)))
    assert store.add(design) is design
    assert store.get("b") is None
    store.close()
    again = DesignStore(tmp_path)
    assert again.get("a") == design
    again.close()


def test_the_first_under_an_id_stays(tmp_path: Path) -> None:
    store = DesignStore(tmp_path)
    first = store.add(made("a", b"first"))
    assert store.add(made("a", b"second")) == first
    assert store.get("a") == first
    store.close()


def test_pages_run_from_new_to_old(tmp_path: Path) -> None:
    store = DesignStore(tmp_path)
    for ident in "abcde":
        store.add(made(ident))
    first = store.page(2)
    second = store.page(2, before=first[-1].seq)
    assert [d.id for d in first + second] == ["e", "d", "c", "b"]
    assert [d.id for d in store.page(9, before=second[-1].seq)] == ["a"]
    assert store.page(9, before=0) == []
    store.close()


def test_many_threads_at_once(tmp_path: Path) -> None:
    store = DesignStore(tmp_path)
    kept: list[StoredDesign] = []

    def work(number: int) -> None:
        for k in range(5):
            kept.append(store.add(made(f"shared {k}", str(number).encode())))
            store.add(made(f"own {number} {k}"))
            assert store.get(f"own {number} {k}") is not None
            store.page(3)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(store.page(100)) == 5 + 8 * 5
    for k in range(5):
        assert len({design.answer for design in kept if design.id == f"shared {k}"}) == 1
    store.close()


def test_two_processes_may_share_the_file(tmp_path: Path) -> None:
    one, other = DesignStore(tmp_path), DesignStore(tmp_path)
    one.add(made("a"))
    assert other.get("a") == made("a")
    other.add(made("b"))
    assert [design.id for design in one.page(9)] == ["b", "a"]
    one.close()
    other.close()


def test_a_store_that_does_not_answer_says_so(tmp_path: Path) -> None:
    store = DesignStore(tmp_path)
    store.close()
    for action in (lambda: store.get("a"), lambda: store.add(made("a")), lambda: store.page(1)):
        with pytest.raises(StoreUnavailable):
            action()


def test_a_failed_write_leaves_the_store_usable(tmp_path: Path) -> None:
    store = DesignStore(tmp_path)
    with pytest.raises(StoreUnavailable):
        store.add(StoredDesign("a", None, "", "", b"", b""))  # type: ignore[arg-type]
    assert store.add(made("a")).id == "a"
    store.close()


def test_refuses_another_layout(tmp_path: Path) -> None:
    DesignStore(tmp_path).close()
    connection = sqlite3.connect(tmp_path / FILE_NAME)
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(StoreUnavailable, match="layout 99"):
        DesignStore(tmp_path)


def test_refuses_a_file_that_is_no_database(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"not a database" * 100)
    with pytest.raises(StoreUnavailable):
        DesignStore(tmp_path)
