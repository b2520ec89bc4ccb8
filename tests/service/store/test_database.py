"""The SQLite file: how durably it is set up, what it is carried over from, and what is refused."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import text

from service.store.blobs import Blobs
from service.store.database import FILE_NAME
from service.store.designs import LOCAL, StoredDesign
from service.store.store import Store
from service.store.tables import metadata
from service.wire.refusals import StoreUnavailable
from tests.service.store.test_designs import at_once

Made = Callable[..., StoredDesign]

#: What the file of a store was before it had numbered steps.
FORMER = """
PRAGMA journal_mode = WAL;
CREATE TABLE designs (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    created_at TEXT NOT NULL,
    version TEXT NOT NULL,
    request BLOB NOT NULL,
    answer BLOB NOT NULL
) STRICT;
PRAGMA user_version = 1;
"""


@pytest.fixture
def former(tmp_path: Path) -> list[StoredDesign]:
    """A store of the former layout, with a gap in its sequence; its designs in the order of their making."""
    connection = sqlite3.connect(tmp_path / FILE_NAME)
    connection.executescript(FORMER)
    designs = [StoredDesign(f"d{k}", f"n{k}", f"t{k}", "0.1", bytes([k]), bytes([k]) * 50_000) for k in range(12)]
    with connection:
        for design in designs:
            values = (design.id, design.name, design.created_at, design.version, design.request, design.answer)
            connection.execute(
                "INSERT INTO designs (id, name, created_at, version, request, answer) VALUES (?,?,?,?,?,?)", values
            )
        connection.execute("DELETE FROM designs WHERE id IN ('d3', 'd11')")
    connection.close()
    return [design for design in designs if design.id not in ("d3", "d11")]


def test_write_ahead_and_every_commit_on_the_disk(tmp_path: Path) -> None:
    store = Store(tmp_path / "deep" / "data")
    with store.database.reading() as connection:
        assert connection.scalar(text("PRAGMA journal_mode")) == "wal"
        assert connection.scalar(text("PRAGMA synchronous")) == 2  # FULL
        assert connection.scalar(text("PRAGMA foreign_keys")) == 1
    assert (tmp_path / "deep" / "data" / FILE_NAME).exists()
    store.close()


def test_the_steps_make_the_tables_that_the_code_knows(store: Store) -> None:
    with store.database.reading() as connection:
        assert compare_metadata(MigrationContext.configure(connection), metadata) == []


def test_the_former_layout_is_carried_over(tmp_path: Path, former: list[StoredDesign], made: Made) -> None:
    store = Store(tmp_path)
    listed = store.designs.page(99, owner=LOCAL)
    assert [design.id for design in listed] == [design.id for design in reversed(former)]
    assert listed[-1].seq == 1
    assert listed[0].seq == 11
    for design in former:
        assert store.designs.get(design.id) == design
    assert store.inspect(thorough=True) == ()
    # What is posted from now on comes after all that ever was, as cursors of clients take for granted.
    store.designs.add(made("new"))
    assert store.designs.page(1)[0].seq > 12 - 1
    store.close()
    again = Store(tmp_path)
    assert len(again.designs.page(99)) == len(former) + 1
    with again.database.reading() as connection:
        assert "designs_before" not in connection.scalars(text("SELECT name FROM sqlite_master")).all()
        assert connection.scalar(text("PRAGMA user_version")) == 2  # the former code refuses this in words
    again.close()


def test_carrying_over_that_fails_changes_nothing(
    tmp_path: Path, former: list[StoredDesign], monkeypatch: pytest.MonkeyPatch
) -> None:
    put, calls = Blobs.put, []

    def failing(self: Blobs, content: bytes) -> str:
        calls.append(content)
        if len(calls) == 5:
            raise StoreUnavailable("a file of the store cannot be written: No space left on device")
        return put(self, content)

    monkeypatch.setattr(Blobs, "put", failing)
    with pytest.raises(StoreUnavailable, match="No space"):
        Store(tmp_path)
    connection = sqlite3.connect(tmp_path / FILE_NAME)
    assert connection.execute("SELECT count(answer) FROM designs").fetchone() == (len(former),)
    assert connection.execute("PRAGMA user_version").fetchone() == (1,)
    connection.close()
    store = Store(tmp_path)
    assert [store.designs.get(design.id) for design in former] == former
    store.close()


def test_several_processes_open_it_at_once(tmp_path: Path, former: list[StoredDesign]) -> None:
    stores = at_once(*(lambda: Store(tmp_path) for _ in range(4)))
    assert all(isinstance(store, Store) for store in stores), stores
    for store in stores:
        assert len(store.designs.page(99)) == len(former)
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


def test_refuses_a_data_directory_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "data").write_bytes(b"")
    with pytest.raises(StoreUnavailable) as refused:
        Store(tmp_path / "data")
    assert str(tmp_path) not in refused.value.detail


def test_a_write_waits_for_another_process_and_reading_does_not(tmp_path: Path, made: Made) -> None:
    one, other = Store(tmp_path), Store(tmp_path)
    one.designs.add(made("a"))
    with one.database.writing() as connection:
        connection.execute(text("DELETE FROM ownerships"))
        assert other.designs.get("a", LOCAL) == made("a")
    assert other.designs.get("a", LOCAL) is None
    one.close()
    other.close()
