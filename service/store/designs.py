"""Designs by id, and in the order in which each owner posted them."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, insert, select, update

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.tables import designs, ownerships

#: The owner of everything where no keys are asked for.
LOCAL = "local"
#: A design that was used is marked so at most this often [s]: reading is not writing.
_USED = 3600.0


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
    parts : what its making took long for (`schedules.parts`), to make it again sooner; None when that is nothing
    """

    id: str
    name: str
    created_at: str
    version: str
    request: bytes
    answer: bytes
    parts: bytes | None = None


@dataclass(frozen=True)
class ListedDesign:
    """A design in a list: what tells it apart, without its bytes. `seq` counts up with time."""

    seq: int
    id: str
    name: str
    created_at: str
    version: str


class DesignStore:
    """The designs of a database.

    Where an `owner` may be given, None stands for one who sees everything.

    Raises
    ------
    StoreUnavailable : from every method, when the database or a file cannot be read or written
    """

    def __init__(self, database: Database, blobs: Blobs) -> None:
        self._database = database
        self._blobs = blobs

    def add(self, design: StoredDesign, owner: str = LOCAL) -> StoredDesign:
        """Keep a design for its owner, and return the one that is kept: an earlier one under the same id stays."""
        answer = self._blobs.put(design.answer)
        parts = None if design.parts is None else self._blobs.put(design.parts)
        values = {
            "id": design.id,
            "name": design.name,
            "created_at": design.created_at,
            "version": design.version,
            "request": design.request,
            "answer_blob": answer,
            "parts_blob": parts,
            "bytes": len(design.request) + len(design.answer) + len(design.parts or b""),
            "used_at": time.time(),
        }
        with self._database.writing() as connection:
            before = _row(connection, design.id, None)
            if before is None:
                connection.execute(insert(designs).values(values))
            _own(connection, design.id, owner)
        return design if before is None else self._whole(before)

    def get(self, ident: str, owner: str | None = None) -> StoredDesign | None:
        """The design under this id, None when there is none, or none of this owner's."""
        with self._database.reading() as connection:
            row = _row(connection, ident, owner)
        if row is None:
            return None
        if time.time() - row.used_at > _USED:
            with self._database.writing() as connection:
                connection.execute(update(designs).where(designs.c.id == ident).values(used_at=time.time()))
        return self._whole(row)

    def own(self, ident: str, owner: str) -> StoredDesign | None:
        """The design under this id, which is this owner's from now on; None when there is none."""
        with self._database.writing() as connection:
            row = _row(connection, ident, None)
            if row is None:
                return None
            _own(connection, ident, owner)
        return self._whole(row)

    def page(self, limit: int, before: int | None = None, owner: str | None = None) -> list[ListedDesign]:
        """At most `limit` designs, newest first, posted before the one whose `seq` is given."""
        wanted = (
            select(ownerships.c.seq, designs.c.id, designs.c.name, designs.c.created_at, designs.c.version)
            .join(designs, designs.c.id == ownerships.c.design_id)
            .order_by(ownerships.c.seq.desc())
            .limit(limit)
        )
        if before is not None:
            wanted = wanted.where(ownerships.c.seq < before)
        if owner is not None:
            wanted = wanted.where(ownerships.c.owner == owner)
        with self._database.reading() as connection:
            return [ListedDesign(*row) for row in connection.execute(wanted)]

    def _whole(self, row: Row[Any]) -> StoredDesign:
        parts = None if row.parts_blob is None else self._blobs.get(row.parts_blob)
        answer = self._blobs.get(row.answer_blob)
        return StoredDesign(row.id, row.name, row.created_at, row.version, row.request, answer, parts)


def _row(connection: Connection, ident: str, owner: str | None) -> Row[Any] | None:
    wanted = select(designs).where(designs.c.id == ident)
    if owner is not None:
        wanted = wanted.join(ownerships, ownerships.c.design_id == designs.c.id).where(ownerships.c.owner == owner)
    return connection.execute(wanted).first()


def _own(connection: Connection, ident: str, owner: str) -> None:
    of_this = (ownerships.c.design_id == ident) & (ownerships.c.owner == owner)
    if connection.execute(select(ownerships.c.seq).where(of_this)).first() is None:
        connection.execute(insert(ownerships).values(design_id=ident, owner=owner))
