"""Designs made again from the pieces they were made of: by the code that made these, and by no other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import orjson
import pytest
from fastapi.testclient import TestClient

from schedules.parts import Synthesised
from service import designs
from service.app import create_app
from service.jobs.frames import cut, joined
from service.settings import Settings
from service.store.designs import StoredDesign
from service.store.store import Store
from service.version import code_version

FACTOR = 1.001


@pytest.fixture
def made(tmp_path: Path, wanted: dict[str, Any]) -> StoredDesign:
    """A tab-only design at one point, with the pieces it was made of."""
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    wanted["controllers"] = wanted["controllers"][:1]
    with TestClient(create_app(Settings(data_dir=tmp_path))) as client:
        ident = client.post("/v1/designs", json=wanted).json()["id"]
    store = Store(tmp_path)
    found = store.designs.get(ident)
    store.close()
    assert found is not None
    assert found.parts is not None
    return found


def otherwise(design: StoredDesign, ident: str, version: str) -> StoredDesign:
    """What a code would have kept that finds gains a little larger."""
    assert design.parts is not None
    pieces = []
    for content in cut(design.parts):
        piece = Synthesised.from_bytes(content)
        gains = tuple(replace(gain, values=FACTOR * gain.values) for gain in piece.design.gains)
        pieces.append(replace(piece, design=replace(piece.design, gains=gains)).to_bytes())
    document = orjson.loads(design.answer)
    for gain in document["controllers"][0]["gains"]:
        gain["values"] = [[FACTOR * value for value in row] for row in gain["values"]]
    return replace(design, id=ident, version=version, answer=orjson.dumps(document), parts=joined(pieces))


@pytest.mark.parametrize(("version", "status"), [("0.0.1", 409), (code_version(), 200)])
def test_pieces_of_other_code_are_not_taken_for_what_this_code_finds(
    tmp_path: Path, made: StoredDesign, refused: Any, version: str, status: int
) -> None:
    """Kept gains and the gains of kept pieces agree in both cases: only the version tells them apart."""
    store = Store(tmp_path)
    store.designs.add(otherwise(made, "0" * 32, version))
    store.close()
    with TestClient(create_app(Settings(data_dir=tmp_path)), raise_server_exceptions=False) as client:
        answer = client.get(f"/v1/designs/{'0' * 32}/points/0")
    if status == 409:
        assert refused(answer, 409)["code"] == "stale_design"
    else:
        assert answer.status_code == 200, answer.text


def test_nothing_is_searched_again(tmp_path: Path, made: StoredDesign, monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(*_: Any) -> None:
        raise AssertionError("the gains were searched again")

    monkeypatch.setattr(designs, "designed", searched)
    with TestClient(create_app(Settings(data_dir=tmp_path))) as client:
        assert client.get(f"/v1/designs/{made.id}/points/0").status_code == 200
