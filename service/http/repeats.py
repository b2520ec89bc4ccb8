"""``Idempotency-Key``: a POST that a client sends again, because it saw no answer, is answered as the first time."""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial

from anyio import CancelScope, to_thread
from fastapi import Request, Response

from service.access.principals import Principal
from service.settings import Settings
from service.store.repeated import LOST_AFTER, KeptAnswer, RepeatedStore
from service.wire.refusals import FieldRefusal, RepeatedDifferently, RepeatedTooSoon, StoreUnavailable, TooManyRequests

HEADER = "Idempotency-Key"
LONGEST_KEY = 200
#: When a client may ask again for what is being answered [s].
_SOON = 1
#: When one may ask again who has as many kept answers as may be [s].
_LATER = 3600


async def answered_once(request: Request, handle: Callable[[], Awaitable[Response]]) -> Response:
    """The answer of `handle`, or the one that it gave to this very request before.

    An answer is kept for a day for its owner. Refusals, faults and 429 are not kept: they kept nothing, so the key is
    free for a request that has been put right.

    Raises
    ------
    RepeatedDifferently : the key was used for another request, or is no key
    RepeatedTooSoon : the first request is being answered
    TooManyRequests : the owner has as many kept answers as may be
    """
    key = _key_of(request)
    if key is None:
        return await handle()
    store: RepeatedStore = request.app.state.shared.store.repeated
    settings: Settings = request.app.state.shared.settings
    asking: Principal = request.scope["state"]["principal"]
    digest = await _digest(request)
    most = settings.max_repeatable_answers
    turn = await to_thread.run_sync(store.begin, asking.owner, key, digest, time.time(), most)
    if isinstance(turn, KeptAnswer):
        return _replayed(turn)
    match turn:
        case "different":
            detail = "the key was used for another request within the last 24 h"
            raise RepeatedDifferently(f"{HEADER}: {detail}", _refused(detail, "a new key for a new request"))
        case "in_flight":
            raise RepeatedTooSoon(f"{HEADER}: the first request with this key is being answered", wait=_SOON)
        case "full":
            raise TooManyRequests(
                f"{most} answers are kept for their {HEADER}, the limit max_repeatable_answers of this server "
                "(setting GAINFIELD_MAX_REPEATABLE_ANSWERS)",
                wait=_LATER,
            )
    async with _first(store, asking.owner, key, digest) as keep:
        response = await handle()
        if response.status_code < 400 and isinstance(getattr(response, "body", None), bytes):
            headers = tuple((name.decode("latin-1"), value.decode("latin-1")) for name, value in response.raw_headers)
            await keep(KeptAnswer(response.status_code, headers, bytes(response.body)))
    return response


@asynccontextmanager
async def _first(
    store: RepeatedStore, owner: str, key: str, digest: str
) -> AsyncIterator[Callable[[KeptAnswer], Awaitable[None]]]:
    """Have the key while the first request is answered; what is not kept when this ends is forgotten."""
    kept = False

    async def keep(answer: KeptAnswer) -> None:
        nonlocal kept
        await to_thread.run_sync(store.keep, owner, key, digest, answer, time.time())
        kept = True

    async def say_so() -> None:
        while True:
            await asyncio.sleep(LOST_AFTER / 3)
            with suppress(StoreUnavailable):
                await to_thread.run_sync(store.still_answering, owner, key, digest, time.time())

    alive = asyncio.ensure_future(say_so())
    try:
        yield keep
    finally:
        alive.cancel()
        if not kept:
            with CancelScope(shield=True), suppress(StoreUnavailable):
                await to_thread.run_sync(partial(store.forget, owner, key, digest))


def _key_of(request: Request) -> str | None:
    given = request.headers.getlist(HEADER)
    if not given or request.method != "POST":
        return None
    (key, *others) = given
    if others or not 1 <= len(key) <= LONGEST_KEY or not (key.isascii() and key.isprintable()):
        detail = "not one key of printable ASCII characters"
        raise RepeatedDifferently(f"{HEADER}: {detail}", _refused(detail, f"1 to {LONGEST_KEY} printable characters"))
    return key


def _refused(detail: str, allowed: str) -> FieldRefusal:
    return FieldRefusal(f"/{HEADER}", detail, None, allowed)


async def _digest(request: Request) -> str:
    """Digest of method, path, query, what is preferred, and body."""
    head = (request.method, request.url.path, request.url.query, request.headers.get("prefer", ""))
    found = hashlib.sha256("\0".join(head).encode("utf-8", "surrogateescape"))
    found.update(b"\0" + await request.body())
    return found.hexdigest()


def _replayed(kept: KeptAnswer) -> Response:
    response = Response(kept.body, status_code=kept.status)
    response.raw_headers = [(name.encode("latin-1"), value.encode("latin-1")) for name, value in kept.headers]
    response.headers["Idempotency-Replayed"] = "true"
    return response
