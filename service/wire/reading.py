"""Reading a request body: one JSON document in UTF-8, every key once, nothing deeper than Python can follow."""

from __future__ import annotations

import json
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.requests import ClientDisconnect

from service.http.repeats import answered_once
from service.wire.refusals import UnreadableBody, UnsupportedMediaType

#: More fields than any object of a request has. Each one that is unknown is an error of its own, and takes time.
MAX_FIELDS = 1000
#: Deeper nesting than any request has, shallow enough for every parser and validator behind.
MAX_DEPTH = 64


def read_json(body: bytes) -> Any:
    """The JSON document in `body`. NaN and infinities are read as such: validation names the field.

    Raises
    ------
    UnreadableBody : not UTF-8, not JSON, a key given twice, nested too deeply, a number with too many digits
    """
    try:
        text = body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UnreadableBody(f"the body is not UTF-8: {error.reason} at byte {error.start}") from None
    try:
        document = json.loads(text, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        raise UnreadableBody(
            f"the body is not JSON: {error.msg} at line {error.lineno}, column {error.colno}"
        ) from None
    except RecursionError:
        raise UnreadableBody("the body is nested too deeply") from None
    except ValueError:
        raise UnreadableBody("the body holds an integer with too many digits") from None
    _check_depth(document)
    return document


def _check_depth(document: Any) -> None:
    """Refuse what is nested deeper than `MAX_DEPTH`: how deep the parser itself follows differs between Pythons."""
    level = [document] if isinstance(document, dict | list) else []
    for _ in range(MAX_DEPTH):
        inner = (value for one in level for value in (one.values() if isinstance(one, dict) else one))
        level = [value for value in inner if isinstance(value, dict | list)]
        if not level:
            return
    raise UnreadableBody(f"the body is nested more than {MAX_DEPTH} levels deep")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > MAX_FIELDS:
        raise UnreadableBody(f"an object of the body has more than {MAX_FIELDS} fields")
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise UnreadableBody(f"the field {name[:80]!a} is given twice in one object")
        found[name] = value
    return found


def prefers_async(request: Request) -> bool:
    """Whether the client would rather have a job than wait (``Prefer: respond-async``, RFC 7240)."""
    preferences = ",".join(request.headers.getlist("prefer")).split(",")
    return any(each.partition(";")[0].strip().lower() == "respond-async" for each in preferences)


class JsonRequest(Request):
    """A request whose body is read by `read_json`."""

    _document: Any = None

    @property
    def document(self) -> Any:
        """The document, as read by `read`."""
        return self._document

    async def json(self) -> Any:
        """The document, as read by `read`."""
        return self._document

    async def read(self) -> None:
        """Read and parse the body.

        Raises
        ------
        UnsupportedMediaType : the body is not declared as JSON, or as packed or in another encoding than UTF-8
        UnreadableBody : `read_json` refuses it, or the connection closed before it was complete
        """
        kind, *parameters = (part.strip().lower() for part in self.headers.get("content-type", "").split(";"))
        if kind != "application/json" and not (kind.startswith("application/") and kind.endswith("+json")):
            raise UnsupportedMediaType(
                f"the body is declared as {kind[:80]!a}; send JSON with the header Content-Type: application/json"
            )
        charsets = {part.partition("=")[2].strip(' "') for part in parameters if part.startswith("charset=")}
        if charsets - {"utf-8", "utf8"}:
            raise UnsupportedMediaType(f"the charset is declared as {max(charsets)[:80]!a}; JSON is sent in UTF-8")
        codings = ",".join(self.headers.getlist("content-encoding")).lower().split(",")
        if {coding.strip() for coding in codings} - {"", "identity"}:
            raise UnsupportedMediaType("bodies are taken as they are, and not unpacked: send no Content-Encoding")
        try:
            self._document = read_json(await self.body())
        except ClientDisconnect:
            raise UnreadableBody("the connection closed before the body was complete") from None


class JsonRoute(APIRoute):
    """A route that reads a JSON body by `read_json` before anything else looks at it."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler, with the reading before it."""
        handle = super().get_route_handler()

        async def read_then_handle(request: Request) -> Response:
            document = JsonRequest(request.scope, request.receive)
            await document.read()
            return await answered_once(document, lambda: handle(document))

        return read_then_handle if self.body_field else handle
