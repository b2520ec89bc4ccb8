"""What the service refuses, as exceptions that know nothing of HTTP; `service.errors` gives each its status."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FieldRefusal:
    """One field that cannot be taken.

    Attributes
    ----------
    pointer : JSON pointer into the body, or ``/name`` of a query parameter
    detail : what is wrong with it
    unit : unit of the field, None when it is not a quantity
    allowed : what would have been taken
    """

    pointer: str
    detail: str
    unit: str | None = None
    allowed: str | None = None


class Refusal(Exception):
    """Base of what the service refuses: a sentence, and the fields it is about."""

    def __init__(self, detail: str, *fields: FieldRefusal) -> None:
        super().__init__(detail)
        self.detail = detail
        self.fields = fields


class UnreadableBody(Refusal):
    """The body is not one JSON document."""


class UnsupportedMediaType(Refusal):
    """The body is not declared as JSON."""


class InvalidRequest(Refusal):
    """Readable, but not a request this service can take."""


class LimitExceeded(Refusal):
    """More work than this server takes; the detail names the limit and its setting."""


class BodyTooLarge(Refusal):
    """The body has more bytes than this server takes."""


class NotFound(Refusal):
    """No such design, controller, point or file."""


class NoDesignAtPoint(Refusal):
    """The controller has no gains at that grid point; the detail says why."""


class StudyNotPossible(Refusal):
    """The study is not of this kind of controller, or the domain refuses it; the detail says why."""


class StaleDesign(Refusal):
    """The stored design was made by other code, and this code would answer differently."""


class StoreUnavailable(Refusal):
    """The store of designs cannot be read or written now."""
