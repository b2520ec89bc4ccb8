"""How SQLite and PostgreSQL are connected to: how durably they commit, and how long they may keep a request waiting."""

from __future__ import annotations

import time
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sqlalchemy import Connection, Engine, create_engine, event, make_url, text

from service.wire.refusals import StoreUnavailable

if TYPE_CHECKING:
    import psycopg

#: The one kind of address that is taken.
DRIVER = "postgresql+psycopg"
#: More connections than threads that serve requests: a write that waits for another process must not stop reading.
_SQLITE_CONNECTIONS = 64
#: What is left of the write-ahead log when it has been worked in [bytes].
_LOG_BYTES = 64 << 20


def sqlite_engine(path: Path, patience: float) -> Engine:
    """Connections to a SQLite file; a write waits at most `patience` seconds for another process's."""
    engine = create_engine(
        f"sqlite:///{path}",
        connect_args={"timeout": patience, "isolation_level": None},
        pool_size=_SQLITE_CONNECTIONS,
        pool_timeout=patience,
    )

    @event.listens_for(engine, "connect")
    def prepare(connection: Any, record: Any) -> None:
        wanted = ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON", f"journal_size_limit = {_LOG_BYTES}")
        for pragma in wanted:
            connection.execute(f"PRAGMA {pragma}").close()

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # A write that begins by reading would be refused, not made to wait, when another process wrote in between.
        immediate = connection.get_execution_options().get("writes", False)
        connection.execute(text("BEGIN IMMEDIATE" if immediate else "BEGIN"))

    return engine


def postgresql_engine(url: str, patience: float) -> Engine:
    """Connections to PostgreSQL; no statement is waited for longer than `patience` seconds, be the server deaf or busy.

    Raises
    ------
    StoreUnavailable : the address is of another kind, or psycopg is not installed
    sqlalchemy.exc.ArgumentError : it is no address
    """
    if make_url(url).drivername != DRIVER:
        raise StoreUnavailable(f"the address of the database does not begin with {DRIVER}://")
    try:
        import psycopg
    except ImportError as error:
        raise StoreUnavailable("PostgreSQL needs psycopg: install gainfield[postgres]") from error

    class Impatient(psycopg.Connection[Any]):
        """A connection that is given up when the server says nothing: its own time limits need a server that works."""

        def wait(self, gen: Generator[Any, Any, Any], *options: Any, **named: Any) -> Any:
            try:
                return super().wait(_bounded(gen, patience), *options, **named)
            except _Deaf as error:
                self.close()
                raise psycopg.OperationalError("the server says nothing") from error

    milliseconds = round(1000 * patience)
    limits = ("statement_timeout", "lock_timeout")
    engine = create_engine(
        url,
        pool_pre_ping=True,
        pool_timeout=patience,
        connect_args={
            "connect_timeout": max(2, round(patience)),
            "options": " ".join(f"-c {limit}={milliseconds}" for limit in limits),
        },
    )

    @event.listens_for(engine, "do_connect")
    def connect(dialect: Any, record: Any, positional: Any, named: Any) -> psycopg.Connection[Any]:
        return Impatient.connect(*positional, **named)

    return engine


class _Deaf(Exception):
    """Nothing was heard for as long as one waits."""


def _bounded(operation: Generator[Any, Any, Any], patience: float) -> Generator[Any, Any, Any]:
    """The same exchange with the server, ended when it has taken `patience` seconds and nothing is there to be read."""
    deadline = time.monotonic() + patience
    try:
        wanted = next(operation)
        while True:
            ready = yield wanted
            if not ready and time.monotonic() > deadline:
                operation.close()
                raise _Deaf
            wanted = operation.send(ready)
    except StopIteration as ended:
        return ended.value
