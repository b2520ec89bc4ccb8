"""The database: SQLite beside the files by default, PostgreSQL by its address."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import SQLAlchemyError

from service.store.engines import postgresql_engine, sqlite_engine
from service.store.migrate import known, migrate, version_here, version_of
from service.wire.refusals import StoreUnavailable

FILE_NAME = "gainfield.db"
#: How long a write waits for another process's write, and any statement for PostgreSQL [s].
PATIENCE = 10.0
#: How long a step of a migration by command may take [s].
_STEPS_PATIENCE = 3600.0
#: Execution options of a transaction that reads; the driver of SQLite has one state a transaction by itself.
_READING = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}


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
        self._engine = _engine(data_dir, url, PATIENCE)
        try:
            with _answered():
                found, wanted = version_of(self._engine), version_here()
                if self.embedded and found != wanted and known(found):
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
            yield connection if self.embedded else connection.execution_options(**_READING)

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that is on the disk when this ends; an error undoes all of it."""
        with _answered(), self._engine.connect().execution_options(writes=True) as connection, connection.begin():
            yield connection

    def copy_to(self, file: Path) -> None:
        """Write one state of a SQLite database into a new file, while others go on writing.

        Raises
        ------
        TypeError : the database is not SQLite
        """
        if not self.embedded:
            raise TypeError("only SQLite is a file that can be copied")
        with _answered():
            # No transaction: SQLite takes a state of the database by itself.
            connection = self._engine.raw_connection()
            try:
                connection.cursor().execute("VACUUM INTO ?", (str(file),)).close()
            except sqlite3.Error as error:
                raise StoreUnavailable(f"the database cannot be copied: {_reason(error)}") from error
            finally:
                connection.close()


def bring_up(data_dir: Path, url: str | None = None) -> str | None:
    """Bring a database to the tables of this code; returns their version.

    Raises
    ------
    StoreUnavailable : it cannot be reached or written, or has tables that this code does not know
    """
    engine = _engine(data_dir, url, _STEPS_PATIENCE)
    try:
        with _answered():
            found, wanted = version_of(engine), version_here()
            if not known(found):
                raise StoreUnavailable(f"the tables have version {found}, which this code does not know")
            if found != wanted:
                migrate(engine)
        return wanted
    finally:
        engine.dispose()


def _engine(data_dir: Path, url: str | None, patience: float) -> Engine:
    if url is not None:
        with _answered():
            return postgresql_engine(url, patience)
    try:
        data_dir.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreUnavailable(f"the data directory cannot be made: {error.strerror}") from error
    return sqlite_engine(data_dir / FILE_NAME, patience)


@contextmanager
def _answered() -> Iterator[None]:
    try:
        yield
    except SQLAlchemyError as error:
        cause = getattr(error, "orig", None) or error
        raise StoreUnavailable(f"the store does not answer: {_reason(cause)}") from error


def _reason(cause: BaseException) -> str:
    """What SQLite says in a word of its own (``SQLITE_FULL``), else the kind of error; never a path or a statement."""
    name = getattr(cause, "sqlite_errorname", None)
    return f"{type(cause).__name__} ({name})" if name else type(cause).__name__
