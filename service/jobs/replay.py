"""A request answered by the routes of this code, without a server, a store or a network."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from threading import get_ident
from typing import Any
from urllib.parse import quote

import anyio
from anyio import CapacityLimiter, Semaphore
from starlette.types import Message, Scope

from service.access.door import Admitted, Door
from service.access.principals import OPERATOR, Principal
from service.app import Application, create_app
from service.designs import Designs
from service.envelopes import Envelopes
from service.jobs.given_designs import GivenDesigns
from service.settings import Settings
from service.state import State
from service.store.designs import StoredDesign
from service.store.store import Store


def replayed(
    request: Mapping[str, Any], designs: Mapping[str, StoredDesign], limits: Mapping[str, int]
) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of the answer to a request (`service.jobs.kinds.answer.asked`).

    Parameters
    ----------
    designs : by id, all that there are
    limits : settings that bound the work
    """
    written = json.dumps(limits, sort_keys=True)
    app, store = _app(written, get_ident()), _GivenStore(designs)
    kept = Designs(store.designs, Envelopes(len(designs) + 1))
    settings = _settings(written)
    shared = State(settings, store, kept, Semaphore(1), CapacityLimiter(1), _OpenDoor(), app.metrics, None)
    app.state.shared = shared
    return anyio.run(_answered, app, request)


class _OpenDoor(Door):
    """Who asked was let in, and found to have room, where the request came from."""

    def __init__(self) -> None:
        pass

    async def admit(self, scope: Scope) -> Admitted:
        return Admitted(OPERATOR)

    def check_room(self, principal: Principal) -> None:
        return None


class _GivenStore(Store):
    """A store of these designs and nothing else: neither a database nor files."""

    def __init__(self, designs: Mapping[str, StoredDesign]) -> None:
        self.designs = GivenDesigns(designs)


def _settings(limits: str) -> Settings:
    return Settings(**json.loads(limits))


# One for each thread of a worker, since it holds what belongs to the one request it answers.
@lru_cache(maxsize=8)
def _app(limits: str, thread: int) -> Application:
    return create_app(_settings(limits))


async def _answered(app: Application, request: Mapping[str, Any]) -> tuple[int, dict[str, str], bytes]:
    body = request["body"]
    scope: Scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "scheme": "http",
        "server": ("localhost", 80),
        "method": request["method"],
        "path": request["path"],
        "raw_path": quote(request["path"]).encode(),
        "root_path": "",
        "query_string": request["query"].encode("latin-1"),
        "headers": [] if body is None else [(b"content-type", b"application/json")],
    }
    status, headers, pieces, read = 500, {}, [b""], False

    async def receive() -> Message:
        nonlocal read
        if read:
            await anyio.sleep_forever()  # nobody goes away; answers that are sent in pieces watch for that
        read = True
        return {"type": "http.request", "body": (body or "").encode(), "more_body": False}

    async def send(message: Message) -> None:
        nonlocal status, headers
        if message["type"] == "http.response.start":
            status = message["status"]
            headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in message["headers"]}
        else:
            pieces.append(message.get("body", b""))

    await app(scope, receive, send)
    return status, headers, b"".join(pieces)
