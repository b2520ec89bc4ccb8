"""Damage is found at start and by command, told in the log, and left as it is."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import delete, text

from service.store.database import FILE_NAME
from service.store.designs import StoredDesign
from service.store.integrity import Finding
from service.store.store import Store
from service.store.tables import ownerships

Made = Callable[..., StoredDesign]
Open = Callable[[], Store]


def test_a_whole_store_has_no_findings(opened: Open, made: Made) -> None:
    store = opened()
    store.designs.add(made("a", b"answer", b"parts"))
    assert store.inspect(thorough=True) == ()
    assert opened().findings == ()


def test_a_missing_file_is_told_at_start_and_the_rest_is_served(
    opened: Open, made: Made, caplog: pytest.LogCaptureFixture
) -> None:
    store = opened()
    store.designs.add(made("a", b"lost"))
    store.designs.add(made("b", b"kept"))
    (lost,) = [digest for digest in store.blobs.digests() if store.blobs.get(digest) == b"lost"]
    store.blobs.place(lost).unlink()
    store.close()
    with caplog.at_level(logging.ERROR, "gainfield"):
        again = opened()
    assert again.findings == (Finding("file", lost, "it is missing"),)
    assert lost in caplog.text
    assert again.designs.get("b") == made("b", b"kept")
    assert [design.id for design in again.designs.page(9)] == ["b", "a"]
    assert again.designs.delete("a")
    assert again.inspect() == ()


@pytest.mark.parametrize("content", [b"", b"other bytes"])
def test_a_damaged_file_is_found_by_reading_it(store: Store, made: Made, content: bytes) -> None:
    store.designs.add(made("a", b"answer"))
    (digest,) = store.blobs.digests()
    store.blobs.place(digest).write_bytes(content)
    assert store.inspect() == ()
    assert store.inspect(thorough=True) == (Finding("file", digest, "a file of the store is damaged"),)
    assert store.blobs.place(digest).read_bytes() == content


def test_a_design_of_nobody_is_found(store: Store, made: Made) -> None:
    store.designs.add(made("a"))
    with store.database.writing() as connection:
        connection.execute(delete(ownerships))
    assert store.inspect() == (Finding("design", "a", "nobody owns it"),)


def test_many_findings_do_not_flood_the_log(store: Store, made: Made, caplog: pytest.LogCaptureFixture) -> None:
    for number in range(50):
        store.designs.add(made(f"d{number}", bytes([number])))
    for digest in list(store.blobs.digests()):
        store.blobs.place(digest).unlink()
    with caplog.at_level(logging.ERROR, "gainfield"):
        assert len(store.inspect()) == 50
    assert len(caplog.records) == 21
    assert "30 more" in caplog.text


def test_damaged_pages_are_told_and_the_file_is_left(tmp_path: Path, made: Made) -> None:
    store = Store(tmp_path)
    for number in range(200):
        store.designs.add(made(f"d{number}", bytes([number])))
    with store.database.reading() as connection:
        root = connection.scalar(text("SELECT rootpage FROM sqlite_master WHERE name = 'designs_by_use'"))
        size = connection.scalar(text("PRAGMA page_size"))
    store.close()
    file = tmp_path / FILE_NAME
    content = bytearray(file.read_bytes())
    content[(root - 1) * size : root * size] = b"\xa5" * size
    file.write_bytes(content)
    again = Store(tmp_path)
    assert {finding.subject for finding in again.findings} == {"database"}
    # What does not need the page goes on.
    assert again.designs.get("d7") == made("d7", bytes([7]))
    again.close()
    assert file.read_bytes()[(root - 1) * size : root * size] == b"\xa5" * size
