"""Letting requests in a few at a time, so that a thousand that come at once do not hold up what is asked next."""

from __future__ import annotations

import asyncio
from collections import deque

#: Requests let in between two looks at what the network brought: some milliseconds of work.
AT_A_TIME = 16


class Pace:
    """A gate of one event loop: at most `AT_A_TIME` requests pass in each of its turns, in the order they came."""

    def __init__(self) -> None:
        self._passed = 0
        self._waiting: deque[asyncio.Future[None]] = deque()
        self._turning = False

    async def passing(self) -> None:
        """Return when it is this request's turn: at once, unless many came together."""
        loop = asyncio.get_running_loop()
        if not self._turning:
            self._turning = True
            loop.call_soon(self._turn, loop)
        if self._passed < AT_A_TIME and not self._waiting:
            self._passed += 1
            return
        turn = loop.create_future()
        self._waiting.append(turn)
        await turn

    def _turn(self, loop: asyncio.AbstractEventLoop) -> None:
        self._passed = 0
        while self._waiting and self._passed < AT_A_TIME:
            turn = self._waiting.popleft()
            if not turn.done():  # nobody waits any more where it was cancelled
                turn.set_result(None)
                self._passed += 1
        self._turning = bool(self._waiting)
        if self._turning:
            loop.call_soon(self._turn, loop)
