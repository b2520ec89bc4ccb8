"""JSON documents that commands read and write: from a file or standard input, to a file at once or not at all."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from service.cli.refusing import Refused

#: Stands for standard input.
STDIN = Path("-")


def read_document(path: Path) -> dict[str, Any]:
    """The JSON object in a file, or on standard input.

    Raises
    ------
    OSError : it cannot be read
    Refused : it holds no JSON object
    """
    from service.wire.reading import read_json
    from service.wire.refusals import UnreadableBody

    content = sys.stdin.buffer.read() if path == STDIN else path.read_bytes()
    name = "standard input" if path == STDIN else str(path)
    try:
        document = read_json(content)
    except UnreadableBody as wrong:
        raise Refused("unreadable_file", f"{name}: {wrong.detail.removeprefix('the body ')}") from None
    if not isinstance(document, dict):
        raise Refused("unreadable_file", f"{name}: holds no JSON object")
    return document


def request_in(document: dict[str, Any]) -> dict[str, Any]:
    """The design request that a document is, or that the design in it answers."""
    request = document.get("request")
    return request if isinstance(request, dict) and "provenance" in document else document


def write_file(path: Path, content: bytes) -> None:
    """Have a file hold this content; what was there stays until all of it is written.

    Raises
    ------
    OSError
    """
    if path.exists() and not path.is_file():  # a device or a pipe is written to, not replaced
        path.write_bytes(content)
        return
    with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name[:64]}-", delete=False) as file:
        written = Path(file.name)
        try:
            file.write(content)
            file.flush()
            os.fchmod(file.fileno(), 0o666 & ~_umask())
            os.replace(written, path)
        except BaseException:
            with suppress(OSError):
                written.unlink()
            raise


def _umask() -> int:
    """Permissions that new files of this process do not get; can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def check_directory(path: Path) -> None:
    """Refuse a file for which there is no directory, before the work for it is done.

    Raises
    ------
    Refused
    """
    if not path.parent.is_dir():
        raise Refused("file_error", f"{path.parent}: there is no such directory")
