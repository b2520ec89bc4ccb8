"""The database: SQLite beside the files by default, PostgreSQL by its address."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.exc import SQLAlchemyError

from service.refusals import StoreUnavailable
from service.store.migrate import known, migrate, version_here, version_of

FILE_NAME = "gainfield.db"
#: How long a write waits for another process's write [s].
PATIENCE = 10.0


class Database:
    """Connections to one database; a transaction that ends without an error is on the disk.

    Parameters
    ----------
    data_dir : where the SQLite file is
    url : of a PostgreSQL database (``postgresql+psycopg://...``); None: SQLite

    Raises
    ------
    StoreUnavailable : from every method, when the database cannot be reached, read or written; when PostgreSQL holds
        tables of another version (SQLite is brought to this one when it is opened)
    """

    def __init__(self, data_dir: Path, url: str | None = None) -> None:
        self.embedded = url is None
        try:
            data_dir.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreUnavailable(f"the data directory cannot be made: {error.strerror}") from error
        self._engine = _sqlite(data_dir / FILE_NAME) if url is None else create_engine(url, pool_pre_ping=True)
        try:
            with _answered():
                found, wanted = version_of(self._engine), version_here()
                if self.embedded and known(found):
                    migrate(self._engine)
                    found = wanted
            if found != wanted:
                raise StoreUnavailable(
                    f"the tables have version {found or 'none'}, this code needs {wanted}: run `gainfield migrate`"
                )
        except StoreUnavailable:
            self.close()
            raise

    @property
    def engine(self) -> Engine:
        """For what is not a transaction: migrations and copies."""
        return self._engine

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that sees one state of the database and changes nothing."""
        with _answered(), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that is on the disk when this ends; an error undoes all of it."""
        with _answered(), self._engine.connect().execution_options(writes=True) as connection, connection.begin():
            yield connection


@contextmanager
def _answered() -> Iterator[None]:
    try:
        yield
    except SQLAlchemyError as error:
        cause = getattr(error, "orig", None) or error
        raise StoreUnavailable(f"the store does not answer: {type(cause).__name__}") from error


def _sqlite(path: Path) -> Engine:
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": PATIENCE, "isolation_level": None})

    @event.listens_for(engine, "connect")
    def prepare(connection: Any, record: Any) -> None:
        for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
            connection.execute(f"PRAGMA {pragma}").close()

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # A write that begins by reading would be refused, not made to wait, when another process wrote in between.
        immediate = connection.get_execution_options().get("writes", False)
        connection.execute(text("BEGIN IMMEDIATE" if immediate else "BEGIN"))

    return engine
