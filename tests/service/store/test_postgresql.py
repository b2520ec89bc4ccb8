"""PostgreSQL that is slow, deaf, stopped, or not what was expected."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from pydantic import SecretStr
from sqlalchemy import text

from service.app import create_app
from service.settings import Settings
from service.store import database
from service.store.database import bring_up
from service.store.designs import StoredDesign
from service.store.migrate import version_here
from service.store.store import Store
from service.wire.refusals import StoreUnavailable
from tests.service.store.postgresql import Server
from tests.service.store.test_designs import at_once

Made = Callable[..., StoredDesign]


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database, "PATIENCE", 1.0)


@pytest.mark.usefixtures("impatient")
def test_a_deaf_server_is_given_up(tmp_path: Path, postgresql: Server, postgresql_url: str, made: Made) -> None:
    store = Store(tmp_path, postgresql_url)
    store.designs.add(made("a"))
    with postgresql.frozen():
        for ask in (lambda: store.designs.get("a"), lambda: store.designs.add(made("b"))):
            begun = time.monotonic()
            with pytest.raises(StoreUnavailable, match="does not answer"):
                ask()
            assert time.monotonic() - begun < 8.0
    assert store.designs.get("a") == made("a")
    assert store.designs.add(made("b")).id == "b"
    store.close()


@pytest.mark.usefixtures("impatient")
def test_a_lock_is_not_waited_for_without_end(tmp_path: Path, postgresql_url: str, made: Made) -> None:
    one, other = Store(tmp_path, postgresql_url), Store(tmp_path, postgresql_url)
    with one.database.writing() as connection:
        connection.execute(text("LOCK TABLE designs IN ACCESS EXCLUSIVE MODE"))
        begun = time.monotonic()
        with pytest.raises(StoreUnavailable):
            other.designs.get("a")
        assert time.monotonic() - begun < 4.0
    assert other.designs.add(made("a")).id == "a"
    one.close()
    other.close()


def test_lost_connections_are_503_and_then_made_again(
    tmp_path: Path, postgresql: Server, postgresql_url: str, quick: object
) -> None:
    settings = Settings(data_dir=tmp_path, database_url=SecretStr(postgresql_url))
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        posted = client.post("/v1/designs", json=quick)
        assert posted.status_code == 201
        where = posted.headers["location"]
        others = (
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> pg_backend_pid() AND usename = 'tests'"
        )
        postgresql.execute(others)
        assert client.get(where).content == posted.content
        postgresql.stop()
        try:
            for answer in (client.get(where), client.post("/v1/designs", json=quick), client.delete(where)):
                assert answer.status_code == 503
                assert answer.json()["code"] == "store_unavailable"
                assert "127.0.0.1" not in answer.text
        finally:
            postgresql.start()
        assert client.get(where).content == posted.content
        assert client.delete(where).status_code == 204


def test_a_connection_lost_in_a_transaction_keeps_nothing(tmp_path: Path, postgresql_url: str, made: Made) -> None:
    store = Store(tmp_path, postgresql_url)

    def lost() -> None:
        with store.database.writing() as connection:
            connection.execute(text("INSERT INTO leases VALUES ('a', 'b', 0)"))
            connection.execute(text("SELECT pg_terminate_backend(pg_backend_pid())"))

    with pytest.raises(StoreUnavailable):
        lost()
    with store.database.reading() as connection:
        assert connection.scalar(text("SELECT count(*) FROM leases")) == 0
    store.close()


def test_a_reading_transaction_sees_one_state_and_cannot_write(tmp_path: Path, postgresql_url: str, made: Made) -> None:
    store = Store(tmp_path, postgresql_url)
    count = text("SELECT count(*) FROM designs")
    with store.database.reading() as connection:
        assert connection.scalar(count) == 0
        store.designs.add(made("a"))
        assert connection.scalar(count) == 0
    with pytest.raises(StoreUnavailable), store.database.reading() as connection:
        connection.execute(text("DELETE FROM designs"))
    assert store.designs.get("a") == made("a")
    store.close()


def test_tables_are_made_by_command_and_not_by_starting(tmp_path: Path, postgresql: Server) -> None:
    postgresql.execute("CREATE DATABASE without_tables")
    url = postgresql.url("without_tables")
    with pytest.raises(StoreUnavailable, match=r"version none.*gainfield migrate"):
        Store(tmp_path, url)
    results = at_once(*(lambda: bring_up(tmp_path, url) for _ in range(3)))
    assert results == [version_here()] * 3
    Store(tmp_path, url).close()
    postgresql.execute("UPDATE alembic_version SET version_num = '9999'", "without_tables")
    with pytest.raises(StoreUnavailable, match="version 9999"):
        Store(tmp_path, url)
    with pytest.raises(StoreUnavailable, match="does not know"):
        bring_up(tmp_path, url)


@pytest.mark.parametrize(
    "url", ["", "nonsense", "sqlite:///x.db", "postgresql://h/d", "postgresql+psycopg://u@127.0.0.1:1/none"]
)
def test_an_address_that_leads_nowhere(tmp_path: Path, url: str) -> None:
    with pytest.raises(StoreUnavailable) as refused:
        Store(tmp_path, url)
    assert "127.0.0.1" not in refused.value.detail


def test_files_of_another_database_are_refused(tmp_path: Path, postgresql_url: str, made: Made) -> None:
    """Swept against a database that is not theirs they would all be deleted."""
    embedded = Store(tmp_path)
    embedded.designs.add(made("a", b"precious"))
    embedded.close()
    with pytest.raises(StoreUnavailable, match="another database"):
        Store(tmp_path, postgresql_url)
    again = Store(tmp_path)
    assert again.designs.get("a") == made("a", b"precious")
    again.close()
