"""What differs between two normalised requests: JSON pointers with both values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

#: Differences that are listed, and characters of a text that are shown.
MOST_LISTED, MOST_CHARACTERS = 500, 200
_ABSENT = object()


@dataclass(frozen=True)
class Difference:
    """One place where two requests differ.

    Attributes
    ----------
    pointer : JSON pointer into both
    value, other : there; None where absent
    only_in : ``this`` or ``other`` where only one request has it; None where both have
    """

    pointer: str
    value: Any
    other: Any
    only_in: str | None


def differences(one: Any, other: Any, pointer: str = "") -> Iterator[Difference]:
    """Every place where two JSON documents differ, the deepest there is; lists are compared place by place."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            here = f"{pointer}/{key.replace('~', '~0').replace('/', '~1')}"
            yield from differences(one.get(key, _ABSENT), other.get(key, _ABSENT), here)
    elif isinstance(one, list) and isinstance(other, list):
        for place in range(max(len(one), len(other))):
            mine, theirs = (each[place] if place < len(each) else _ABSENT for each in (one, other))
            yield from differences(mine, theirs, f"{pointer}/{place}")
    elif one is _ABSENT or other is _ABSENT:
        yield Difference(pointer, _shown(one), _shown(other), "other" if one is _ABSENT else "this")
    elif one != other or isinstance(one, bool) != isinstance(other, bool):
        yield Difference(pointer, _shown(one), _shown(other), None)


def _shown(value: Any) -> Any:
    if value is _ABSENT:
        return None
    if isinstance(value, str) and len(value) > MOST_CHARACTERS:
        return f"{value[:MOST_CHARACTERS]}.. ({len(value)} characters)"
    return value
