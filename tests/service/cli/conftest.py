"""A request of one point, and a store with its design."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from service.designs import Designs
from service.envelopes import Envelopes
from service.schemas.requests import DesignRequest
from service.store.store import Store


@pytest.fixture
def request_file(tmp_path: Path, quick: dict[str, Any]) -> Path:
    file = tmp_path / "request.json"
    file.write_text(json.dumps(quick))
    return file


@pytest.fixture
def stored(tmp_path: Path, quick: dict[str, Any]) -> Path:
    """A data directory that holds one design."""
    store = Store(tmp_path / "data")
    try:
        Designs(store.designs, Envelopes(1)).create(DesignRequest.model_validate(quick))
    finally:
        store.close()
    return tmp_path / "data"
