"""The shipped spec packs: what every controller is judged on when a request names one."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response

from design.specs import SPEC_PACKS
from service.documentation.openapi import problems
from service.schemas.meta import SpecPacks
from service.schemas.specs import PACK_NAMES, PackName
from service.wire.answering import answer, encode
from service.wire.spec_names import spec_field

router = APIRouter(prefix="/v1/spec-packs", tags=["spec packs"])

NOTE = "Values are numbers to meet; meeting them is no claim of compliance with a standard."
#: Where the values of each pack come from.
NOTES: dict[PackName, str] = {
    "default": "Common values for a loop that is broken at the actuators.",
    "limit_speed": "Margins up to the limit speed, as remembered from table III of MIL-F-9490D; unconfirmed against "
    "that document.",
}


@router.get("", response_model=SpecPacks, responses=problems())
def spec_packs(request: Request) -> Response:
    """The packs that `spec_pack` of a design request may name, with their values.

    A request may bring a pack of its own instead: `{"name": .., "specs": {..}}`.
    """
    return answer(request, encode({"packs": [_document(name) for name in PACK_NAMES], "note": NOTE}))


def _document(name: PackName) -> dict[str, Any]:
    fields = [(spec, spec_field(spec.quantity, spec.sense)) for spec in SPEC_PACKS[name]]
    specs = [{"name": field.name, "limit": field.limit(spec), "unit": field.unit} for spec, field in fields]
    return {"name": name, "note": NOTES[name], "specs": specs}
