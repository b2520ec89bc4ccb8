"""A disk that refuses, at each step of a write in turn: 503 with the reason, nothing torn, and on when it is well."""

from __future__ import annotations

import builtins
import errno
import os
import resource
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import event

from service.app import create_app
from service.settings import Settings
from service.store import blobs
from service.store.designs import StoredDesign
from service.store.store import Store
from service.wire.refusals import StoreUnavailable
from tests.service.test_durability import call, server, status_of

Break = Callable[[pytest.MonkeyPatch, Store], None]


def refusal(number: int) -> OSError:
    return OSError(number, os.strerror(number))


def opening(number: int) -> Break:
    def broken(patch: pytest.MonkeyPatch, _: Store) -> None:
        def refuse(*_: Any) -> None:
            raise refusal(number)

        patch.setattr(blobs, "open", refuse, raising=False)

    return broken


def writing_half(patch: pytest.MonkeyPatch, _: Store) -> None:
    class Half:
        """A file that takes half of what it is given."""

        def __init__(self, *arguments: Any) -> None:
            self._file = builtins.open(*arguments)  # noqa: SIM115

        def __enter__(self) -> Half:
            return self

        def __exit__(self, *_: object) -> None:
            self._file.close()

        def write(self, content: bytes) -> None:
            self._file.write(content[: len(content) // 2])
            self._file.flush()
            raise refusal(errno.ENOSPC)

    patch.setattr(blobs, "open", Half, raising=False)


def syncing(kind: Callable[[int], bool]) -> Break:
    def broken(patch: pytest.MonkeyPatch, _: Store) -> None:
        sync = os.fsync

        def refuse(descriptor: int) -> None:
            if kind(os.fstat(descriptor).st_mode):
                raise refusal(errno.EIO)
            sync(descriptor)

        patch.setattr(blobs.os, "fsync", refuse)

    return broken


def renaming(patch: pytest.MonkeyPatch, _: Store) -> None:
    def refuse(*_: Any) -> None:
        raise refusal(errno.EDQUOT)

    patch.setattr(blobs.os, "replace", refuse)


def cleaning_up_as_well(patch: pytest.MonkeyPatch, store: Store) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise refusal(errno.EROFS)

    renaming(patch, store)
    patch.setattr(Path, "unlink", refuse)


def committing(patch: pytest.MonkeyPatch, store: Store) -> None:
    """SQLite may not make its file larger."""

    def full(connection: Any, *_: object) -> None:
        (pages,) = connection.execute("PRAGMA page_count").fetchone()
        connection.execute(f"PRAGMA max_page_count = {pages}")

    def well(connection: Any, *_: object) -> None:
        connection.execute("PRAGMA max_page_count = 1000000")

    event.listen(store.database.engine, "checkout", full)
    patch.setattr(store, "well_again", lambda: event.remove(store.database.engine, "checkout", full), raising=False)
    event.listen(store.database.engine, "checkin", well)
    with suppress(StoreUnavailable):  # the page that is begun is filled up
        for number in range(20):
            store.designs.add(StoredDesign(f"filler {number}", "", "", "", b"x" * 700, b""))


STEPS: dict[str, tuple[Break, str]] = {
    "open": (opening(errno.ENOSPC), "No space left"),
    "read-only": (opening(errno.EROFS), "Read-only"),
    "forbidden": (opening(errno.EACCES), "Permission denied"),
    "too many files": (opening(errno.EMFILE), "Too many open files"),
    "write": (writing_half, "No space left"),
    "fsync": (syncing(stat.S_ISREG), "Input/output error"),
    "rename": (renaming, "quota exceeded"),
    "clean-up": (cleaning_up_as_well, "quota exceeded"),
    "directory fsync": (syncing(stat.S_ISDIR), "Input/output error"),
    "commit": (committing, "SQLITE_FULL"),
}


@pytest.fixture
def running(tmp_path: Path) -> Iterator[TestClient]:
    with TestClient(create_app(Settings(data_dir=tmp_path)), raise_server_exceptions=False) as client:
        yield client


@pytest.mark.parametrize("step", STEPS)
def test_a_step_that_fails_loses_nothing(
    running: TestClient, quick: dict[str, Any], refused: Any, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    store: Store = running.app.state.shared.store  # type: ignore[attr-defined]
    kept = running.post("/v1/designs", json=quick)
    assert kept.status_code == 201
    other = quick | {"name": "while the disk is full"}
    broken, reason = STEPS[step]
    with monkeypatch.context() as patch:
        broken(patch, store)
        listed = running.get("/v1/designs").json()
        for _ in range(2):
            problem = refused(running.post("/v1/designs", json=other), 503)
            assert problem["code"] == "store_unavailable"
            assert reason in problem["detail"]
        assert running.get(kept.headers["location"]).content == kept.content
        assert running.post("/v1/designs", json=quick).status_code == 200
        assert running.get("/v1/designs").json() == listed
        assert store.inspect(thorough=True) == ()
        assert all(store.blobs.intact(digest) for digest in store.blobs.digests())
        if step == "commit":
            store.well_again()  # type: ignore[attr-defined]
    posted = running.post("/v1/designs", json=other)
    assert posted.status_code == 201
    assert running.get(posted.headers["location"]).content == posted.content
    assert store.inspect(thorough=True) == ()
    store.blobs.sweep_unfinished(-1.0)
    assert not list(store.blobs.place("0" * 64).parents[1].rglob("new-*"))


def test_a_server_whose_files_may_not_grow(tmp_path: Path, quick: dict[str, Any]) -> None:
    """The system itself refuses: all files beyond the first kilobyte, then only the log of the database."""
    with server(tmp_path) as (base, process):
        _, kept = call(base, "/v1/designs", quick)
        _, hard = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
        for most in (1024, 16_384):
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (most, hard))
            for number in range(3):
                assert status_of(base, "/v1/designs", quick | {"name": f"full {number}"}) == 503
            assert call(base, "/v1/designs", quick) == (200, kept)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (hard, hard))
        for number in range(3):
            assert status_of(base, "/v1/designs", quick | {"name": f"full {number}"}) == 201
    store = Store(tmp_path)
    assert store.inspect(thorough=True) == ()
    assert len(store.designs.page(9)) == 4
    store.close()
