"""How often a client may ask: by key in a moving minute, by address without one, and fewer wrong keys."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address

from limits import RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import FixedWindowRateLimiter, MovingWindowRateLimiter

#: Keys that open nothing, from one address in a minute; then no unknown key of this address is looked up.
WRONG_KEYS_PER_MINUTE = 20


@dataclass(frozen=True)
class Allowance:
    """What is left of a rate.

    Attributes
    ----------
    limit : requests in a minute
    left : of these, in the minute that is running
    wait : until there is more [s]
    taken : whether this request was within the rate
    """

    limit: int
    left: int
    wait: int
    taken: bool


class Rates:
    """Counts of one process; several workers count each for itself.

    Addresses are counted in fixed minutes, because those counts are forgotten when the minute is over: nobody fills
    the memory with addresses.
    """

    def __init__(self) -> None:
        storage = MemoryStorage()
        self._moving = MovingWindowRateLimiter(storage)
        self._fixed = FixedWindowRateLimiter(storage)

    def of_key(self, key_id: str, limit: int) -> Allowance:
        """Take one request from what a key may ask for in any 60 s."""
        return _taken(self._moving, limit, "key", key_id)

    def of_address(self, address: str, limit: int) -> Allowance:
        """Take one request from what an address may ask for in a minute."""
        return _taken(self._fixed, limit, "address", block_of(address))

    def wrong_key(self, address: str) -> None:
        """Count a key that opened nothing."""
        self._fixed.hit(RateLimitItemPerMinute(WRONG_KEYS_PER_MINUTE), "wrong", block_of(address))

    def wait_for_keys(self, address: str) -> int:
        """For how long no unknown key of this address is looked up [s]; 0 when they are."""
        item, block = RateLimitItemPerMinute(WRONG_KEYS_PER_MINUTE), block_of(address)
        if self._fixed.test(item, "wrong", block):
            return 0
        return _seconds(self._fixed.get_window_stats(item, "wrong", block).reset_time)


def block_of(address: str) -> str:
    """The address, of IPv6 its first 64 bits: what one client is given whole."""
    try:
        known = ip_address(address.partition("%")[0])
    except ValueError:
        return "unknown"
    if isinstance(known, IPv6Address):
        return str(known.ipv4_mapped or IPv6Address(int(known) >> 64 << 64))
    return str(known)


def _taken(limiter: MovingWindowRateLimiter | FixedWindowRateLimiter, limit: int, *who: str) -> Allowance:
    item = RateLimitItemPerMinute(limit)
    taken = limiter.hit(item, *who)
    stats = limiter.get_window_stats(item, *who)
    return Allowance(limit, max(stats.remaining, 0), _seconds(stats.reset_time), taken)


def _seconds(until: float) -> int:
    return min(max(math.ceil(until - time.time()), 1), 60)
