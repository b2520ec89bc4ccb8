"""Accept: which of the media types of a route the client takes (RFC 9110, 12.5.1)."""

from __future__ import annotations

from collections.abc import Sequence

from fastapi import Request
from fastapi.datastructures import DefaultPlaceholder
from fastapi.routing import APIRoute

from service.wire.refusals import FieldRefusal, NotAcceptable

JSON = "application/json"
JSON_LINES = "application/jsonl"


async def acceptable(request: Request) -> None:
    """Refuse a request whose answer the client would not take, before anything is computed for it.

    Raises
    ------
    NotAcceptable
    """
    accept = accepted_by(request)
    if accept is None:
        return
    route = request.scope["route"]
    produced = _produced(route) if isinstance(route, APIRoute) else []
    if produced and preferred(accept, produced) is None:
        detail = f"none of the media types of {accept[:200]!a} is one of this answer"
        raise NotAcceptable(f"Accept: {detail}", FieldRefusal("/Accept", detail, None, ", ".join(produced)))


def accepted_by(request: Request) -> str | None:
    """The client's Accept, all of its lines; None when it takes everything."""
    return ", ".join(request.headers.getlist("accept")) or None


def preferred(accept: str | None, produced: Sequence[str]) -> str | None:
    """The media type that the client likes best, of equal ones the first; None when it takes none of them."""
    ranges = _ranges(accept or "*/*")
    if not ranges:
        return produced[0]
    best, quality = max(((one, _quality(one, ranges)) for one in produced), key=lambda pair: pair[1])
    return best if quality > 0.0 else None


def _quality(media_type: str, ranges: dict[str, float]) -> float:
    """How much the client likes a type: by the range that names it most closely."""
    kind = media_type.partition("/")[0]
    for name in (media_type, f"{kind}/*", "*/*"):
        if name in ranges:
            return ranges[name]
    return 0.0


def _ranges(accept: str) -> dict[str, float]:
    """Media ranges and their qualities; what is not of that form is passed over."""
    found: dict[str, float] = {}
    for part in accept.split(","):
        name, *parameters = (word.strip().lower() for word in part.split(";"))
        quality = 1.0
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            if key.strip() == "q":
                try:
                    quality = min(max(float(value), 0.0), 1.0)
                except ValueError:
                    quality = 0.0
        if name.count("/") == 1:
            found[name] = max(found.get(name, 0.0), quality)
    return found


def _produced(route: APIRoute) -> list[str]:
    """Media types that a route answers in, its own first; none where it says nothing."""
    kind = route.response_class
    if isinstance(kind, DefaultPlaceholder):
        kind = kind.value
    own = getattr(kind, "media_type", None)
    declared = [media for status in (200, 201) for media in route.responses.get(status, {}).get("content", {})]
    return list(dict.fromkeys([*([own] if own else []), *declared]))
