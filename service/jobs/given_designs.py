"""Designs that a task brings along, so that its worker needs no store."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any

from service.store.designs import DesignStore, StoredDesign

_BYTES = ("request", "answer", "parts")


class GivenDesigns(DesignStore):
    """The designs that a task brought along, and no others."""

    def __init__(self, designs: Mapping[str, StoredDesign]) -> None:
        self._designs = designs

    def get(self, ident: str, owner: str | None = None) -> StoredDesign | None:
        """The design under this id, None when it did not come along."""
        return self._designs.get(ident)


def design_document(design: StoredDesign) -> dict[str, Any]:
    """A design as JSON."""
    words = {name: getattr(design, name) for name in ("id", "name", "created_at", "version")}
    content = {name: getattr(design, name) for name in _BYTES}
    return words | {name: None if value is None else b64encode(value).decode() for name, value in content.items()}


def read_design(document: Mapping[str, Any]) -> StoredDesign:
    """The design that was written so."""
    content = {name: None if document[name] is None else b64decode(document[name]) for name in _BYTES}
    return StoredDesign(**(dict(document) | content))
