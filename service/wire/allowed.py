"""What a JSON schema takes, in words: ``>= 0.001 and <= 100``, ``one of none, prandtl_glauert``."""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]

#: Keywords of JSON Schema, in the words of an allowed range.
_BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
_LENGTHS = {"minLength": "at least {} characters", "maxLength": "at most {} characters"}
_COUNTS = {"minItems": "at least {} items", "maxItems": "at most {} items"}


def dereferenced(schema: Schema, openapi: Schema) -> Schema:
    """The schema itself, where the document only refers to it."""
    while "$ref" in schema:
        schema = openapi["components"]["schemas"][schema["$ref"].rsplit("/", 1)[-1]]
    return schema


def is_null(schema: Schema) -> bool:
    """Whether null is all that this schema takes."""
    return schema.get("type") == "null"


def allowed_by(schema: Schema, openapi: Schema) -> str | None:
    """What a schema of the document takes, in words; None when it says nothing."""
    branches = schema.get("oneOf", []) + schema.get("anyOf", [])
    nullable = schema.get("nullable", False) or any(is_null(branch) for branch in branches)
    if branches:
        words = [allowed_by(dereferenced(b, openapi), openapi) for b in branches if not is_null(b)]
        text = "; or ".join(word for word in words if word)
    else:
        text = _by_type(schema)
    if nullable:
        text = f"{text}, or null" if text else "null"
    return text or None


def _by_type(schema: Schema) -> str:
    if "const" in schema:
        return f"only {schema['const']}"
    if "enum" in schema:
        return "one of " + ", ".join(str(value) for value in schema["enum"])
    match schema.get("type"):
        case "number":
            return _range(schema) or "a number"
        case "integer":
            return f"an integer {_range(schema)}".strip()
        case "string":
            pattern = [f"matching {schema['pattern']}"] if "pattern" in schema else []
            return ", ".join(["text", *_sizes(schema, _LENGTHS), *pattern])
        case "array":
            return ", ".join(["a list", *_sizes(schema, _COUNTS)])
        case "object":
            return "an object with the fields " + ", ".join(schema.get("properties", {}))
        case "boolean":
            return "true or false"
        case "null":
            return "null"
    return ""


def _range(schema: Schema) -> str:
    bounds = (f"{sign} {schema[key]:g}" for key, sign in _BOUNDS.items() if key in schema)
    return " and ".join(bounds)


def _sizes(schema: Schema, words: dict[str, str]) -> list[str]:
    return [text.format(schema[key]) for key, text in words.items() if key in schema]
