"""What the service refuses, as exceptions that know nothing of HTTP; `service.wire.errors` gives each its status."""

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
    """Base of what the service refuses: a sentence, the fields it is about, and when to ask again [s]."""

    def __init__(self, detail: str, *fields: FieldRefusal, wait: int | None = None) -> None:
        super().__init__(detail)
        self.detail = detail
        self.fields = fields
        self.wait = wait


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


class Unauthenticated(Refusal):
    """No key where one is asked for, or one that opens nothing."""


class NotAllowed(Refusal):
    """The scope of the key does not hold this."""


class TooManyRequests(Refusal):
    """More requests than the key or the address has; `allowance` is the limit, what is left and the wait [s]."""

    def __init__(self, detail: str, wait: int, allowance: tuple[int, int, int] | None = None) -> None:
        super().__init__(detail, wait=wait)
        self.allowance = allowance


class QuotaExceeded(Refusal):
    """The owner has stored as much as the key allows."""


class NotReady(Refusal):
    """Something that the server needs is not well; a field names each, and why."""


class Overloaded(Refusal):
    """More requests wait for a computation than this server lets wait."""


class NotAcceptable(Refusal):
    """The client takes none of the media types that this is answered in."""


class RepeatedDifferently(Refusal):
    """The `Idempotency-Key` was used for another request, or is none."""


class RepeatedTooSoon(Refusal):
    """The first request with this `Idempotency-Key` is being answered."""


class NotFound(Refusal):
    """No such design, controller, point or file."""


class NoDesignAtPoint(Refusal):
    """The controller has no gains at that grid point; the detail says why."""


class StudyNotPossible(Refusal):
    """The study is not of this kind of controller, or the domain refuses it; the detail says why."""


class StaleDesign(Refusal):
    """The stored design was made by other code, and this code would answer differently."""


class NoResult(Refusal):
    """The job has no result, or none yet; the detail says which."""


class QueueFull(Refusal):
    """As many jobs wait as this server takes."""


class StoreUnavailable(Refusal):
    """The store of designs cannot be read or written now."""
