"""All that one server keeps, opened together and closed together."""

from __future__ import annotations

import logging
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from service.settings import Settings
from service.store.blobs import Blobs
from service.store.database import Database
from service.store.designs import DesignStore
from service.store.identity import same_store
from service.store.integrity import Finding, findings
from service.store.jobs import JobStore
from service.store.keys import KeyStore
from service.store.orphans import sweep
from service.store.repeated import RepeatedStore
from service.store.retention import Kept, LetGo, let_go
from service.wire.refusals import StoreUnavailable

#: Directory of the content-addressed files, in the data directory.
FILES = "files"
#: Findings that the log names; it counts the others.
_NAMED = 20

log = logging.getLogger("gainfield")


@dataclass(frozen=True)
class HouseKept:
    """What went: rows that are not kept any longer, and files that no row names."""

    rows: LetGo
    files: int


class Store:
    """The database with the files beside it.

    Parameters
    ----------
    data_dir : directory of the files, and of the SQLite database
    url : of a PostgreSQL database, instead of SQLite

    Attributes
    ----------
    findings : what was damaged when the store was opened; what is whole is served all the same

    Raises
    ------
    StoreUnavailable : the database or the directory cannot be opened, or they do not belong together
    """

    def __init__(self, data_dir: Path, url: str | None = None) -> None:
        self.database = Database(data_dir, url)
        try:
            self.blobs = Blobs(data_dir / FILES)
            same_store(self.database, self.blobs)
        except StoreUnavailable:
            self.database.close()
            raise
        self.designs = DesignStore(self.database, self.blobs)
        self.jobs = JobStore(self.database, self.blobs)
        self.keys = KeyStore(self.database)
        self.repeated = RepeatedStore(self.database, self.blobs)
        self.findings = self.inspect()

    def inspect(self, thorough: bool = False) -> tuple[Finding, ...]:
        """What is damaged now, in words, and in the log; `thorough` reads every file."""
        found = findings(self.database, self.blobs, thorough)
        for finding in found[:_NAMED]:
            log.error("the store is damaged: %s %s: %s", finding.subject, finding.name, finding.detail)
        if len(found) > _NAMED:
            log.error("the store is damaged: %d more findings", len(found) - _NAMED)
        return found

    def keep_house(self, settings: Settings, now: float) -> HouseKept:
        """Write which designs were used, let go what is not kept any longer, delete files that no row names.

        To be called now and then; several processes may do so at once.

        Parameters
        ----------
        now : seconds since 1970

        Raises
        ------
        StoreUnavailable : what was done until then stays done
        """
        self.designs.mark_used()
        kept = Kept(settings.retention_days, settings.max_stored_bytes, settings.job_retention_days)
        rows = let_go(self.database, kept, now)
        return HouseKept(rows, sweep(self.database, self.blobs))

    def close(self) -> None:
        """Close the database."""
        with suppress(StoreUnavailable):  # when a design was last used is worth no failure
            self.designs.mark_used()
        self.database.close()
