"""That files and database belong together: swept against another database, all files would be orphans."""

from __future__ import annotations

from sqlalchemy import select

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.tables import identity
from service.wire.refusals import StoreUnavailable


def same_store(database: Database, blobs: Blobs) -> None:
    """Refuse files of another database; files that are nobody's become this one's.

    Raises
    ------
    StoreUnavailable : they belong to another database, or cannot be read
    """
    with database.reading() as connection:
        ours = connection.execute(select(identity.c.id)).scalar_one()
    theirs = blobs.owner() or blobs.become(ours)
    if theirs != ours:
        raise StoreUnavailable(
            "the files in the data directory belong to another database: check the data directory and the address of "
            "the database"
        )
