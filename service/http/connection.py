"""Connections that take care of themselves: slow heads, slow bodies, readers that stall, and too many of them.

uvicorn's connection waits for ever for the rest of a request, and answers what it cannot read in plain text.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from http import HTTPStatus
from typing import Any, Literal

import h11
import orjson
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from service.settings import Settings
from service.wire.errors import MEDIA_TYPE, problem

#: What a client does not do in time, or cannot do: status -> code, detail.
_REFUSED = {
    400: ("malformed_request", "the request is not HTTP/1.1"),
    408: ("request_timeout", "the request did not arrive in time"),
    414: ("uri_too_long", "the request line is longer than this server reads"),
    431: ("headers_too_large", "the headers are larger than this server reads"),
    501: ("not_implemented", "the request uses a transfer coding that this server does not know"),
    503: ("too_many_connections", "the server has as many connections as it takes, all of them at work"),
}
Phase = Literal["idle", "head", "body", "answer"]


@dataclass(frozen=True)
class Patience:
    """How long a connection may take.

    Attributes
    ----------
    head : from the first moment of a request to the end of its headers [s]
    body : the same for its body, beside a second for every `body_rate` bytes of it [s]
    body_rate : [B/s]
    stalled : for which a client may read nothing of its answer [s]
    connections : at the same time, of one process
    """

    head: float
    body: float
    body_rate: float
    stalled: float
    connections: int


@dataclass(frozen=True)
class Crowd:
    """The connections of one process: `waiting` are those that are owed no answer, the longest waiting first."""

    patience: Patience
    waiting: dict[Connection, None] = field(default_factory=dict)


class Connection(H11Protocol):
    """A connection of uvicorn with an end to every wait.

    When there are too many, the one that has waited longest for its client makes room; when all are owed an answer, a
    new one is refused with 503.
    """

    def __init__(
        self,
        crowd: Crowd,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._crowd = crowd
        self._phase: Phase = "idle"
        self._began = 0.0
        self._received = 0
        self._line_ended = False
        self._timer: asyncio.TimerHandle | None = None
        self._stalled: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request, which is to begin at once."""
        super().connection_made(transport)
        self._enter("head")
        if len(self.connections) > self._crowd.patience.connections:
            longest = next(iter(self._crowd.waiting))
            if longest is self:
                self._refuse(503)
            else:
                longest.transport.abort()
                longest.leave()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        super().connection_lost(exc)
        self.leave()

    def leave(self) -> None:
        """Wait for nothing any more."""
        self._crowd.waiting.pop(self, None)
        self.connections.discard(self)
        for timer in (self._timer, self._stalled):
            if timer is not None:
                timer.cancel()
        self._timer = self._stalled = None

    def data_received(self, data: bytes) -> None:
        """Count what came, and pass it on."""
        if self._phase == "idle":
            self._enter("head")
        if self._phase == "head":
            self._line_ended = self._line_ended or b"\n" in data
        self._received += len(data)
        super().data_received(data)
        self._follow()

    def on_response_complete(self) -> None:
        """The next request may begin."""
        super().on_response_complete()
        self._follow()
        if self.transport.is_closing():
            self._watch_reader()

    def timeout_keep_alive_handler(self) -> None:
        """No further request came: the connection goes, even when its last answer is not read."""
        super().timeout_keep_alive_handler()
        self._watch_reader()

    def pause_writing(self) -> None:
        """The client does not read as fast as the answer comes."""
        super().pause_writing()
        self._watch_reader()

    def resume_writing(self) -> None:
        """The client has read."""
        super().resume_writing()
        if self._stalled is not None:
            self._stalled.cancel()
            self._stalled = None

    def send_400_response(self, msg: str) -> None:
        """What cannot be read is answered with a problem, and the connection closed."""
        fault = sys.exception()
        status = fault.error_status_hint if isinstance(fault, h11.RemoteProtocolError) else 400
        if status == 431 and not self._line_ended:
            status = 414
        self._refuse(status if status in _REFUSED else 400)

    def _follow(self) -> None:
        """Take up the phase that the connection has come to."""
        if self.transport.is_closing():
            return
        theirs = self.conn.their_state
        if theirs is h11.SEND_BODY:
            self._enter("body")
        elif theirs is not h11.IDLE:
            self._enter("answer")
        elif self._phase in ("body", "answer"):
            self._enter("idle")

    def _enter(self, phase: Phase) -> None:
        if phase == self._phase:
            return
        self._phase, self._began, self._received = phase, self.loop.time(), 0
        self._line_ended = False
        self._crowd.waiting.pop(self, None)
        if phase != "answer":
            self._crowd.waiting[self] = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if phase in ("head", "body"):
            self._timer = self.loop.call_at(self._deadline(), self._late)

    def _deadline(self) -> float:
        patience = self._crowd.patience
        if self._phase == "head":
            return self._began + patience.head
        return self._began + patience.body + self._received / patience.body_rate

    def _late(self) -> None:
        """End the connection, unless more came meanwhile or the server itself is not reading."""
        if self._phase == "body" and self.flow.read_paused:
            self._began = self.loop.time()
        deadline = self._deadline()
        if deadline > self.loop.time() + 1e-3:
            self._timer = self.loop.call_at(deadline, self._late)
        elif self._received == 0 and self._phase == "head":
            self.transport.abort()
        else:
            self._refuse(408)

    def _refuse(self, status: int) -> None:
        """Answer with a problem where there is no answer yet, and close."""
        if self.transport.is_closing():
            return
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            code, detail = _REFUSED[status]
            phrase = HTTPStatus(status).phrase
            body = orjson.dumps(problem(status, code, phrase, detail))
            headers = [("content-type", MEDIA_TYPE), ("content-length", str(len(body))), ("connection", "close")]
            headers += [("x-content-type-options", "nosniff"), ("cache-control", "no-store")]
            if status == 503:
                headers.append(("retry-after", "1"))
            events = (h11.Response(status_code=status, headers=headers, reason=phrase), h11.Data(body))
            for event in (*events, h11.EndOfMessage()):
                self.transport.write(self.conn.send(event) or b"")
        if self.cycle is not None and not self.cycle.response_complete:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        self.transport.close()
        self._watch_reader()

    def _watch_reader(self) -> None:
        """Drop the connection when its client reads nothing for too long."""
        left = self.transport.get_write_buffer_size()
        if left and self._stalled is None:
            self._stalled = self.loop.call_later(self._crowd.patience.stalled, self._still_stalled, left)

    def _still_stalled(self, before: int) -> None:
        self._stalled = None
        left = self.transport.get_write_buffer_size()
        if left >= before:
            self.transport.abort()
        else:
            self._watch_reader()


def connections(settings: Settings, most: int) -> Callable[..., Connection]:
    """What makes the connections of a server process, `most` of them at the same time."""
    patience = Patience(
        head=settings.head_timeout_s,
        body=settings.body_timeout_s,
        body_rate=float(settings.min_body_rate_b_s),
        stalled=settings.stalled_answer_timeout_s,
        connections=most,
    )
    return partial(Connection, Crowd(patience))
