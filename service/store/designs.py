"""Designs by id, and in the order in which each owner posted them."""

from __future__ import annotations

import logging
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, Select, bindparam, delete, exists, select, update

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.insertion import insert_if_new
from service.store.orphans import discard_unreferenced
from service.store.tables import designs, ownerships
from service.wire.refusals import StoreUnavailable

#: The owner of everything where no keys are asked for.
LOCAL = "local"
#: A design that was used is marked so at most this often [s].
_USED = 3600.0
#: Marks kept in memory until they are written; beyond them designs count as used a little less lately.
_MARKS = 100_000
#: How often a design is inserted anew that others delete while it is given an owner.
_TRIES = 10

log = logging.getLogger("gainfield")


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

    Where an `owner` may be given, None stands for one who sees everything. Reading never writes: which designs were
    used is remembered, and written by `mark_used`.

    Raises
    ------
    StoreUnavailable : from every method, when the database or a file cannot be read or written
    """

    def __init__(self, database: Database, blobs: Blobs) -> None:
        self._database = database
        self._blobs = blobs
        self._used: dict[str, float] = {}
        self._lock = threading.Lock()

    def add(self, design: StoredDesign, owner: str = LOCAL) -> StoredDesign:
        """Keep a design for its owner, and return the one that is kept: an earlier one under the same id stays."""
        values = {
            "id": design.id,
            # PostgreSQL takes every character but this one.
            "name": design.name.replace("\0", "\N{SYMBOL FOR NULL}"),
            "created_at": design.created_at,
            "version": design.version,
            "request": design.request,
            "answer_blob": self._blobs.put(design.answer),
            "parts_blob": None if design.parts is None else self._blobs.put(design.parts),
            "bytes": len(design.request) + len(design.answer) + len(design.parts or b""),
            "used_at": time.time(),
        }
        with self._database.writing() as connection:
            row, new = _inserted(connection, values)
            insert_if_new(connection, ownerships, design_id=design.id, owner=owner)
            if not new:
                _mark(connection, {design.id: time.time()})
        return design if new else self._whole(row)

    def get(self, ident: str, owner: str | None = None) -> StoredDesign | None:
        """The design under this id, None when there is none, or none of this owner's."""
        row = self._row(ident, owner)
        return None if row is None else self._whole(row)

    def own(self, ident: str, owner: str) -> StoredDesign | None:
        """The design under this id, which is this owner's from now on; None when there is none."""
        row = self._row(ident, owner)
        if row is None and self._row(ident, None) is not None:
            with self._database.writing() as connection:
                row = connection.execute(_kept(ident)).first()
                if row is not None:
                    insert_if_new(connection, ownerships, design_id=ident, owner=owner)
        return None if row is None else self._whole(row)

    def delete(self, ident: str, owner: str | None = None) -> bool:
        """Take a design from this owner, and forget it when it has no other; False when it was not there.

        Its files go too, at the latest with the first sweep after `orphans.GRACE`.
        """
        if not ident.isprintable():
            return False
        with self._database.writing() as connection:
            row = connection.execute(select(designs).where(designs.c.id == ident).with_for_update()).first()
            if row is None:
                return False
            theirs = ownerships.c.design_id == ident
            let_go = delete(ownerships).where(theirs if owner is None else theirs & (ownerships.c.owner == owner))
            if connection.execute(let_go).rowcount == 0 and owner is not None:
                return False
            if connection.execute(select(ownerships.c.seq).where(theirs)).first() is not None:
                return True
            connection.execute(delete(designs).where(designs.c.id == ident))
        with suppress(StoreUnavailable):  # the design is gone; a file that stays is found by the sweep
            discard_unreferenced(self._database, self._blobs, {row.answer_blob, row.parts_blob} - {None})
        return True

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
        else:
            other = ownerships.alias()
            wanted = wanted.where(
                ~exists().where(other.c.design_id == ownerships.c.design_id, other.c.seq < ownerships.c.seq)
            )
        with self._database.reading() as connection:
            return [ListedDesign(*row) for row in connection.execute(wanted)]

    def mark_used(self) -> None:
        """Write down which designs were used since the last time."""
        with self._lock:
            used, self._used = self._used, {}
        if used:
            with self._database.writing() as connection:
                _mark(connection, used)

    def _row(self, ident: str, owner: str | None) -> Row[Any] | None:
        """The row of a design that is read, which counts as used."""
        if not ident.isprintable():  # no id; and not every database takes it as text
            return None
        wanted = select(designs).where(designs.c.id == ident)
        if owner is not None:
            wanted = wanted.join(ownerships, ownerships.c.design_id == designs.c.id).where(ownerships.c.owner == owner)
        with self._database.reading() as connection:
            row = connection.execute(wanted).first()
        now = time.time()
        if row is not None and now - row.used_at > _USED:
            with self._lock:
                if len(self._used) < _MARKS:
                    self._used[ident] = now
        return row

    def _whole(self, row: Row[Any]) -> StoredDesign:
        answer = self._blobs.get(row.answer_blob)
        parts = self._parts(row)
        return StoredDesign(row.id, row.name, row.created_at, row.version, row.request, answer, parts)

    def _parts(self, row: Row[Any]) -> bytes | None:
        if row.parts_blob is None:
            return None
        try:
            return self._blobs.get(row.parts_blob)
        except StoreUnavailable as error:
            # They only save time: without them the design is made again from its request.
            log.error("the parts of design %s are lost: %s", row.id, error.detail)
            return None


def _kept(ident: str) -> Select[Any]:
    """The row of a design, which nobody deletes until the transaction is over."""
    return select(designs).where(designs.c.id == ident).with_for_update(read=True, key_share=True)


def _inserted(connection: Connection, values: dict[str, Any]) -> tuple[Row[Any], bool]:
    """The row that is kept under the id of these values, not to be deleted meanwhile, and whether it is new."""
    for _ in range(_TRIES):
        new = insert_if_new(connection, designs, **values)
        row = connection.execute(_kept(values["id"])).first()
        if row is not None:
            return row, new
    raise StoreUnavailable("the design is being deleted while it is kept")


def _mark(connection: Connection, used: dict[str, float]) -> None:
    """Write when designs were used; in the order of their ids, so that two processes do not wait for each other."""
    later = (
        update(designs)
        .where(designs.c.id == bindparam("ident"), designs.c.used_at < bindparam("at") - _USED)
        .values(used_at=bindparam("at"))
    )
    connection.execute(later, [{"ident": ident, "at": used[ident]} for ident in sorted(used)])
