"""Designs written out as plain files, for whoever wants to read them without this service."""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
import zipfile
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Protocol

import orjson
from sqlalchemy import Row, select

from service.store.store import Store
from service.store.tables import designs, ownerships
from service.wire.refusals import StoreUnavailable

FORMAT = "gainfield-export-1"
#: No file in an archive carries the time of its writing: the same designs give the same bytes.
_NO_TIME = (1980, 1, 1, 0, 0, 0)


class _Target(Protocol):
    """Where files go."""

    def write(self, name: str, content: bytes) -> None: ...


class _Archive:
    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive

    def write(self, name: str, content: bytes) -> None:
        entry = zipfile.ZipInfo(name, _NO_TIME)
        entry.compress_type = zipfile.ZIP_DEFLATED
        entry.create_system = 3  # the same on every system
        entry.external_attr = 0o644 << 16
        self._archive.writestr(entry, content)


class _Directory:
    def __init__(self, root: Path) -> None:
        self._root = root

    def write(self, name: str, content: bytes) -> None:
        place = self._root / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)


def export(store: Store, target: Path, owner: str | None = None) -> int:
    """Write the designs of an owner (None: all) into a new directory, or archive where `target` ends in ``.zip``.

    ``designs/<id>/request.json`` and ``answer.json`` are the bytes that are stored; ``index.json`` names each with
    its digest. The same designs give the same files, byte for byte. A design whose answer is damaged is in the index
    with the reason.

    Returns
    -------
    How many designs.

    Raises
    ------
    FileExistsError : there is something at `target` already
    StoreUnavailable : the database cannot be read, or the files not be written; nothing is at `target` then
    """
    if target.exists():
        raise FileExistsError(f"{target} exists")
    unfinished = target.with_name(f"{target.name}.unfinished-{secrets.token_hex(4)}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            if target.suffix == ".zip":
                where: _Target = _Archive(stack.enter_context(zipfile.ZipFile(unfinished, "x")))
            else:
                unfinished.mkdir()
                where = _Directory(unfinished)
            count = _write_all(store, owner, where)
        os.rename(unfinished, target)
    except OSError as error:
        raise StoreUnavailable(f"the export cannot be written: {error.strerror}") from error
    finally:
        with suppress(OSError):
            shutil.rmtree(unfinished) if unfinished.is_dir() else unfinished.unlink(missing_ok=True)
    return count


def _write_all(store: Store, owner: str | None, where: _Target) -> int:
    wanted = select(ownerships.c.design_id).distinct()
    if owner is not None:
        wanted = wanted.where(ownerships.c.owner == owner)
    with store.database.reading() as connection:
        idents = list(connection.scalars(wanted))
    entries = []
    for ident in sorted(idents):  # by us: databases differ in what they sort text by
        row = _row(store, ident)
        if row is not None:
            entries.append(_entry(store, row, where))
    where.write("index.json", _json({"format": FORMAT, "designs": entries}))
    return len(entries)


def _row(store: Store, ident: str) -> Row[Any] | None:
    """The row of a design, which does not count as used for being exported."""
    with store.database.reading() as connection:
        return connection.execute(select(designs).where(designs.c.id == ident)).first()


def _entry(store: Store, row: Row[Any], where: _Target) -> dict[str, Any]:
    """What the index says about a design, whose files are written."""
    entry: dict[str, Any] = {"id": row.id, "name": row.name, "created_at": row.created_at, "version": row.version}
    entry |= {"request": _written(f"designs/{row.id}/request.json", row.request, where), "answer": None, "reason": None}
    try:
        entry["answer"] = _written(f"designs/{row.id}/answer.json", store.blobs.get(row.answer_blob), where)
    except StoreUnavailable as error:
        entry["reason"] = error.detail
    return entry


def _written(name: str, content: bytes, where: _Target) -> dict[str, Any]:
    where.write(name, content)
    return {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def _json(document: Any) -> bytes:
    return orjson.dumps(document, option=orjson.OPT_SORT_KEYS | orjson.OPT_INDENT_2)
