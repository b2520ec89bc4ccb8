"""A copy of a store that is being written to. To restore it is to start a server on the copy."""

from __future__ import annotations

import os
import secrets
import shutil
from dataclasses import dataclass
from pathlib import Path

from service.store.blobs import Blobs
from service.store.database import FILE_NAME, Database
from service.store.integrity import Finding
from service.store.orphans import referenced
from service.store.store import FILES, Store
from service.wire.refusals import StoreUnavailable


@dataclass(frozen=True)
class Backup:
    """What a backup holds.

    Attributes
    ----------
    database : whether the database is in it; that of PostgreSQL is not: `pg_dump`, run before, takes it
    files, bytes : of answers and other results
    findings : files that are damaged in the store already, and that are not in the backup
    """

    database: bool
    files: int
    bytes: int
    findings: tuple[Finding, ...]


def backup(store: Store, target: Path) -> Backup:
    """Copy one state of the store into a new directory, while others go on writing.

    Files get a second name where `target` is on the same disk, and are copied elsewhere: only on another disk is it
    safe from the loss of this one. Each is read and compared with its digest.

    Of PostgreSQL only the files are copied. Run ``pg_dump`` first, then this: files are written before the rows that
    name them, so every row of the dump finds its files, unless its design was deleted in between.

    Raises
    ------
    FileExistsError : there is something at `target` already
    StoreUnavailable : the store cannot be read, or the copy not be written; nothing is at `target` then
    """
    if target.exists():
        raise FileExistsError(f"{target} exists")
    unfinished = target.with_name(f"{target.name}.unfinished-{secrets.token_hex(4)}")
    try:
        unfinished.mkdir(parents=True)
        done = _copy(store, unfinished)
        os.rename(unfinished, target)
        _to_disk(target.parent)
    except OSError as error:
        raise StoreUnavailable(f"the backup cannot be written: {error.strerror}") from error
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return done


def _copy(store: Store, target: Path) -> Backup:
    files = Blobs(target / FILES)
    # Before the database: a file whose row is deleted while this runs may be gone after.
    taken, _ = _take_over(_named(store.database), store.blobs, files)
    if store.database.embedded:
        store.database.copy_to(target / FILE_NAME)
        _to_disk(target / FILE_NAME)
        copied = Database(target)
        try:
            named = _named(copied)
        finally:
            copied.close()
    else:
        named = _named(store.database)
    more, missing = _take_over(named - set(taken), store.blobs, files)
    for digest in set(taken) - named:
        files.discard(digest, -1.0)
    owner = store.blobs.owner()
    if owner is not None:
        files.become(owner)
    files.settle()
    _to_disk(target)
    sizes = {digest: size for digest, size in (taken | more).items() if digest in named}
    return Backup(store.database.embedded, len(sizes), sum(sizes.values()), missing)


def _named(database: Database) -> set[str]:
    with database.reading() as connection:
        return referenced(connection)


def _take_over(digests: set[str], source: Blobs, target: Blobs) -> tuple[dict[str, int], tuple[Finding, ...]]:
    """Sizes of the files that were taken over, and what is wrong with the others."""
    sizes, wrong = {}, []
    for digest in sorted(digests):
        try:
            sizes[digest] = target.take_over(digest, source)
        except StoreUnavailable as error:
            if source.intact(digest):
                raise
            wrong.append(Finding("file", digest, error.detail))
    return sizes, tuple(wrong)


def _to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
