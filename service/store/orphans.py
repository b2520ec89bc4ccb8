"""Files that no row names: they are deleted, unless a row that names them may be about to be committed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from sqlalchemy import Column, Connection, select

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.tables import metadata

#: From putting a file to the commit of the row that names it no more time than this may pass [s].
GRACE = 3600.0
#: Digests asked for in one statement.
_AT_ONCE = 500


def referenced(connection: Connection) -> set[str]:
    """Digests of all files that a row names."""
    return {digest for column in _blob_columns() for digest in connection.scalars(select(column)) if digest is not None}


def discard_unreferenced(database: Database, blobs: Blobs, digests: Iterable[str]) -> int:
    """Delete those of these files that no row names and that were last put more than `GRACE` ago; how many.

    Raises
    ------
    StoreUnavailable
    """
    asked, discarded = sorted(set(digests)), 0
    for start in range(0, len(asked), _AT_ONCE):
        some = asked[start : start + _AT_ONCE]
        with database.reading() as connection:
            named = {
                digest
                for column in _blob_columns()
                for digest in connection.scalars(select(column).where(column.in_(some)))
            }
        discarded += sum(blobs.discard(digest, GRACE) for digest in some if digest not in named)
    return discarded


def sweep(database: Database, blobs: Blobs) -> int:
    """Delete all files that no row names, and what was left half written, when older than `GRACE`; how many.

    Raises
    ------
    StoreUnavailable
    """
    with database.reading() as connection:
        named = referenced(connection)
    orphans = [digest for digest in blobs.digests() if digest not in named]
    return discard_unreferenced(database, blobs, orphans) + blobs.sweep_unfinished(GRACE)


def _blob_columns() -> Iterator[Column[str]]:
    for table in metadata.sorted_tables:
        for column in table.columns:
            if column.name.endswith("_blob"):
                yield column
