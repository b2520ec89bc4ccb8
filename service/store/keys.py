"""Keys of clients: a digest of each secret, what it allows, and what its owner has stored."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import func, insert, select, update

from service.store.database import Database
from service.store.tables import designs, keys, ownerships


@dataclass(frozen=True)
class StoredKey:
    """A key without its secret.

    Attributes
    ----------
    id : first part of the key, which is no secret
    name : owner of what is posted with it; keys of one name have one owner
    digest : SHA-256 of the secret, hex
    scope : ``read``, ``write`` or ``admin``
    requests_per_minute, max_stored_bytes : None is unlimited
    created_at, revoked_at : seconds since 1970, UTC; None is not revoked
    """

    id: str
    name: str
    digest: str
    scope: str
    requests_per_minute: int | None
    max_stored_bytes: int | None
    created_at: float
    revoked_at: float | None = None


class KeyStore:
    """The keys of a database.

    Raises
    ------
    StoreUnavailable : from every method, when the database cannot be read or written
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, key: StoredKey) -> None:
        """Keep a new key."""
        with self._database.writing() as connection:
            connection.execute(insert(keys).values(vars(key)))

    def get(self, ident: str) -> StoredKey | None:
        """The key of this id, revoked or not; None when there is none."""
        with self._database.reading() as connection:
            row = connection.execute(select(keys).where(keys.c.id == ident)).first()
        return None if row is None else StoredKey(**row._mapping)

    def all(self) -> list[StoredKey]:
        """All keys, oldest first."""
        with self._database.reading() as connection:
            rows = connection.execute(select(keys).order_by(keys.c.created_at, keys.c.id)).all()
        return [StoredKey(**row._mapping) for row in rows]

    def revoke(self, ident: str, now: float) -> bool:
        """Have a key open nothing from now on; whether there was such a key that still did."""
        working = (keys.c.id == ident) & keys.c.revoked_at.is_(None)
        with self._database.writing() as connection:
            return connection.execute(update(keys).where(working).values(revoked_at=now)).rowcount > 0

    def any_working(self) -> bool:
        """Whether there is a key that is not revoked."""
        with self._database.reading() as connection:
            return connection.execute(select(keys.c.id).where(keys.c.revoked_at.is_(None)).limit(1)).first() is not None

    def stored_bytes(self, owner: str) -> int:
        """Bytes of all designs of an owner; a design of several owners counts for each."""
        wanted = (
            select(func.coalesce(func.sum(designs.c.bytes), 0))
            .join(ownerships, ownerships.c.design_id == designs.c.id)
            .where(ownerships.c.owner == owner)
        )
        with self._database.reading() as connection:
            return int(connection.execute(wanted).scalar_one())
