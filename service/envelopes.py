"""Designed envelopes kept in memory: the few used last, each made by one thread while others wait for it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock

from schedules.designed import DesignedEnvelope


class Envelopes:
    """Envelopes by design id, so many and so large as may be; the one used longest ago goes first, the last one stays.

    Parameters
    ----------
    kept : how many at most
    point_designs : grid points times controllers of all of them at most; None: as many as there are
    """

    def __init__(self, kept: int, point_designs: int | None = None) -> None:
        self._kept, self._point_designs = kept, point_designs
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
            while len(self._ready) > 1 and self._too_many():
                self._ready.popitem(last=False)

    def _too_many(self) -> bool:
        if len(self._ready) > self._kept or self._point_designs is None:
            return len(self._ready) > self._kept
        return (
            sum(one.plant.outcomes.codes.size * len(one.controllers) for one in self._ready.values())
            > self._point_designs
        )
