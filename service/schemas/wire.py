"""What every request and every answer has in common: strict, closed, finite, with units in the schema."""

from __future__ import annotations

from typing import Any, cast

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError

from service.wire.units import state_units


class Request(BaseModel):
    """A part of a request. A number is a number (not a string, not a boolean) and finite; no unknown field."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        allow_inf_nan=False,
        frozen=True,
        serialize_by_alias=True,
        json_schema_extra=state_units,
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The schema of the fields, also of a part that leaves some out where it is written: any object otherwise."""
        return handler(cast("CoreSchema", _as_read(cast("dict[str, Any]", core_schema))))

    def normalised(self) -> dict[str, Any]:
        """The request as JSON values, defaults filled in: what is hashed, kept and answered."""
        return self.model_dump(mode="json")


def _as_read(schema: dict[str, Any]) -> dict[str, Any]:
    """A schema of pydantic's core without its serializer, which stands below its validators."""
    inner = {"schema": _as_read(schema["schema"])} if schema["type"].startswith("function-") else {}
    return {name: part for name, part in (schema | inner).items() if name != "serialization"}


class Answer(BaseModel):
    """A part of an answer. Every field is always there; a value that does not exist is null."""

    model_config = ConfigDict(extra="forbid", json_schema_extra=state_units)


def refusal(detail: str, allowed: str, at: str = "") -> PydanticCustomError:
    """What a validator raises: what is wrong, what is allowed, and where, as a pointer below its own field.

    Braces of `detail` would be taken for a template, so the words travel in the context.
    """
    return PydanticCustomError("refused", "{detail}", {"detail": detail, "allowed": allowed, "at": at})


#: Configuration of query parameters: text turned into numbers, finite, and no unknown parameter.
PARAMETERS = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, json_schema_extra=state_units)
