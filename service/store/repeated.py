"""Answers to requests that named an ``Idempotency-Key``, for a day each."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

from sqlalchemy import ColumnElement, delete, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from service.store.blobs import Blobs
from service.store.database import Database
from service.store.tables import repeated

#: For how long an answer is kept [s].
KEPT_FOR = 24 * 3600.0
#: A first request that did not say for this long that it is being answered was lost with its process [s].
LOST_AFTER = 30.0


@dataclass(frozen=True)
class KeptAnswer:
    """An answer as it was first given: status, headers in their order, bytes."""

    status: int
    headers: tuple[tuple[str, str], ...]
    body: bytes


#: What a request with a key is: the first, one of other content, one whose first is being answered, one too many.
Turn = Literal["first", "different", "in_flight", "full"]


class RepeatedStore:
    """The repeatable answers of a database; times are seconds since 1970, given by the caller.

    Raises
    ------
    StoreUnavailable : from every method, when the database or a file cannot be read or written
    """

    def __init__(self, database: Database, blobs: Blobs) -> None:
        self._database = database
        self._blobs = blobs

    def begin(self, owner: str, key: str, digest: str, now: float, at_most: int) -> Turn | KeptAnswer:
        """The kept answer to this request, or whose turn it is; of the first, the key is taken from now on."""
        ours = (repeated.c.owner == owner) & (repeated.c.key == key)
        over = (repeated.c.created_at < now - KEPT_FOR) | (
            repeated.c.status.is_(None) & (repeated.c.created_at < now - LOST_AFTER)
        )
        with self._database.writing() as connection:
            connection.execute(delete(repeated).where((repeated.c.owner == owner) & over))
            row = connection.execute(select(repeated).where(ours)).first()
            if row is None:
                count = select(func.count()).where(repeated.c.owner == owner)
                if connection.execute(count).scalar_one() >= at_most:
                    return "full"
                values = {"owner": owner, "key": key, "request_digest": digest, "created_at": now}
                try:
                    with connection.begin_nested():
                        connection.execute(insert(repeated).values(values))
                    return "first"
                except IntegrityError:  # another process was first, just now
                    row = connection.execute(select(repeated).where(ours)).one()
        if row.request_digest != digest:
            return "different"
        if row.status is None:
            return "in_flight"
        headers = tuple((name, value) for name, value in json.loads(row.headers))
        return KeptAnswer(row.status, headers, self._blobs.get(row.answer_blob))

    def still_answering(self, owner: str, key: str, digest: str, now: float) -> None:
        """The first request is not lost: say so more often than every `LOST_AFTER`."""
        self._change(owner, key, digest, created_at=now)

    def keep(self, owner: str, key: str, digest: str, answer: KeptAnswer, now: float) -> None:
        """Keep the answer to the first request."""
        blob = self._blobs.put(answer.body)
        headers = json.dumps(answer.headers)
        self._change(owner, key, digest, status=answer.status, headers=headers, answer_blob=blob, created_at=now)

    def forget(self, owner: str, key: str, digest: str) -> None:
        """The first request came to nothing: the next is the first."""
        with self._database.writing() as connection:
            connection.execute(delete(repeated).where(_in_flight(owner, key, digest)))

    def _change(self, owner: str, key: str, digest: str, **values: object) -> None:
        with self._database.writing() as connection:
            connection.execute(update(repeated).where(_in_flight(owner, key, digest)).values(values))


def _in_flight(owner: str, key: str, digest: str) -> ColumnElement[bool]:
    """The request that is being answered: one that took the place of a lost one is not touched by it."""
    ours = (repeated.c.owner == owner) & (repeated.c.key == key) & (repeated.c.request_digest == digest)
    return ours & repeated.c.status.is_(None)
