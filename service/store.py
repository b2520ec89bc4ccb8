"""The store of designs: one SQLite file, write-ahead log, every commit on the disk before it is acknowledged."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.refusals import StoreUnavailable

FILE_NAME = "gainfield.db"
#: Layout of the file; raised with every change of the tables.
LAYOUT = 1
#: How long a write waits for another process's write [s].
PATIENCE = 10.0

_TABLES = """
CREATE TABLE designs (
    seq INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    created_at TEXT NOT NULL,
    version TEXT NOT NULL,
    request BLOB NOT NULL,
    answer BLOB NOT NULL
) STRICT;
"""


@dataclass(frozen=True)
class StoredDesign:
    """A design as it was answered.

    Attributes
    ----------
    id : hash of the canonical request and the code version
    name : as the request gave it
    created_at : when it was made, UTC, ISO 8601
    version : the code that made it
    request : canonical request, JSON
    answer : the design, JSON, byte for byte as the client got it
    """

    id: str
    name: str
    created_at: str
    version: str
    request: bytes
    answer: bytes


@dataclass(frozen=True)
class ListedDesign:
    """A design in a list: what tells it apart, without its bytes. `seq` counts up with time."""

    seq: int
    id: str
    name: str
    created_at: str
    version: str


class DesignStore:
    """Designs by id, and in the order of their making. One connection, one user of it at a time.

    Raises
    ------
    StoreUnavailable : from every method, when the file cannot be read or written
    """

    def __init__(self, data_dir: Path) -> None:
        data_dir.mkdir(parents=True, exist_ok=True)
        self._lock = threading.Lock()
        self._connection = sqlite3.connect(
            data_dir / FILE_NAME, timeout=PATIENCE, isolation_level=None, check_same_thread=False
        )
        try:
            with self._cursor() as cursor:
                cursor.execute("PRAGMA journal_mode = WAL")
                cursor.execute("PRAGMA synchronous = FULL")
                self._lay_out(cursor)
        except StoreUnavailable:
            self.close()
            raise

    def _lay_out(self, cursor: sqlite3.Cursor) -> None:
        cursor.execute("BEGIN IMMEDIATE")
        (layout,) = cursor.execute("PRAGMA user_version").fetchone()
        if layout == 0:
            cursor.execute(_TABLES)
            cursor.execute(f"PRAGMA user_version = {LAYOUT}")
        cursor.execute("COMMIT")
        if layout not in (0, LAYOUT):
            raise StoreUnavailable(f"the store has layout {layout}; this version reads layout {LAYOUT}")

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._connection.close()

    def add(self, design: StoredDesign) -> StoredDesign:
        """Keep a design and return the one that is kept: an earlier one under the same id stays."""
        values = (design.id, design.name, design.created_at, design.version, design.request, design.answer)
        with self._cursor() as cursor:
            cursor.execute(
                "INSERT INTO designs (id, name, created_at, version, request, answer) VALUES (?, ?, ?, ?, ?, ?)"
                " ON CONFLICT (id) DO NOTHING",
                values,
            )
            if cursor.rowcount:
                return design
            return _stored(cursor, design.id) or design

    def get(self, ident: str) -> StoredDesign | None:
        """The design under this id, None when there is none."""
        with self._cursor() as cursor:
            return _stored(cursor, ident)

    def page(self, limit: int, before: int | None = None) -> list[ListedDesign]:
        """At most `limit` designs, newest first, made before the one whose `seq` is given."""
        with self._cursor() as cursor:
            rows = cursor.execute(
                "SELECT seq, id, name, created_at, version FROM designs WHERE seq < ? ORDER BY seq DESC LIMIT ?",
                (before if before is not None else 2**62, limit),
            )
            return [ListedDesign(*row) for row in rows]

    def pragma(self, name: str) -> Any:
        """Value of a setting of the database."""
        with self._cursor() as cursor:
            return cursor.execute(f"PRAGMA {name}").fetchone()[0]

    @contextmanager
    def _cursor(self) -> Iterator[sqlite3.Cursor]:
        with self._lock:
            try:
                cursor = self._connection.cursor()
                yield cursor
            except sqlite3.Error as error:
                if self._connection_open() and self._connection.in_transaction:
                    self._connection.rollback()
                raise StoreUnavailable(f"the store does not answer: {type(error).__name__}") from error

    def _connection_open(self) -> bool:
        try:
            self._connection.total_changes  # noqa: B018  (raises when closed)
        except sqlite3.ProgrammingError:
            return False
        return True


def _stored(cursor: sqlite3.Cursor, ident: str) -> StoredDesign | None:
    row = cursor.execute(
        "SELECT id, name, created_at, version, request, answer FROM designs WHERE id = ?", (ident,)
    ).fetchone()
    return StoredDesign(*row) if row else None
