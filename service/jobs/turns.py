"""Whose turn it is: the one served longest ago."""

from __future__ import annotations

from collections.abc import Collection, Sequence


class Turns:
    """Remembers who was served when, of those whom it is told to keep."""

    def __init__(self) -> None:
        self._served: dict[str, int] = {}
        self._count = 0

    def keep(self, names: Collection[str]) -> None:
        """Forget all others."""
        self._served = {name: turn for name, turn in self._served.items() if name in names}

    def take(self, names: Sequence[str]) -> str:
        """Serve one of these: who was never served, in their order, before who was served longest ago."""
        chosen = min(names, key=lambda name: self._served.get(name, -1))
        self._count += 1
        self._served[chosen] = self._count
        return chosen
