"""Errors on the wire: problem documents of RFC 9457."""

from __future__ import annotations

from service.schemas.wire import Answer


class FieldProblem(Answer):
    """One field that was refused: where, why, in which unit, and what is allowed there."""

    pointer: str
    detail: str
    unit: str | None
    allowed: str | None


class Problem(Answer):
    """A problem document: ``application/problem+json``."""

    type: str
    title: str
    status: int
    detail: str
    code: str
    errors: list[FieldProblem]
