"""All that one server keeps, opened together and closed together."""

from __future__ import annotations

from pathlib import Path

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.designs import DesignStore

#: Directory of the content-addressed files, in the data directory.
FILES = "files"


class Store:
    """The database with the files beside it.

    Parameters
    ----------
    data_dir : directory of the files, and of the SQLite database
    url : of a PostgreSQL database, instead of SQLite

    Raises
    ------
    StoreUnavailable : the database or the directory cannot be opened
    """

    def __init__(self, data_dir: Path, url: str | None = None) -> None:
        self.database = Database(data_dir, url)
        self.blobs = Blobs(data_dir / FILES)
        self.designs = DesignStore(self.database, self.blobs)

    def close(self) -> None:
        """Close the database."""
        self.database.close()
