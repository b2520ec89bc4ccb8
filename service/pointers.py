"""From a validation error to the field it is about: JSON pointer, unit and allowed values.

The places come from the OpenAPI document itself, so that an error never promises another range than the
documentation does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from service.refusals import FieldRefusal

Schema = dict[str, Any]
#: Comparisons of JSON Schema, in the words of an allowed range.
_BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
_SIZES = {"minLength": "at least {} characters", "maxLength": "at most {} characters"}
_COUNTS = {"minItems": "at least {} items", "maxItems": "at most {} items"}


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
        self.schema = self._resolved(self.schema.get("properties", {}).get(part, {}))
        self.unit = self.schema.get("unit")

    def allowed(self) -> str | None:
        """What the schema here takes, in words."""
        return allowed_by(self.schema, self._openapi)

    def fields(self) -> str:
        """The fields an object here may have."""
        return "fields " + ", ".join(self.schema.get("properties", {}))

    def _resolved(self, schema: Schema) -> Schema:
        """The schema itself, behind references and beside null."""
        schema, outer = _dereferenced(schema, self._openapi), schema
        choices = [s for s in schema.get("anyOf", []) if s.get("type") != "null"]
        if len(choices) == 1:
            schema = self._resolved(choices[0]) | {"nullable": True}
        unit = outer.get("unit")
        return schema | {"unit": unit} if unit else schema

    def _branch(self, part: str | int) -> Schema | None:
        """The branch of a union that a tag names: by its discriminator, or by its JSON type."""
        branches = [self._resolved(s) for s in self.schema.get("oneOf", [])]
        field = self.schema.get("discriminator", {}).get("propertyName")
        for branch in branches:
            tag = branch.get("properties", {}).get(field, {}).get("const") if field else branch.get("type")
            if tag == part:
                return branch
        return None


def _dereferenced(schema: Schema, openapi: Schema) -> Schema:
    while "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[-1]
        schema = openapi["components"]["schemas"][name]
    return schema


def allowed_by(schema: Schema, openapi: Schema) -> str | None:
    """What a schema takes, in words: ``>= 0.001 and <= 100``, ``one of none, prandtl_glauert``."""
    if branches := schema.get("oneOf") or [s for s in schema.get("anyOf", []) if s.get("type") != "null"]:
        words = [allowed_by(_dereferenced(s, openapi), openapi) or "" for s in branches]
        text = "; or ".join(word for word in words if word)
    else:
        text = _of_type(schema)
    if schema.get("nullable") or any(s.get("type") == "null" for s in schema.get("anyOf", [])):
        text = f"{text}, or null" if text else "null"
    return text or None


def _of_type(schema: Schema) -> str:
    if "const" in schema:
        return f"only {schema['const']}"
    if "enum" in schema:
        return "one of " + ", ".join(str(value) for value in schema["enum"])
    kind = schema.get("type")
    if kind in ("number", "integer"):
        bounds = [f"{sign} {schema[key]:g}" for key, sign in _BOUNDS.items() if key in schema]
        return (
            " and ".join([kind, *bounds])
            if not bounds
            else ("an integer " * (kind == "integer")) + " and ".join(bounds)
        )
    if kind == "string":
        sizes = [text.format(schema[key]) for key, text in _SIZES.items() if key in schema]
        return ", ".join(["text", *sizes, *([f"matching {schema['pattern']}"] if "pattern" in schema else [])])
    if kind == "array":
        return ", ".join(["a list", *(text.format(schema[key]) for key, text in _COUNTS.items() if key in schema)])
    if kind == "object":
        return "an object with the fields " + ", ".join(schema.get("properties", {}))
    return {"boolean": "true or false", "null": "null"}.get(str(kind), "")


def field_refusal(error: dict[str, Any], openapi: Schema, operation: Schema) -> FieldRefusal:
    """The refusal of one field from one of pydantic's validation errors."""
    where, *parts = error["loc"]
    place = _start(where, parts, openapi, operation)
    kind, context = error["type"], error.get("ctx", {})
    unknown = kind == "extra_forbidden"
    for part in parts[:-1] if unknown else parts:
        place.step(part)
    if unknown:
        allowed = place.fields()
        place.step(parts[-1])
        return FieldRefusal(place.pointer, "unknown field", None, allowed)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        tags = _tags(place)
        pointer = f"{place.pointer}/{context['discriminator'].strip(chr(39))}"
        return FieldRefusal(pointer, "missing or unknown kind", None, f"one of {tags}")
    detail, allowed = _detail(kind, error, context), context.get("allowed") or place.allowed()
    for part in context.get("at", "").split("/")[1:]:
        place.step(int(part) if part.isdigit() else part)
    return FieldRefusal(place.pointer, detail, place.unit, allowed)


def _start(where: Any, parts: Sequence[str | int], openapi: Schema, operation: Schema) -> Place:
    """Root of the walk: the request body, or an object whose properties are the parameters."""
    if where == "body":
        content = operation.get("requestBody", {}).get("content", {})
        return Place(openapi, content.get("application/json", {}).get("schema", {}))
    named = {p["name"]: p["schema"] for p in operation.get("parameters", []) if p["in"] == where}
    return Place(openapi, {"type": "object", "properties": named})


def _tags(place: Place) -> str:
    return ", ".join(place.schema.get("discriminator", {}).get("mapping", {}))


def _detail(kind: str, error: dict[str, Any], context: dict[str, Any]) -> str:
    """What is wrong, in our words where pydantic's are about Python."""
    ours = {
        "missing": "this field is required",
        "none_required": "only null is taken by this version",
        "string_unicode": "not valid Unicode: a lone surrogate in text, or in the name of a field here",
        "model_type": "must be a JSON object",
        "model_attributes_type": "must be a JSON object",
        "list_type": "must be a JSON array",
        "finite_number": "must be a finite number",
    }
    if kind == "refused":
        return str(context["detail"])
    return ours.get(kind, str(error["msg"]).replace("Input should", "must"))
