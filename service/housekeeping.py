"""Keeping house: now and then the store lets go of what is not kept any longer."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

from anyio import to_thread

from service.settings import Settings
from service.store.store import Store
from service.wire.refusals import StoreUnavailable

log = logging.getLogger("gainfield")


@asynccontextmanager
async def house_kept(store: Store, settings: Settings) -> AsyncIterator[None]:
    """Keep the house of a store now, and again every `housekeeping_s`, until this ends."""
    keeping = asyncio.ensure_future(_keep(store, settings))
    try:
        yield
    finally:
        keeping.cancel()
        with suppress(asyncio.CancelledError):
            await keeping


async def _keep(store: Store, settings: Settings) -> None:
    while True:
        try:
            await to_thread.run_sync(store.keep_house, settings, time.time())
        except StoreUnavailable as error:
            log.warning("housekeeping waits for the store: %s", error.detail)
        except Exception as error:  # a fault in it must not be the last that is heard of it
            log.error("housekeeping failed", exc_info=error)
        await asyncio.sleep(settings.housekeeping_s)
