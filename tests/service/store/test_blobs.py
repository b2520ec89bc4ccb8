"""Files by their digest: whole or not there, and deleted only when nobody is about to name them."""

from __future__ import annotations

import hashlib
import os
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from service.store.blobs import Blobs
from service.wire.refusals import StoreUnavailable


@pytest.fixture
def blobs(tmp_path: Path) -> Blobs:
    return Blobs(tmp_path / "files")


def make_old(blobs: Blobs, digest: str, seconds: float = 7200.0) -> None:
    at = time.time() - seconds
    os.utime(blobs.place(digest), (at, at))


@pytest.mark.parametrize("content", [b"", b"x", os.urandom(3_000_000)])
def test_bytes_come_back(blobs: Blobs, content: bytes) -> None:
    digest = blobs.put(content)
    assert digest == hashlib.sha256(content).hexdigest()
    assert blobs.put(content) == digest
    assert blobs.get(digest) == content
    assert list(blobs.digests()) == [digest]


def test_damage_is_refused_and_mended_by_the_same_bytes(blobs: Blobs) -> None:
    digest = blobs.put(b"what was answered")
    for damaged in (b"", b"what was answere", b"what was answereD", b"what was answered!"):
        blobs.place(digest).write_bytes(damaged)
        assert not blobs.intact(digest)
        with pytest.raises(StoreUnavailable, match="damaged"):
            blobs.get(digest)
        assert blobs.put(b"what was answered") == digest
        assert blobs.get(digest) == b"what was answered"


def test_missing_is_refused_without_a_path(blobs: Blobs, tmp_path: Path) -> None:
    with pytest.raises(StoreUnavailable, match="No such file") as refused:
        blobs.get("0" * 64)
    assert str(tmp_path) not in refused.value.detail


def test_only_what_is_old_is_deleted(blobs: Blobs) -> None:
    old, young, again = (blobs.put(content) for content in (b"old", b"young", b"again"))
    make_old(blobs, old)
    make_old(blobs, again)
    blobs.put(b"again")
    assert [blobs.discard(digest, 3600.0) for digest in (old, young, again, "0" * 64)] == [True, False, False, False]
    assert set(blobs.digests()) == {young, again}


def test_what_is_put_again_is_never_deleted_at_that_moment(tmp_path: Path) -> None:
    """Two processes, one putting, one deleting what is old: when `put` returns, the file is there and stays."""
    one, other = Blobs(tmp_path), Blobs(tmp_path)
    stop = threading.Event()

    def deletes() -> None:
        while not stop.is_set():
            other.discard(digest, 3600.0)

    digest = one.put(b"contended")
    thread = threading.Thread(target=deletes)
    thread.start()
    try:
        for _ in range(300):
            with suppress(FileNotFoundError):  # the other may have deleted it already, being old
                make_old(one, digest)
            one.put(b"contended")
            assert one.get(digest) == b"contended"
    finally:
        stop.set()
        thread.join()


def test_unfinished_files_are_no_files_and_go_when_old(blobs: Blobs, tmp_path: Path) -> None:
    digest = blobs.put(b"finished")
    for name, age in (("new-1", 7200.0), ("new-2", 10.0)):
        path = tmp_path / "files" / "ab" / name
        path.write_bytes(b"half")
        os.utime(path, (time.time() - age,) * 2)
    make_old(blobs, digest)
    assert list(blobs.digests()) == [digest]
    assert blobs.sweep_unfinished(3600.0) == 1
    assert [path.name for path in (tmp_path / "files" / "ab").iterdir()] == ["new-2"]
    assert blobs.get(digest) == b"finished"
