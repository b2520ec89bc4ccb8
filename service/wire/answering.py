"""Answers: numpy to JSON by orjson, entity tags, and downloads with safe names."""

from __future__ import annotations

import hashlib
import re
from typing import Any

import numpy as np
import orjson
from fastapi import Request, Response

from model.arrays import ComplexArray

JSON = "application/json"


def encode(document: Any) -> bytes:
    """JSON of a document that may hold numpy arrays; nan and infinities become null, complex ``{re, im}``."""
    return orjson.dumps(document, default=_encodable, option=orjson.OPT_SERIALIZE_NUMPY)


def line(document: Any) -> bytes:
    """A line of JSON Lines."""
    return encode(document) + b"\n"


def _encodable(value: Any) -> Any:
    """What orjson takes instead of the arrays it does not take: strided, complex, of objects, of no axes."""
    if isinstance(value, np.ndarray):
        if np.iscomplexobj(value):
            return complex_numbers(value)
        if value.dtype == object or value.ndim == 0:
            return value.tolist()
        if not value.flags.c_contiguous:
            return np.ascontiguousarray(value)
    raise TypeError(f"{type(value).__name__} has no place in an answer")


def complex_numbers(values: ComplexArray) -> Any:
    """Nested lists of ``{re, im}`` in the shape of `values`; null where a number does not exist."""
    if values.ndim > 1:
        return [complex_numbers(row) for row in values]
    pairs = zip(values.real.tolist(), values.imag.tolist(), strict=True)
    return [{"re": re_, "im": im} if re_ == re_ and im == im else None for re_, im in pairs]


def answer(
    request: Request, body: bytes, status: int = 200, media_type: str = JSON, headers: dict[str, str] | None = None
) -> Response:
    """The answer with its entity tag; 304 and no body when the client has these very bytes already."""
    tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache", **(headers or {})}
    if unchanged(request, tag):
        return Response(status_code=304, headers=headers)
    return Response(body, status_code=status, media_type=media_type, headers=headers)


def unchanged(request: Request, tag: str) -> bool:
    """Whether the client has the answer of this entity tag."""
    return request.method == "GET" and _has(request.headers.get("if-none-match", ""), tag)


def _has(if_none_match: str, tag: str) -> bool:
    """Whether one of the client's tags is ours; weak tags compare equal (RFC 9110, 13.1.2)."""
    tags = [candidate.strip().removeprefix("W/") for candidate in if_none_match.split(",")]
    return tag in tags or "*" in tags


def download_headers(*name: str, suffix: str) -> dict[str, str]:
    """Headers that make a browser save the answer, under a name safe on every file system."""
    stem = "_".join(re.sub(r"[^A-Za-z0-9_-]+", "-", part).strip("-")[:64] or "design" for part in name)
    return {
        "Content-Disposition": f'attachment; filename="{stem}.{suffix}"',
        "X-Content-Type-Options": "nosniff",
    }
