"""Stores on SQLite and on PostgreSQL: the same tests run on both."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.store.database import bring_up
from service.store.designs import StoredDesign
from service.store.store import Store
from service.store.tables import identity, metadata
from tests.service.store.postgresql import Server, binaries, running

Open = Callable[[], Store]
Made = Callable[..., StoredDesign]


@pytest.fixture(scope="session")
def postgresql(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A PostgreSQL server with a database `store` that has the tables."""
    programs = binaries()
    if programs is None:
        if os.environ.get("CI") == "true":
            pytest.fail("PostgreSQL is not installed (Debian: postgresql)")
        pytest.skip("PostgreSQL is not installed (Debian: postgresql)")
    with running(programs) as server:
        server.execute("CREATE DATABASE store")
        bring_up(tmp_path_factory.mktemp("postgresql"), server.url("store"))
        yield server


@pytest.fixture
def postgresql_url(postgresql: Server) -> str:
    """A database with the tables and nothing in them; the same one for all tests, as making one copies megabytes."""
    emptied = [table.name for table in reversed(metadata.sorted_tables) if table is not identity]
    postgresql.execute("; ".join(f"DELETE FROM {name}" for name in emptied), "store")
    return postgresql.url("store")


@pytest.fixture(params=["sqlite", "postgresql"])
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Open]:
    """Opens the same store again and again, as several processes would; closed at the end."""
    url = request.getfixturevalue("postgresql_url") if request.param == "postgresql" else None
    stores = []

    def one() -> Store:
        stores.append(Store(tmp_path / "data", url))
        return stores[-1]

    yield one
    for store in stores:
        store.close()


@pytest.fixture
def store(opened: Open) -> Store:
    return opened()


@pytest.fixture
def sqlite_store(tmp_path: Path) -> Iterator[Store]:
    store = Store(tmp_path / "data")
    yield store
    store.close()


def a_design(ident: str, answer: bytes = b"{}", parts: bytes | None = None) -> StoredDesign:
    return StoredDesign(ident, f"name of {ident}", "2026-01-01T00:00:00.000Z", "1", b'{"a":1}', answer, parts)


@pytest.fixture
def made() -> Made:
    """Makes a design of few bytes."""
    return a_design


@pytest.fixture
def aged() -> Callable[[Store, float], None]:
    """Makes all files of a store so much older [s]."""

    def age(store: Store, seconds: float) -> None:
        for digest in store.blobs.digests():
            place = store.blobs.place(digest)
            at = place.stat().st_mtime - seconds
            os.utime(place, (at, at))

    return age
