"""Content-addressed files: bytes under the name of their SHA-256, never torn, never changed."""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from service.wire.refusals import StoreUnavailable

#: Beginning of the names of files that are being written.
_UNFINISHED = "new-"
#: File with the id of the store whose files these are.
_OWNER = "identity"
_DIGEST = re.compile("[0-9a-f]{64}")


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
            # All at once, so that no write has to bring the name of a directory to the disk.
            for number in range(256):
                (root / f"{number:02x}").mkdir(exist_ok=True)
            _settle(root)
            _settle(root.parent)

    def put(self, content: bytes) -> str:
        """Keep these bytes; when this returns they are on the disk, and this is their digest.

        They count as put now also when they were there before: a row that names them has `discard`'s time to appear.
        """
        digest = hashlib.sha256(content).hexdigest()
        place = self.place(digest)
        with _on_disk("written"):
            if not self._renewed(place, content):
                _write(place, content)
            # Also for a file that was there: its writer may have failed at this very step.
            _settle(place.parent)
        return digest

    def get(self, digest: str) -> bytes:
        """The bytes with this digest.

        Raises
        ------
        StoreUnavailable : also when the file is missing or its bytes are others
        """
        with _on_disk("read"):
            content = self.place(digest).read_bytes()
        if hashlib.sha256(content).hexdigest() != digest:
            raise StoreUnavailable("a file of the store is damaged")
        return content

    def intact(self, digest: str) -> bool:
        """Whether the file is there, can be read, and is whole."""
        try:
            self.get(digest)
        except StoreUnavailable:
            return False
        return True

    def discard(self, digest: str, older: float) -> bool:
        """Delete these bytes if they were last put longer ago than this [s]; whether they were deleted."""
        place = self.place(digest)
        # No other process can put these bytes between the look at their age and the deletion.
        with _on_disk("deleted"), self._locked(fcntl.LOCK_EX), suppress(FileNotFoundError):
            if time.time() - place.stat().st_mtime > older:
                place.unlink()
                return True
        return False

    def digests(self) -> Iterator[str]:
        """Digests of all files, in no order."""
        with _on_disk("listed"):
            for path in self._root.glob("??/*"):
                if _DIGEST.fullmatch(path.name):
                    yield path.name

    def owner(self) -> str | None:
        """Id of the store whose files these are; None when nobody has said so."""
        with _on_disk("read"), suppress(FileNotFoundError):
            return (self._root / _OWNER).read_text("ascii")
        return None

    def become(self, owner: str) -> str:
        """Say that these are the files of the store with this id."""
        with _on_disk("written"):
            _write(self._root / _OWNER, owner.encode("ascii"))
            _settle(self._root)
        return owner

    def sweep_unfinished(self, older: float) -> int:
        """Delete what was being written, longer ago than this [s]; how many files."""
        swept = 0
        with _on_disk("swept"):
            for path in self._root.rglob(f"{_UNFINISHED}*"):
                with suppress(FileNotFoundError):
                    if time.time() - path.stat().st_mtime > older:
                        path.unlink()
                        swept += 1
        return swept

    def take_over(self, digest: str, source: Blobs) -> int:
        """Have these bytes from another directory too, checked: by a second name on the same disk, else as a copy.

        Returns
        -------
        Their number. Names are on the disk after `settle`.
        """
        content = source.get(digest)
        try:
            os.link(source.place(digest), self.place(digest))
        except FileExistsError:
            pass
        except OSError:  # another disk, or one without second names
            self.put(content)
        return len(content)

    def settle(self) -> None:
        """Bring the names of all files to the disk."""
        with _on_disk("written"):
            for directory in self._root.iterdir():
                if directory.is_dir():
                    _settle(directory)

    def place(self, digest: str) -> Path:
        """Where the bytes with this digest are, or would be."""
        return self._root / digest[:2] / digest

    def _renewed(self, place: Path, content: bytes) -> bool:
        """Whether the file is there and whole; then it counts as put now."""
        try:
            with self._locked(fcntl.LOCK_SH):
                os.utime(place)
            return place.read_bytes() == content
        except OSError:
            return False  # missing or unreadable: written anew, and refused there if the disk refuses

    @contextmanager
    def _locked(self, kind: int) -> Iterator[None]:
        """The lock between putting again and deleting, of all processes on this directory."""
        descriptor = os.open(self._root, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, kind)
            yield
        finally:
            os.close(descriptor)


def _write(place: Path, content: bytes) -> None:
    """Write a file under another name, bring it to the disk, rename it."""
    unfinished = place.parent / f"{_UNFINISHED}{secrets.token_hex(8)}"
    try:
        with open(unfinished, "xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, place)
    except OSError:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise


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
