"""Which code this is: the release, and a digest of the sources, so that a design names what made it."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

#: The packages that an answer depends on.
PACKAGES = ("model", "design", "schedules", "service")


@cache
def release() -> str:
    """Version of the installed distribution; ``0+unknown`` in a checkout that was never installed."""
    try:
        return version("gainfield")
    except PackageNotFoundError:
        return "0+unknown"


@cache
def code_version() -> str:
    """Release and digest of all sources: two servers that state the same one run the same code."""
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256()
    for package in PACKAGES:
        for source in sorted((root / package).rglob("*.py")):
            digest.update(source.relative_to(root).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return f"{release()}+{digest.hexdigest()[:12]}"


@cache
def solver() -> str:
    """The numerical libraries at work, with their versions."""
    return f"numpy {version('numpy')}, scipy {version('scipy')}"
