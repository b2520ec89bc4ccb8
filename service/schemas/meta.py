"""Answers about the server itself."""

from __future__ import annotations

from typing import Literal

from service.schemas.wire import Answer


class Health(Answer):
    """The process is up."""

    status: Literal["ok"]


class Version(Answer):
    """Which code answers, and with which numerical libraries."""

    name: str
    version: str
    code_version: str
    python: str
    solver: str


class Limit(Answer):
    """One limit of this server: its value, and the setting that changes it."""

    name: str
    value: int
    unit: str
    description: str
    setting: str


class Limits(Answer):
    """What this server takes; a refusal names its limit."""

    limits: list[Limit]
