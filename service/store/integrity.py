"""Whether what the database says is there is there, and whole. What is damaged is told, and left as it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sqlalchemy import exists, select, text

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.orphans import referenced
from service.store.tables import designs, ownerships
from service.wire.refusals import StoreUnavailable


@dataclass(frozen=True)
class Finding:
    """Something that is not as it was written.

    Attributes
    ----------
    subject : `database`; `file`; or `design`, one that nobody owns
    name : digest of the file, id of the design; empty for the database
    detail : what is wrong with it
    """

    subject: Literal["database", "file", "design"]
    name: str
    detail: str


def findings(database: Database, blobs: Blobs, thorough: bool = False) -> tuple[Finding, ...]:
    """What is damaged: pages of a SQLite file, files that are named and missing, designs of nobody.

    Parameters
    ----------
    thorough : read every file that is named and compare its digest, and check indices; takes as long as reading it all
    """
    try:
        return (*_of_pages(database, thorough), *_of_rows(database), *_of_files(database, blobs, thorough))
    except StoreUnavailable as error:
        return (Finding("database", "", error.detail),)


def _of_pages(database: Database, thorough: bool) -> list[Finding]:
    """What SQLite says about its file; PostgreSQL has tools of its own (`pg_amcheck`)."""
    if not database.embedded:
        return []
    check = "PRAGMA integrity_check" if thorough else "PRAGMA quick_check"
    with database.reading() as connection:
        said = [str(line) for line in connection.scalars(text(check))]
    return [Finding("database", "", line) for line in said if line != "ok"]


def _of_rows(database: Database) -> list[Finding]:
    owned = exists().where(ownerships.c.design_id == designs.c.id)
    with database.reading() as connection:
        return [
            Finding("design", ident, "nobody owns it")
            for ident in connection.scalars(select(designs.c.id).where(~owned).order_by(designs.c.id))
        ]


def _of_files(database: Database, blobs: Blobs, thorough: bool) -> list[Finding]:
    with database.reading() as connection:
        named = referenced(connection)
    there = set(blobs.digests())
    found = {digest: Finding("file", digest, "it is missing") for digest in named - there}
    if thorough:
        for digest in named & there:
            try:
                blobs.get(digest)
            except StoreUnavailable as error:
                found[digest] = Finding("file", digest, error.detail)
    # What was deleted together with its row since the rows were read is no damage.
    with database.reading() as connection:
        still = referenced(connection) if found else set()
    return [found[digest] for digest in sorted(found) if digest in still]
