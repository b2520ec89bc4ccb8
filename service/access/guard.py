"""The door as an ASGI wrapper: what is admitted goes on with its principal, what is not is answered here."""

from __future__ import annotations

from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.door import Door
from service.wire.errors import rate_headers, refusal_response
from service.wire.refusals import Refusal


class Guard:
    """ASGI wrapper: every HTTP request has ``state["principal"]`` behind it."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what may be asked; the `Door` of the running app decides."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        door: Door = scope["app"].state.shared.door
        try:
            admitted = await door.admit(scope)
        except Refusal as refusal:
            await refusal_response(refusal)(scope, receive, send)
            return
        state = scope.setdefault("state", {})
        state["principal"] = admitted.principal
        if (left := admitted.allowance) is not None:
            state.setdefault("answer_headers", {}).update(rate_headers(left.limit, left.left, left.wait))
        await self.app(scope, receive, send)
