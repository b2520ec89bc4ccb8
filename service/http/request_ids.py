"""The name of a request in the log and in its answer: the client's own, when it is a plain word."""

from __future__ import annotations

import re
import secrets

_SANE = re.compile(rb"[A-Za-z0-9][A-Za-z0-9._:@/+=-]{0,127}")


def request_id(headers: list[tuple[bytes, bytes]]) -> str:
    """The one ``X-Request-Id`` of these headers when it is 1 to 128 plain characters, else a new one."""
    given = [value for name, value in headers if name == b"x-request-id"]
    if len(given) == 1 and _SANE.fullmatch(given[0]):
        return given[0].decode("ascii")
    return secrets.token_hex(16)
