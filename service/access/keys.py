"""API keys ``gf_<id>_<secret>``: made, listed, revoked, and known again."""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import time
from dataclasses import dataclass

from service.access.principals import SCOPES, Principal, Scope
from service.store.keys import KeyStore, StoredKey

_KEY = re.compile(r"gf_([0-9a-f]{16})_([0-9a-f]{64})", re.ASCII)
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.@-]{0,63}", re.ASCII)
#: What the secret of an unknown id is compared with, so that it takes as long: the digest of no secret.
_NOBODY = "0" * 64
#: For how long a key that was found good is not looked up again [s]: a revoked key works no longer than this.
GOOD_FOR = 5.0
#: Keys that are remembered as good at the same time.
_REMEMBERED = 4096


@dataclass(frozen=True)
class NewKey:
    """A key that was just made: `token` is what the client sends, and is kept nowhere."""

    token: str
    key: StoredKey


def add_key(
    store: KeyStore,
    name: str,
    scope: Scope = "write",
    requests_per_minute: int | None = None,
    max_stored_bytes: int | None = None,
) -> NewKey:
    """Make a key of 256 bits; its `name` owns what is posted with it, and keys of one name share it.

    Raises
    ------
    ValueError : a name, scope or limit that no key can have
    """
    if not _NAME.fullmatch(name):
        raise ValueError("the name of a key has 1 to 64 letters, digits or _ . @ -, and begins with a letter or digit")
    if scope not in SCOPES:
        raise ValueError(f"the scope of a key is one of {', '.join(SCOPES)}")
    if min(requests_per_minute or 1, max_stored_bytes or 1) < 1 or 0 in (requests_per_minute, max_stored_bytes):
        raise ValueError("limits of a key are 1 or more, or None")
    ident, secret = secrets.token_hex(8), secrets.token_hex(32)
    key = StoredKey(ident, name, _digest(secret), scope, requests_per_minute, max_stored_bytes, time.time())
    store.add(key)
    return NewKey(f"gf_{ident}_{secret}", key)


def list_keys(store: KeyStore) -> list[StoredKey]:
    """All keys, oldest first, revoked ones too."""
    return store.all()


def revoke_key(store: KeyStore, ident: str) -> bool:
    """Have the key of this id open nothing any more; whether there was one that did."""
    return store.revoke(ident, time.time())


class KnownKeys:
    """Keys as requests show them; what was found good is remembered for `GOOD_FOR` seconds."""

    def __init__(self, store: KeyStore) -> None:
        self._store = store
        self._good: dict[str, tuple[Principal, float]] = {}

    def remembered(self, token: str) -> tuple[Principal | None, bool]:
        """Who shows a key that is remembered as good, and whether it was good at all, be it a while ago."""
        found = self._good.get(_digest(token))
        if found is None:
            return None, False
        principal, until = found
        return (principal if time.monotonic() < until else None), True

    def looked_up(self, token: str) -> Principal | None:
        """Who shows this key; None when it opens nothing.

        Unknown ids, wrong secrets and revoked keys take the same steps.

        Raises
        ------
        StoreUnavailable
        """
        shape = _KEY.fullmatch(token)
        ident, secret = shape.groups() if shape else ("", "")
        stored = self._store.get(ident)
        same = hmac.compare_digest(_digest(secret), _NOBODY if stored is None else stored.digest)
        if stored is None or not same or stored.revoked_at is not None:
            self._good.pop(_digest(token), None)
            return None
        (scope,) = (known for known in SCOPES if known == stored.scope)
        principal = Principal(stored.name, scope, stored.id, stored.requests_per_minute, stored.max_stored_bytes)
        while len(self._good) >= _REMEMBERED:
            self._good.pop(next(iter(self._good)), None)
        self._good[_digest(token)] = principal, time.monotonic() + GOOD_FOR
        return principal


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()
