"""Several pieces of bytes in one: each behind its length."""

from __future__ import annotations

from collections.abc import Sequence

_LENGTH = 8


def joined(pieces: Sequence[bytes]) -> bytes:
    """The pieces, one behind the other."""
    return b"".join(len(piece).to_bytes(_LENGTH, "big") + piece for piece in pieces)


def cut(content: bytes) -> list[bytes]:
    """The pieces that were `joined`.

    Raises
    ------
    ValueError : they end within a piece
    """
    pieces, at = [], 0
    while at < len(content):
        start = at + _LENGTH
        at = start + int.from_bytes(content[at:start], "big")
        if at > len(content):
            raise ValueError("the content ends within a piece")
        pieces.append(content[start:at])
    return pieces
