"""Content-addressed files: bytes under the name of their SHA-256, never torn, never changed."""

from __future__ import annotations

import hashlib
import os
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.refusals import StoreUnavailable

#: Beginning of the names of files that are being written.
_UNFINISHED = "new-"


class Blobs:
    """Files below one directory, each named by the digest of its bytes.

    A file is written under another name, brought to the disk and renamed, so that what has a digest for a name is
    whole; that it still is, is checked whenever it is read.

    Raises
    ------
    StoreUnavailable : from every method, when the disk refuses; nothing that was there before is lost
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        with _on_disk("made"):
            root.mkdir(parents=True, exist_ok=True)

    def put(self, content: bytes) -> str:
        """Keep these bytes; when this returns they are on the disk, and this is their digest."""
        digest = hashlib.sha256(content).hexdigest()
        place = self._place(digest)
        with _on_disk("written"):
            if place.exists():
                os.utime(place)
                return digest
            if not place.parent.exists():
                place.parent.mkdir(exist_ok=True)
                _settle(self._root)
            unfinished = place.parent / f"{_UNFINISHED}{secrets.token_hex(8)}"
            try:
                with open(unfinished, "xb") as file:
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
                os.replace(unfinished, place)
            except OSError:
                unfinished.unlink(missing_ok=True)
                raise
            _settle(place.parent)
        return digest

    def get(self, digest: str) -> bytes:
        """The bytes with this digest.

        Raises
        ------
        StoreUnavailable : also when the file is missing or its bytes are others
        """
        with _on_disk("read"):
            content = self._place(digest).read_bytes()
        if hashlib.sha256(content).hexdigest() != digest:
            raise StoreUnavailable("a file of the store is damaged")
        return content

    def delete(self, digest: str) -> None:
        """Forget these bytes; no error when they are not there."""
        with _on_disk("deleted"):
            self._place(digest).unlink(missing_ok=True)

    def digests(self) -> Iterator[str]:
        """Digests of all files, in no order."""
        with _on_disk("listed"):
            for path in self._root.glob("??/*"):
                if not path.name.startswith(_UNFINISHED):
                    yield path.name

    def age(self, digest: str) -> float:
        """How long ago these bytes were last put [s]; 0 when they are not there."""
        try:
            return max(time.time() - self._place(digest).stat().st_mtime, 0.0)
        except FileNotFoundError:
            return 0.0

    def sweep_unfinished(self, older: float) -> int:
        """Delete what was being written, longer ago than this [s]; how many files."""
        swept = 0
        with _on_disk("swept"):
            for path in self._root.glob(f"??/{_UNFINISHED}*"):
                if time.time() - path.stat().st_mtime > older:
                    path.unlink(missing_ok=True)
                    swept += 1
        return swept

    def _place(self, digest: str) -> Path:
        return self._root / digest[:2] / digest


@contextmanager
def _on_disk(action: str) -> Iterator[None]:
    """Turns what the operating system refuses into what the service answers, without a path."""
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else type(error).__name__
        raise StoreUnavailable(f"a file of the store cannot be {action}: {reason}") from error


def _settle(directory: Path) -> None:
    """Bring the names in a directory to the disk."""
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
