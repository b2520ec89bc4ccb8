"""The outermost wrapper: headers that every answer carries, a line in the log, and the counts."""

from __future__ import annotations

import logging
import time
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.pace import Pace
from service.http.request_ids import request_id
from service.metrics import Metrics

#: Set where a route did not set its own.
SECURITY = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"x-frame-options": b"DENY",
    b"content-security-policy": b"default-src 'none'; frame-ancestors 'none'",
    b"cross-origin-resource-policy": b"same-origin",
    b"cross-origin-opener-policy": b"same-origin",
}
#: Of an error, which the next request may not meet again.
_UNKEPT = {**SECURITY, b"cache-control": b"no-store"}
#: Routes that machines ask all the time: they need not wait for others, and are logged for debugging only.
_WATCHED = frozenset({"/healthz", "/readyz", "/metrics"})
#: Route of what no route took.
NO_ROUTE = "(none)"

log = logging.getLogger("gainfield.access")


class Edge:
    """ASGI wrapper around everything, faults of the server included."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self.app = app
        self.metrics = metrics
        self._pace = Pace()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on; its answer gets its headers, and the log its line when it has ended."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        began = time.perf_counter()
        method, state = scope["method"], scope.setdefault("state", {})
        ident = state["request_id"] = request_id(scope["headers"])
        timing: dict[str, float] = state.setdefault("timing", {})
        more: dict[str, str] = state.setdefault("answer_headers", {})
        status = 0

        async def with_headers(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                timing["total"] = time.perf_counter() - began
                headers = list(message.get("headers", ()))
                present = {name.lower() for name, _ in headers}
                wanted = SECURITY if status < 400 else _UNKEPT
                headers += [(name, value) for name, value in wanted.items() if name not in present]
                headers += [(name.encode(), value.encode()) for name, value in more.items()]
                headers += [(b"x-request-id", ident.encode()), (b"server-timing", _server_timing(timing))]
                message = {**message, "headers": headers}
            await send(message)

        self.metrics.began()
        try:
            if scope["path"] not in _WATCHED:
                await self._pace.passing()
            await self.app(scope, receive, with_headers)
        finally:
            took = time.perf_counter() - began
            route = getattr(scope.get("route"), "path_format", None) or NO_ROUTE
            self.metrics.ended(method, route, status, took)
            level = logging.DEBUG if route in _WATCHED and status < 400 else logging.INFO
            if log.isEnabledFor(level):
                log.log(level, "request", extra={"fields": _line(scope, ident, method, route, status, took)})


def _line(scope: Scope, ident: str, method: str, route: str, status: int, took: float) -> dict[str, Any]:
    """What the log says of a request: nothing that the client chose but a plain id and the method."""
    principal = scope["state"].get("principal")
    return {
        "request_id": ident,
        "method": method[:16],
        "route": route,
        "status": status,
        "ms": round(took * 1e3, 3),
        "owner": None if principal is None else principal.owner,
        "key": None if principal is None else principal.key_id,
    }


def _server_timing(timing: dict[str, float]) -> bytes:
    return ", ".join(f"{name};dur={1e3 * seconds:.1f}" for name, seconds in timing.items()).encode()
