"""Designed envelopes kept in memory: the few used last, each made by one thread while others wait for it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock

from schedules.designed import DesignedEnvelope


class Envelopes:
    """At most `kept` envelopes by design id; the one used longest ago goes first."""

    def __init__(self, kept: int) -> None:
        self._kept = kept
        self._ready: OrderedDict[str, DesignedEnvelope] = OrderedDict()
        self._making: dict[str, Lock] = {}
        self._lock = Lock()

    def __contains__(self, ident: str) -> bool:
        """Whether the envelope is in memory."""
        return ident in self._ready

    def get(self, ident: str, make: Callable[[], DesignedEnvelope]) -> DesignedEnvelope:
        """The envelope, made by `make` when it is not in memory. What `make` raises is passed on."""
        with self._lock:
            making = self._making.setdefault(ident, Lock())
        with making:
            envelope = self._lookup(ident)
            if envelope is None:
                try:
                    envelope = make()
                    self._keep(ident, envelope)
                finally:
                    with self._lock:
                        self._making.pop(ident, None)
        return envelope

    def _lookup(self, ident: str) -> DesignedEnvelope | None:
        with self._lock:
            found = self._ready.get(ident)
            if found is not None:
                self._ready.move_to_end(ident)
                self._making.pop(ident, None)
            return found

    def _keep(self, ident: str, envelope: DesignedEnvelope) -> None:
        with self._lock:
            self._ready[ident] = envelope
            while len(self._ready) > self._kept:
                self._ready.popitem(last=False)
