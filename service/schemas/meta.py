"""Answers about the server itself."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.specs import PackName
from service.schemas.wire import Answer


class Health(Answer):
    """The process is up."""

    status: Literal["ok"]


class Readiness(Answer):
    """The server can work; `checks` is what was looked at."""

    status: Literal["ready"]
    checks: list[str]


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


class PackSpec(Answer):
    """One spec of a pack, under the name that a request gives it."""

    name: str
    limit: float = Field(json_schema_extra={"unit": "see `unit`"})
    unit: str


class ShippedPack(Answer):
    """A pack that a request may ask for by its name, and where its values come from."""

    name: PackName
    note: str
    specs: list[PackSpec]


class SpecPacks(Answer):
    """The shipped packs. Their values are numbers to meet; meeting them is no claim of compliance with a standard."""

    packs: list[ShippedPack]
    note: str
