"""A design in this process: the request read and checked as a server does, its parts one after the other."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from schedules.designed import DesignedEnvelope
from schedules.schedule import GainSchedule, Provenance
from schedules.schedule_of import schedule_of
from service.cli.progress import Reached
from service.designs import design_id, parts_of, stored_design, synthesised
from service.schemas.requests import DesignRequest
from service.store.designs import StoredDesign
from service.wire.errors import MAX_FIELDS
from service.wire.pointers import field_refusal
from service.wire.refusals import InvalidRequest


@dataclass(frozen=True, eq=False)
class DesignedHere:
    """A design as a server would keep it, and the envelope behind it."""

    stored: StoredDesign
    envelope: DesignedEnvelope

    def schedules(self) -> list[GainSchedule]:
        """The gain schedule of each controller."""
        one = self.stored
        digest = hashlib.sha256(one.request).hexdigest()
        origin = Provenance(one.id, one.name, digest, one.version, one.created_at)
        return [schedule_of(self.envelope, controller, origin) for controller in self.envelope.controllers]


def designed_here(document: dict[str, Any], reached: Reached) -> DesignedHere:
    """The design of a request, which nobody keeps; `reached` is told after each of its parts.

    Raises
    ------
    InvalidRequest : it is no request, or the model refuses it
    """
    request = read_request(document)
    parts, done = parts_of(request), []
    total = len(parts) + 1
    for number, part in enumerate(parts):
        reached(number, total)
        done.append(synthesised(request, part))
    reached(len(parts), total)
    made = DesignedHere(*stored_design(design_id(request), request, done, time.time()))
    reached(total, total)
    return made


def read_request(document: dict[str, Any]) -> DesignRequest:
    """The request in a document, refused in the words of a server.

    Raises
    ------
    InvalidRequest
    """
    try:
        return DesignRequest.model_validate(document)
    except ValidationError as error:
        found = error.errors()
    # Only a refusal needs the documentation of all routes, which takes seconds to make.
    from service.app import create_app
    from service.settings import Settings

    openapi = create_app(Settings.model_construct()).openapi()
    operation = openapi["paths"]["/v1/designs"]["post"]
    fields = [
        field_refusal(dict(one) | {"loc": ("body", *one["loc"])}, openapi, operation) for one in found[:MAX_FIELDS]
    ]
    first = f"{fields[0].pointer or 'the request'}: {fields[0].detail}"
    rest = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    raise InvalidRequest(first + rest, *fields)
