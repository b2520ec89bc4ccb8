"""Operations of the OpenAPI document, and their addresses by the examples of their parameters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from urllib.parse import quote


def operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield path, method, operation


def example_of(parameter: dict[str, Any]) -> Any:
    """The example of a parameter; None when an optional one has none."""
    if "example" in parameter:
        return parameter["example"]
    examples = parameter.get("examples") or parameter["schema"].get("examples")
    assert examples or not parameter["required"], f"{parameter['name']} is required and has no example"
    return examples[0] if examples else None


def address(path: str, operation: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Path and query of the operation with the examples of its parameters."""
    query = {}
    for parameter in operation.get("parameters", []):
        value = example_of(parameter)
        if parameter["in"] == "path":
            path = path.replace(f"{{{parameter['name']}}}", quote(str(value)))
        elif value is not None:
            query[parameter["name"]] = value
    return path, query
