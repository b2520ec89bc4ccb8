"""From a validation error to the field it is about: JSON pointer, unit and allowed values.

The places come from the OpenAPI document itself, so that an error never promises another range than the
documentation does.
"""

from __future__ import annotations

from typing import Any

from service.wire.allowed import Schema, allowed_by, dereferenced, is_null
from service.wire.refusals import FieldRefusal

#: What is wrong, where pydantic's own words are about Python.
_DETAILS = {
    "missing": "this field is required",
    "none_required": "only null is taken by this version",
    "string_unicode": "not valid Unicode: a lone surrogate in text, or in the name of a field here",
    "model_type": "must be a JSON object",
    "model_attributes_type": "must be a JSON object",
    "list_type": "must be a JSON array",
    "finite_number": "must be a finite number",
}


class Place:
    """A place in a document and the schema that holds there, found by walking from the document's root."""

    def __init__(self, openapi: Schema, root: Schema) -> None:
        self._openapi = openapi
        self.schema = self._resolved(root)
        self.pointer = ""
        self.unit: str | None = None

    def step(self, part: str | int) -> None:
        """Go one part of a validation error's location further; tags of unions lead to no new pointer."""
        branch = self._branch(part)
        if branch is not None:
            self.schema = branch
            return
        self.pointer += "/" + str(part).replace("~", "~0").replace("/", "~1")
        if isinstance(part, int):
            self.schema = self._resolved(self.schema.get("items", {}))
            return
        self.schema = self._resolved(self.schema.get("properties", {}).get(part) or self._value_of_any_key())
        self.unit = self.schema.get("unit")

    def follow(self, pointer: str) -> None:
        """Go along a JSON pointer from here."""
        for part in pointer.split("/")[1:]:
            self.step(int(part) if part.isdigit() else part)

    @property
    def allowed(self) -> str | None:
        """What the schema here takes, in words."""
        return allowed_by(self.schema, self._openapi)

    @property
    def fields(self) -> str:
        """The fields an object here may have."""
        return "fields " + ", ".join(self.schema.get("properties", {}))

    @property
    def kinds(self) -> str:
        """The values of the field that tells the branches of a union apart."""
        return "one of " + ", ".join(self.schema.get("discriminator", {}).get("mapping", {}))

    def _resolved(self, schema: Schema) -> Schema:
        """The schema itself, behind references and beside null; its unit may stand outside."""
        inner = dereferenced(schema, self._openapi)
        choices = [branch for branch in inner.get("anyOf", []) if not is_null(branch)]
        if len(choices) == 1:
            inner = self._resolved(choices[0]) | {"nullable": True}
        return inner | {"unit": schema["unit"]} if "unit" in schema else inner

    def _value_of_any_key(self) -> Schema:
        """Schema of the values of an object whose keys are free; the empty one when there is none."""
        values = self.schema.get("additionalProperties", {})
        return values if isinstance(values, dict) else {}

    def _branch(self, part: str | int) -> Schema | None:
        """The branch of a union that a tag names: by its discriminator, or by its JSON type."""
        field = self.schema.get("discriminator", {}).get("propertyName")
        for branch in (self._resolved(branch) for branch in self.schema.get("oneOf", [])):
            tag = branch.get("properties", {}).get(field, {}).get("const") if field else branch.get("type")
            if tag == part:
                return branch
        return None


def field_refusal(error: dict[str, Any], openapi: Schema, operation: Schema) -> FieldRefusal:
    """The refusal of one field from one of pydantic's validation errors.

    Parameters
    ----------
    error : one of ``RequestValidationError.errors()``
    openapi : the OpenAPI document
    operation : the part of it that describes the operation asked for
    """
    where, *parts = error["loc"]
    kind, context = error["type"], error.get("ctx", {})
    place = Place(openapi, _root(where, operation))
    for part in parts[:-1]:
        place.step(part)
    known = place.fields
    for part in parts[-1:]:
        place.step(part)
    if kind == "extra_forbidden":
        return FieldRefusal(place.pointer, "unknown field", None, known)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        pointer = f"{place.pointer}/{context['discriminator'].strip(chr(39))}"
        return FieldRefusal(pointer, "missing or unknown kind", None, place.kinds)
    detail = _DETAILS.get(kind) or str(context.get("detail") or error["msg"].replace("Input should", "must"))
    allowed = context.get("allowed") or place.allowed
    place.follow(context.get("at", ""))
    return FieldRefusal(place.pointer, detail, place.unit, allowed)


def _root(where: Any, operation: Schema) -> Schema:
    """Schema of the request body, or of an object whose properties are the parameters."""
    if where == "body":
        content = operation.get("requestBody", {}).get("content", {})
        schema: Schema = content.get("application/json", {}).get("schema", {})
        return schema
    named = {p["name"]: p["schema"] for p in operation.get("parameters", []) if p["in"] == where}
    return {"type": "object", "properties": named}
