"""Fields that may take several forms, told apart by their JSON type."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Discriminator


def json_kind(value: Any) -> str | None:
    """JSON type that tells the forms of a field apart; None when it is none of them."""
    if isinstance(value, list):
        return "array"
    if isinstance(value, (dict, BaseModel)):
        return "object"
    if isinstance(value, str):
        return "string"
    return "number" if isinstance(value, (int, float)) and not isinstance(value, bool) else None


BY_JSON_TYPE = Discriminator(
    json_kind,
    custom_error_type="wrong_form",
    custom_error_message="neither of the forms this field may take",
)
