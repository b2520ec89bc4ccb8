"""The proof of a schedule in this process, by the route that a server has for it."""

from __future__ import annotations

from typing import Any

import orjson

from service.cli.chosen_settings import chosen_settings
from service.cli.refusing import Refused
from service.jobs.kinds.answer import asked
from service.jobs.replay import replayed
from service.limits import WORK_LIMITS

#: What nobody asks for: here the work is whose machine it is.
_NO_LIMIT = 2**62


def proved_here(body: dict[str, Any]) -> dict[str, Any]:
    """What `POST /v1/schedules/verify` answers.

    Raises
    ------
    Refused
    """
    chosen_settings()  # an environment that no server takes is refused in words
    limits = dict.fromkeys((*WORK_LIMITS, "max_body_bytes", "max_table_rows"), _NO_LIMIT)
    status, _, content = replayed(asked("POST", "/v1/schedules/verify", "", body), {}, limits)
    document: dict[str, Any] = orjson.loads(content)
    if status >= 400:
        raise Refused.of(document)
    return document
