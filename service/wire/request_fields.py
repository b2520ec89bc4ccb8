"""One number of a request by its JSON pointer: found, and changed."""

from __future__ import annotations

from typing import Any, TypeVar

from service.schemas.requests import LinearModelsRequest
from service.schemas.wire import Request
from service.wire.refusals import FieldRefusal, InvalidRequest
from service.wire.units import unit_of

#: The parts of a request that a linear model depends on.
PARTS = tuple(LinearModelsRequest.model_fields)

Wanted = TypeVar("Wanted", bound=LinearModelsRequest)


def number_at(request: LinearModelsRequest, pointer: str) -> float:
    """The number at a pointer into the normalised request.

    Raises
    ------
    InvalidRequest : there is none, or it counts the points of the grid
    """
    part, *rest = _keys(pointer)
    found = getattr(request, part).normalised() if part in PARTS else None
    for key in rest:
        found = _inside(found, key)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise _refused(pointer, "leads to no number of this request")
    if part == "grid" and rest[-1] == "count":
        raise _refused(pointer, "counts the points of the grid, which a sweep keeps")
    return found


def changed_request(request: Wanted, pointer: str, value: float) -> Wanted:
    """The request with another number at a pointer where `number_at` finds one; only its part is read anew.

    Raises
    ------
    pydantic.ValidationError : the field does not take the value
    """
    part, *rest = _keys(pointer)
    current: Request = getattr(request, part)
    document: Any = current.normalised()
    place = document
    for key in rest[:-1]:
        place = _inside(place, key)
    last: Any = int(rest[-1]) if isinstance(place, list) else rest[-1]
    whole = isinstance(place[last], int) and float(value).is_integer()
    place[last] = int(value) if whole else value
    return request.model_copy(update={part: type(current).model_validate(document)})


def unit_at(pointer: str) -> str:
    """Unit of the field at a pointer, by its name or by that of the list it stands in."""
    names = [key for key in _keys(pointer) if not key.isdigit()]
    names = [name for name in names if name not in ("from", "to")]
    return unit_of(names[-1])


def _keys(pointer: str) -> list[str]:
    return [key.replace("~1", "/").replace("~0", "~") for key in pointer.split("/")[1:]]


def _inside(document: Any, key: str) -> Any:
    """What an object or a list holds under a key; None when it holds nothing there."""
    if isinstance(document, dict):
        return document.get(key)
    if isinstance(document, list) and key.isascii() and key.isdigit() and len(key) < 10 and int(key) < len(document):
        return document[int(key)]
    return None


def _refused(pointer: str, why: str) -> InvalidRequest:
    detail = f"{pointer[:80]!a} {why}"
    allowed = f"a pointer to a number within {', '.join('/' + part for part in PARTS)}"
    return InvalidRequest(f"/vary/pointer: {detail}", FieldRefusal("/vary/pointer", detail, None, allowed))
