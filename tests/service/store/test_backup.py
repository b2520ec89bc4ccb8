"""Backups taken while the store is written to, and what is exported."""

from __future__ import annotations

import errno
import hashlib
import os
import threading
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import orjson
import pytest

from service.store import blobs as files
from service.store.backup import backup
from service.store.database import FILE_NAME
from service.store.designs import StoredDesign
from service.store.export import export
from service.store.integrity import Finding
from service.store.store import Store
from service.wire.refusals import StoreUnavailable

Made = Callable[..., StoredDesign]


def another_disk(*_: Any) -> None:
    raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))


@pytest.mark.parametrize("same_disk", [True, False])
def test_a_server_starts_on_the_copy(
    sqlite_store: Store, made: Made, tmp_path: Path, same_disk: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(5):
        sqlite_store.designs.add(made(f"d{number}", bytes([number]) * 1000, b"parts"), "ann")
    if not same_disk:
        monkeypatch.setattr(files.os, "link", another_disk)
    done = backup(sqlite_store, tmp_path / "copy")
    assert (done.database, done.files, done.bytes, done.findings) == (True, 6, 5005, ())
    digest = next(sqlite_store.blobs.digests())
    assert sqlite_store.blobs.place(digest).stat().st_nlink == (2 if same_disk else 1)
    # What happens to the store afterwards does not reach the copy.
    for number in range(5):
        sqlite_store.designs.delete(f"d{number}")
    for digest in list(sqlite_store.blobs.digests()):
        sqlite_store.blobs.place(digest).unlink()
    restored = Store(tmp_path / "copy")
    for number in range(5):
        assert restored.designs.get(f"d{number}", "ann") == made(f"d{number}", bytes([number]) * 1000, b"parts")
    assert restored.inspect(thorough=True) == ()
    assert restored.designs.add(made("new")).id == "new"
    restored.close()


def test_a_copy_taken_while_others_write_and_delete_is_one_state(
    sqlite_store: Store, made: Made, tmp_path: Path, aged: Callable[[Store, float], None]
) -> None:
    for number in range(40):
        sqlite_store.designs.add(made(f"old{number}", f"answer {number}".encode()))
    aged(sqlite_store, 7200)
    other = Store(tmp_path / "data")
    stop, written = threading.Event(), []

    def writes() -> None:
        while not stop.is_set():
            written.append(other.designs.add(made(f"new{len(written)}", os.urandom(20_000))))
            if len(written) <= 40:
                other.designs.delete(f"old{len(written) - 1}")

    thread = threading.Thread(target=writes)
    thread.start()
    try:
        for number in range(3):
            before = len(written)
            done = backup(sqlite_store, tmp_path / f"copy{number}")
            copy = Store(tmp_path / f"copy{number}")
            assert copy.inspect(thorough=True) == done.findings == ()
            idents = {design.id for design in copy.designs.page(10_000)}
            assert {f"new{k}" for k in range(before)} <= idents
            assert all(copy.designs.get(design.id) == design for design in written[:before])
            assert done.files == len(list(copy.blobs.digests()))
            copy.close()
    finally:
        stop.set()
        thread.join()
        other.close()


def test_damage_is_told_and_not_copied(sqlite_store: Store, made: Made, tmp_path: Path) -> None:
    sqlite_store.designs.add(made("a", b"whole"))
    sqlite_store.designs.add(made("b", b"damaged"))
    digest = hashlib.sha256(b"damaged").hexdigest()
    sqlite_store.blobs.place(digest).write_bytes(b"other")
    done = backup(sqlite_store, tmp_path / "copy")
    assert done.findings == (Finding("file", digest, "a file of the store is damaged"),)
    copy = Store(tmp_path / "copy")
    assert copy.findings == (Finding("file", digest, "it is missing"),)
    assert copy.designs.get("a") == made("a", b"whole")
    copy.close()


def test_a_backup_that_fails_leaves_nothing(
    sqlite_store: Store, made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sqlite_store.designs.add(made("a"))
    (tmp_path / "there").mkdir()
    with pytest.raises(FileExistsError):
        backup(sqlite_store, tmp_path / "there")

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "link", full)
    monkeypatch.setattr(files.os, "replace", full)
    with pytest.raises(StoreUnavailable, match="No space"):
        backup(sqlite_store, tmp_path / "copy")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "there"]


def test_of_postgresql_the_files_are_copied(tmp_path: Path, postgresql_url: str, made: Made) -> None:
    store = Store(tmp_path / "data", postgresql_url)
    store.designs.add(made("a", b"answer"))
    store.blobs.put(b"of nobody")
    done = backup(store, tmp_path / "copy")
    assert (done.database, done.files, done.bytes) == (False, 1, 6)
    assert not (tmp_path / "copy" / FILE_NAME).exists()
    store.close()
    restored = Store(tmp_path / "copy", postgresql_url)
    assert restored.designs.get("a") == made("a", b"answer")
    restored.close()


def test_an_export_holds_the_bytes_and_their_digests(store: Store, made: Made, tmp_path: Path) -> None:
    for ident in ("c", "B", "a"):
        store.designs.add(made(ident, ident.encode() * 100, b"parts"), "ann")
    store.designs.add(made("z"), "bob")
    assert export(store, tmp_path / "all") == 4
    assert export(store, tmp_path / "anns.zip", "ann") == 3
    with zipfile.ZipFile(tmp_path / "anns.zip") as archive:
        index = orjson.loads(archive.read("index.json"))
        assert [design["id"] for design in index["designs"]] == ["B", "a", "c"]
        for design in index["designs"]:
            for what, content in (("request", b'{"a":1}'), ("answer", design["id"].encode() * 100)):
                entry = design[what]
                assert archive.read(entry["file"]) == content
                assert (entry["bytes"], entry["sha256"]) == (len(content), hashlib.sha256(content).hexdigest())
        assert len(archive.namelist()) == 7
    assert (tmp_path / "all" / "designs" / "z" / "answer.json").read_bytes() == b"{}"


def test_the_same_designs_give_the_same_archive(tmp_path: Path, made: Made) -> None:
    archives = []
    for number, order in enumerate(("abc", "cab")):
        store = Store(tmp_path / f"data{number}")
        for ident in order:
            store.designs.add(made(ident, ident.encode() * 1000))
        store.close()
        store = Store(tmp_path / f"data{number}")
        export(store, tmp_path / f"{number}.zip")
        archives.append((tmp_path / f"{number}.zip").read_bytes())
        store.close()
    assert archives[0] == archives[1]


def test_an_export_goes_on_past_damage(store: Store, made: Made, tmp_path: Path) -> None:
    store.designs.add(made("a", b"lost"))
    store.designs.add(made("b", b"kept"))
    store.blobs.place(hashlib.sha256(b"lost").hexdigest()).unlink()
    assert export(store, tmp_path / "out") == 2
    lost, kept = orjson.loads((tmp_path / "out" / "index.json").read_bytes())["designs"]
    assert lost["answer"] is None
    assert "cannot be read" in lost["reason"]
    assert (tmp_path / "out" / lost["request"]["file"]).read_bytes() == b'{"a":1}'
    assert kept["reason"] is None
    with pytest.raises(FileExistsError):
        export(store, tmp_path / "out")
    with pytest.raises(StoreUnavailable):
        export(store, tmp_path / "out" / "index.json" / "below.zip")
