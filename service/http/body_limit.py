"""The limit on request bodies: counted as bytes arrive, answered with a problem document."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.wire.errors import refusal_response
from service.wire.refusals import BodyTooLarge, FieldRefusal

#: How many bytes beyond the limit are read and dropped, so that a client still sending sees the answer.
DRAIN = 8


class BodyLimit:
    """ASGI wrapper: refuse a body of more than `limit` bytes, whether or not its length was declared."""

    def __init__(self, app: ASGIApp, limit: int) -> None:
        self.app = app
        self.limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, with a `receive` that counts."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        declared = headers.get("content-length", "")
        if declared.isdecimal() and len(declared) < 20 and int(declared) > self.limit:
            if "100-continue" not in headers.get("expect", "").lower():
                await self._drain(receive)
            await refusal_response(self._refusal())(scope, receive, send)
            return
        await self.app(scope, self._counting(receive), send)

    def _counting(self, receive: Receive) -> Receive:
        received = 0

        async def counted() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > self.limit:
                if message.get("more_body", False):
                    await self._drain(receive)
                raise self._refusal()
            return message

        return counted

    async def _drain(self, receive: Receive) -> None:
        dropped, more = 0, True
        while more and dropped < DRAIN * self.limit:
            message = await receive()
            dropped += len(message.get("body", b""))
            more = message["type"] == "http.request" and message.get("more_body", False)

    def _refusal(self) -> BodyTooLarge:
        return BodyTooLarge(
            f"the body has more than {self.limit} bytes, the limit max_body_bytes of this server "
            "(setting GAINFIELD_MAX_BODY_BYTES)",
            FieldRefusal("", "too many bytes", "B", f"<= {self.limit}"),
        )
